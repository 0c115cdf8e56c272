//! Values as coding leaves them: with noise in place of rounding while training, rounded in its last phase.

use super::noise::Stream;
use crate::real::Real;

/// v ← v + u·step with u uniform in [−½, ½) (Ballé et al. 2017, "End-to-end optimized image compression", section 3).
///
/// * `values`: of one anchor that share a step. * `first`: the number of their first channel, which the noise depends on.
/// * `residuals`: overwritten with u, which backward needs.
#[inline(always)]
pub fn with_noise<R: Real>(stream: Stream, first: u32, step: R, values: &mut [R], residuals: &mut [R]) {
    for (channel, (value, residual)) in (first..).zip(values.iter_mut().zip(residuals)) {
        let u = R::real(f64::from(stream.uniform(channel) - 0.5));
        *residual = u;
        *value += u * step;
    }
}

/// The symbol s of a value v, not yet an integer type: v/step to the nearest integer, ties to even.
///
/// The one rule of rounding, in the precision of training: the last phase of training and the writer of bundles both use it,
/// so a bundle holds the symbols that training saw, ties of the rounded quotient included.
#[inline(always)]
pub fn symbol<R: Real>(value: R, step: R) -> R {
    (value / step).round_ties_even()
}

/// v ← s·step with s the [`symbol`] of v, within the range of the coder: what a decoder will see.
///
/// * `residuals`: overwritten with s − v/step.
#[inline(always)]
pub fn rounded<R: Real>(step: R, values: &mut [R], residuals: &mut [R]) {
    let limit = R::real(f64::from(i16::MAX));
    for (value, residual) in values.iter_mut().zip(residuals) {
        let symbol = symbol(*value, step).smaller(limit).larger(-limit);
        *residual = symbol - *value / step;
        *value = symbol * step;
    }
}

/// dL/d(step) of either, the residuals held fixed: Σ residual·dL/dv. The gradient of the values passes unchanged
/// (straight through).
#[inline(always)]
pub fn backward<R: Real>(d_values: &[R], residuals: &[R]) -> R {
    d_values.iter().zip(residuals).map(|(d, residual)| *d * *residual).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_gradient, random};

    #[test]
    fn backward_agrees_with_finite_differences() {
        let stream = Stream::of_run(5).branch(9);
        let weights = random(2, 20);
        let mut x = random(1, 20);
        x.push(0.7);
        let run = |x: &[f64]| {
            let (mut values, mut residuals) = (x[..20].to_vec(), vec![0.0; 20]);
            with_noise(stream, 50, x[20], &mut values, &mut residuals);
            (values, residuals)
        };
        let analytic = [weights.clone(), vec![backward(&weights, &run(&x).1)]].concat();
        assert_gradient("noise", &x, &analytic, |x| run(x).0.iter().zip(&weights).map(|(v, w)| v * w).sum());
    }

    #[test]
    fn rounding_gives_multiples_of_the_step_and_remembers_what_it_took() {
        let start = [0.24f32, 0.26, -0.75, 0.75, 1e9, -1e9];
        let (mut values, mut residuals) = (start, [0.0; 6]);
        rounded(0.5, &mut values, &mut residuals);
        assert_eq!(values, [0.0, 0.5, -1.0, 1.0, 16383.5, -16383.5]);
        for i in 0..4 {
            assert!((start[i] + 0.5 * residuals[i] - values[i]).abs() < 1e-6);
        }
        let again = values;
        rounded(0.5, &mut values, &mut residuals);
        assert_eq!((values, residuals), (again, [0.0; 6]), "once is enough");
    }
}
