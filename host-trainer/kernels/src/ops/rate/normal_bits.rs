//! Bits of rounded values under a normal distribution: the rate loss, forward and backward in one pass.

use super::normal::density_and_tail;
use crate::real::Real;

/// Probabilities are lifted to it, so no value costs more than 19.93 bits; below it there is no gradient.
const FLOOR: f64 = 1e-6;

/// One value's bits and how they change.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bits<R> {
    /// −log₂ of the probability.
    pub bits: R,
    /// ∂bits/∂value = −∂bits/∂mean, per step.
    pub d_value: R,
    /// ∂bits/∂(log₂ of the scale).
    pub d_log2_scale: R,
}

/// bits = −log₂ max(Φ((x + ½ − μ)/σ) − Φ((x − ½ − μ)/σ), 1e-6) (Chen et al. 2024, HAC), all in units of the
/// quantisation step.
///
/// With d = |x − μ|, a = (d − ½)/σ and b = (d + ½)/σ the probability is p = Q(a) − Q(b), which keeps its digits in the tail;
/// ∂p/∂d = (φ(b) − φ(a))/σ, ∂p/∂ln σ = aφ(a) − bφ(b).
///
/// * `log2_scale`: log₂ σ. Cost: three exponentials, a logarithm, five divisions.
#[inline(always)]
pub fn bits<R: Real>(value: R, mean: R, log2_scale: R) -> Bits<R> {
    let ln_2 = R::real(std::f64::consts::LN_2);
    let half = R::real(0.5);
    let inverse_scale = (-(log2_scale * ln_2)).exp();
    let signed = value - mean;
    let distance = signed.abs();
    let (a, b) = ((distance - half) * inverse_scale, (distance + half) * inverse_scale);
    let (density_a, tail_a) = density_and_tail(a.abs());
    let (density_b, tail_b) = density_and_tail(b);
    let above_a = if a < R::ZERO { R::ONE - tail_a } else { tail_a };
    let probability = above_a - tail_b;
    let floor = R::real(FLOOR);
    let lifted = probability.larger(floor);
    let slope = -(R::real(std::f64::consts::LOG2_E) / lifted);
    // No gradient where p was lifted: chosen, not multiplied, because a and b may be infinite there.
    let where_likely = |gradient: R| if probability > floor { gradient } else { R::ZERO };
    let d_distance = where_likely(slope * (density_b - density_a) * inverse_scale);
    Bits {
        bits: -lifted.log2(),
        d_value: if signed < R::ZERO { -d_distance } else { d_distance },
        d_log2_scale: where_likely(slope * ln_2 * (a * density_a - b * density_b)),
    }
}

/// [`bits`] of many values; all slices have one length.
///
/// * `bits_out`, `d_values`, `d_log2_scales`: overwritten. To be called under [`Level::run`](crate::ops::simd::Level::run).
#[inline(always)]
pub fn forward_backward<R: Real>(
    values: &[R],
    means: &[R],
    log2_scales: &[R],
    bits_out: &mut [R],
    d_values: &mut [R],
    d_log2_scales: &mut [R],
) {
    let n = values.len();
    let (means, log2_scales) = (&means[..n], &log2_scales[..n]);
    let (bits_out, d_values, d_log2_scales) = (&mut bits_out[..n], &mut d_values[..n], &mut d_log2_scales[..n]);
    for i in 0..n {
        let found = bits(values[i], means[i], log2_scales[i]);
        bits_out[i] = found.bits;
        d_values[i] = found.d_value;
        d_log2_scales[i] = found.d_log2_scale;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_piecewise_gradient, random};

    /// Values, means and log-scales from `[x, μ, log₂ σ]` in turn.
    fn run<R: Real>(x: &[f64]) -> [Vec<f64>; 3] {
        let part = |i: usize| x.iter().skip(i).step_by(3).map(|v| R::real(*v)).collect::<Vec<R>>();
        let n = x.len() / 3;
        let mut out = [vec![R::ZERO; n], vec![R::ZERO; n], vec![R::ZERO; n]];
        let [bits, d_values, d_log2_scales] = &mut out;
        forward_backward(&part(0), &part(1), &part(2), bits, d_values, d_log2_scales);
        out.map(|v| v.into_iter().map(Into::into).collect())
    }

    fn inputs(seed: u64) -> Vec<f64> {
        random(seed, 600).chunks_exact(3).flat_map(|v| [4.0 * v[0], 4.0 * v[1], 3.9 * v[2]]).collect()
    }

    #[test]
    fn backward_agrees_with_finite_differences() {
        for seed in 0..4 {
            let x = inputs(seed);
            let weights = random(seed + 10, x.len() / 3);
            let [_, d_values, d_log2_scales] = run::<f64>(&x);
            let mut analytic = vec![0.0; x.len()];
            for (i, w) in weights.iter().enumerate() {
                analytic[3 * i] = w * d_values[i];
                analytic[3 * i + 1] = -w * d_values[i];
                analytic[3 * i + 2] = w * d_log2_scales[i];
            }
            assert_piecewise_gradient("rate", &x, &analytic, |x| {
                run::<f64>(x)[0].iter().zip(&weights).map(|(b, w)| b * w).sum()
            });
        }
    }

    #[test]
    fn f32_agrees_with_f64() {
        let x: Vec<f64> = inputs(9).into_iter().map(|v| f64::from(v as f32)).collect();
        for (exact, rounded) in run::<f64>(&x).iter().zip(run::<f32>(&x)) {
            for (i, (a, b)) in exact.iter().zip(&rounded).enumerate() {
                assert!((a - b).abs() <= 2e-4 * a.abs().max(0.05), "value {i}: f64 {a}, f32 {b}");
            }
        }
    }

    #[test]
    fn the_probabilities_of_all_integers_sum_to_one() {
        for (mean, log2_scale) in [(0.0, 0.0), (0.3, -4.0), (-7.4, 1.0), (2.5, 3.5)] {
            let sum: f64 = (-90..90)
                .map(|i| (-bits(f64::from(i), mean, log2_scale).bits).exp2())
                .filter(|p| *p > 1.001 * FLOOR)
                .sum();
            assert!((sum - 1.0).abs() < 3e-5, "{sum} around {mean} with scale 2^{log2_scale}");
        }
    }

    #[test]
    fn what_is_too_unlikely_costs_twenty_bits_and_pulls_nowhere() {
        for distance in [10.0f32, 1e4, 1e30] {
            let found = bits(distance, 0.0, 0.0);
            assert!(
                (found.bits - 19.93).abs() < 0.01 && found.d_value == 0.0 && found.d_log2_scale == 0.0,
                "{found:?}"
            );
        }
        let beyond_f32 = bits(1e30f32, 0.0, -50.0);
        assert_eq!((beyond_f32.d_value, beyond_f32.d_log2_scale), (0.0, 0.0), "deviations that are infinite");
        assert_eq!(bits(0.0f32, 0.0, -50.0).bits, 0.0, "a certain value costs nothing");
    }
}
