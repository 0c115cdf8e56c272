//! Quantisation steps that the context model chooses for each anchor.

use crate::real::Real;

/// Least and largest log₂(step/base): what the coder's integer exponents reach, −24 and 7 eighths of an octave.
pub const EXPONENTS: [f64; 2] = [-3.0, 0.875];

/// `value`, at least `low` and at most `high`.
#[inline(always)]
pub fn clamp<R: Real>(value: R, [low, high]: [f64; 2]) -> R {
    value.larger(R::real(low)).smaller(R::real(high))
}

/// The gradient that passes back through [`clamp`]: all of it inside the range, outside only what leads back into it, so
/// that no value is stuck there.
#[inline(always)]
pub fn clamp_backward<R: Real>(value: R, [low, high]: [f64; 2], gradient: R) -> R {
    let leads_out = (value > R::real(high) && gradient < R::ZERO) || (value < R::real(low) && gradient > R::ZERO);
    if leads_out { R::ZERO } else { gradient }
}

/// step = base·2^e, e clamped to [`EXPONENTS`] (our form of the adaptive quantisation of Chen et al. 2024, HAC:
/// there step = base·(1 + tanh e)).
///
/// * `exponents`, `steps`: `[n, 3]` for features, log-scales, offsets; `steps` is overwritten.
pub fn forward<R: Real>(base_steps: [R; 3], exponents: &[R], steps: &mut [R]) {
    for (exponents, steps) in exponents.chunks_exact(3).zip(steps.chunks_exact_mut(3)) {
        for group in 0..3 {
            let exponent = clamp(exponents[group], EXPONENTS);
            steps[group] = base_steps[group] * (exponent * R::real(std::f64::consts::LN_2)).exp();
        }
    }
}

/// Gradients of [`forward`]: ∂step/∂e = step·ln 2.
///
/// * `d_exponents`: `[n, 3]`, added to.
pub fn backward<R: Real>(exponents: &[R], steps: &[R], d_steps: &[R], d_exponents: &mut [R]) {
    for (((e, step), d_step), d_e) in exponents.iter().zip(steps).zip(d_steps).zip(d_exponents) {
        *d_e += clamp_backward(*e, EXPONENTS, *d_step * *step * R::real(std::f64::consts::LN_2));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_gradient, random};

    #[test]
    fn backward_agrees_with_finite_differences() {
        let base = [1.0, 0.1, 0.2];
        let exponents: Vec<f64> = random(3, 30).iter().map(|v| 1.9 * v - 1.1).collect();
        let weights = random(4, 30);
        let run = |exponents: &[f64]| {
            let mut steps = vec![0.0; 30];
            forward(base, exponents, &mut steps);
            steps
        };
        let mut d_exponents = vec![0.0; 30];
        backward(&exponents, &run(&exponents), &weights, &mut d_exponents);
        assert_gradient("adaptive step", &exponents, &d_exponents, |x| {
            run(x).iter().zip(&weights).map(|(s, w)| s * w).sum()
        });
    }

    #[test]
    fn outside_the_range_only_the_way_back_is_open() {
        for (value, gradient, passed) in
            [(1.0, 2.0, 2.0), (1.0, -2.0, 0.0), (-4.0, -2.0, -2.0), (-4.0, 2.0, 0.0), (0.5, -2.0, -2.0)]
        {
            assert_eq!(clamp_backward(value, EXPONENTS, gradient), passed, "{gradient} at {value}");
        }
        let mut steps = [0.0f64; 3];
        forward([1.0; 3], &[9.0, -9.0, 0.0], &mut steps);
        assert!((steps[0] - 0.875f64.exp2()).abs() < 1e-12 && (steps[1] - 0.125).abs() < 1e-12 && steps[2] == 1.0);
    }
}
