//! How far the columns of a matrix are from the standard normal distribution.

use crate::real::Real;

/// Variances below are treated as by the tangent there: no logarithm of 0, no division by 0, and no jump.
pub const VARIANCE_FLOOR: f64 = 1e-6;

/// The terms of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights<R> {
    /// Of the divergence D(P ‖ N(0, 1)).
    pub divergence: R,
    /// Of (σ − 1)².
    pub spread: R,
}

/// Mean and variance of every column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChannelMoments<R> {
    /// Rows.
    pub n: usize,
    /// `[width]`.
    pub mean: Vec<R>,
    /// `[width]`, of the rows, not of what they are a sample of.
    pub variance: Vec<R>,
}

impl<R: Real> ChannelMoments<R> {
    /// Of matrices `[_, width]` that lie one below the other; sums run matrix by matrix.
    pub fn of(parts: &[&[R]], width: usize) -> Self {
        let n = parts.iter().map(|part| part.len() / width.max(1)).sum::<usize>();
        let share = R::ONE / R::real(n.max(1) as f64);
        let columns = |f: &dyn Fn(usize, R) -> R| {
            let mut sums = vec![R::ZERO; width];
            for part in parts {
                let mut own = vec![R::ZERO; width];
                for row in part.chunks_exact(width) {
                    for (i, (sum, x)) in own.iter_mut().zip(row).enumerate() {
                        *sum += f(i, *x);
                    }
                }
                for (sum, own) in sums.iter_mut().zip(own) {
                    *sum += own * share;
                }
            }
            sums
        };
        let mean = columns(&|_, x| x);
        let variance = columns(&|i, x| (x - mean[i]) * (x - mean[i]));
        Self { n, mean, variance }
    }

    /// Σ over the columns of `divergence·½(v + μ² − 1 − ln v) + spread·(√v − 1)²` (the plug-and-play paper, eqs. 2, 3,
    /// with P the normal distribution of mean μ and variance v).
    pub fn term(&self, weights: &Weights<R>) -> R {
        let half = R::real(0.5);
        self.mean
            .iter()
            .zip(&self.variance)
            .map(|(mean, v)| {
                let [log, _] = log_of(*v);
                let [deviation, _] = deviation_of(*v);
                let beyond = deviation - R::ONE;
                let divergence = weights.divergence * half * (*v + *mean * *mean - R::ONE - log);
                weights.spread * beyond * beyond + divergence
            })
            .sum()
    }

    /// Adds the gradient of [`Self::term`] for the rows of one of the matrices.
    pub fn backward(&self, weights: &Weights<R>, values: &[R], d_values: &mut [R]) {
        let share = R::ONE / R::real(self.n.max(1) as f64);
        let two = R::real(2.0);
        // d/dx of a function of μ and v is (f_μ + 2·f_v·(x − μ))/n.
        let by_moments: Vec<[R; 3]> = self
            .mean
            .iter()
            .zip(&self.variance)
            .map(|(mean, v)| {
                let [deviation, by_deviation] = deviation_of(*v);
                let by_spread = two * weights.spread * (deviation - R::ONE) * by_deviation;
                let [_, by_log] = log_of(*v);
                let by_variance = weights.divergence * R::real(0.5) * (R::ONE - by_log) + by_spread;
                [*mean, share * weights.divergence * *mean, share * two * by_variance]
            })
            .collect();
        let width = self.mean.len().max(1);
        for (row, d_row) in values.chunks_exact(width).zip(d_values.chunks_exact_mut(width)) {
            for ((x, d), [mean, constant, slope]) in row.iter().zip(d_row).zip(&by_moments) {
                *d += *constant + *slope * (*x - *mean);
            }
        }
    }
}

/// ln v and its derivative; below the floor its tangent.
fn log_of<R: Real>(v: R) -> [R; 2] {
    let floor = R::real(VARIANCE_FLOOR);
    if v > floor { [v.ln(), R::ONE / v] } else { [floor.ln() + (v - floor) / floor, R::ONE / floor] }
}

/// √v and its derivative; below the floor its tangent.
fn deviation_of<R: Real>(v: R) -> [R; 2] {
    let floor = R::real(VARIANCE_FLOOR);
    let slope = R::ONE / (R::real(2.0) * v.larger(floor).sqrt());
    if v > floor { [v.sqrt(), slope] } else { [floor.sqrt() + (v - floor) * slope, slope] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_gradient, random};
    use crate::ops::rate::normal::density_and_tail;

    const WIDTH: usize = 3;

    fn parts(x: &[f64]) -> [&[f64]; 2] {
        let (first, second) = x.split_at(x.len() / WIDTH / 2 * WIDTH);
        [first, second]
    }

    #[test]
    fn moments_agree_with_finite_differences() {
        let weights = Weights { divergence: 0.3, spread: 0.7 };
        for (seed, n) in [(1, 20), (2, 2), (3, 1)] {
            let mut x = random(seed, n * WIDTH);
            // A column without variance, and one with less than the floor.
            x.iter_mut().step_by(WIDTH).for_each(|x| *x = 0.25);
            x.iter_mut().skip(1).step_by(WIDTH).for_each(|x| *x *= 3e-4);
            let moments = |x: &[f64]| ChannelMoments::of(&parts(x), WIDTH);
            let mut d = vec![0.0; x.len()];
            moments(&x).backward(&weights, &x, &mut d);
            assert!(d.iter().all(|d| d.is_finite()));
            assert_gradient("moments", &x, &d, |x| moments(x).term(&weights));
        }
    }

    #[test]
    fn a_standard_normal_column_has_no_divergence() {
        let n = 4000;
        let quantile = |i: usize| {
            let p = (i as f64 + 0.5) / n as f64;
            let (mut low, mut high) = (-9.0f64, 9.0f64);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                let (_, beyond) = density_and_tail(middle.abs());
                let below = if middle < 0.0 { beyond } else { 1.0 - beyond };
                if below < p { low = middle } else { high = middle }
            }
            low
        };
        // Quantiles instead of a sample.
        let normal: Vec<f64> = (0..n).map(quantile).collect();
        let term = |x: &[f64]| ChannelMoments::of(&[x], 1).term(&Weights { divergence: 1.0, spread: 0.0 });
        assert!(term(&normal).abs() < 2e-3, "{}", term(&normal));
        let other: Vec<f64> = normal.iter().map(|x| 0.5 * x + 0.7).collect();
        let exact = 0.5 * (0.25 + 0.49 - 1.0 - 0.25f64.ln());
        assert!((term(&other) - exact).abs() < 1e-3, "{}: {exact}", term(&other));
    }
}
