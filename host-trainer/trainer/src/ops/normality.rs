//! How far the columns of a matrix are from the standard normal distribution.

use serde::{Deserialize, Serialize};

use super::Real;
use super::normal::density_and_tail;

/// Variances below are treated as by the tangent there: no logarithm of 0, no division by 0, and no jump.
const VARIANCE_FLOOR: f64 = 1e-6;
/// Bins of a histogram: 7 bit.
pub const BINS: usize = 128;
/// The bins lie side by side from −this to this.
const REACH: f64 = 4.0;
/// Keeps the logarithm of an empty bin finite.
const EMPTY: f64 = 1e-6;

/// How the distribution of a column is described.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// As the normal distribution of its mean and variance.
    #[default]
    Moments,
    /// As the frequencies of [`BINS`] bins, each value shared by the two nearest.
    Histogram,
}

/// Which of its moments a column's spread is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Spread {
    /// σ.
    #[default]
    Deviation,
    /// σ².
    Variance,
}

/// The terms of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights<R> {
    /// Of the divergence D(P ‖ N(0, 1)).
    pub divergence: R,
    /// Of (spread − target)².
    pub spread: R,
    /// Where the spread should be.
    pub target: R,
}

/// Mean and variance of every column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moments<R> {
    /// Rows.
    pub n: usize,
    /// `[width]`.
    pub mean: Vec<R>,
    /// `[width]`, of the rows, not of what they are a sample of.
    pub variance: Vec<R>,
}

impl<R: Real> Moments<R> {
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

    /// Σ over the columns of `divergence·½(v + μ² − 1 − ln v) + spread·(s − target)²` (the plug-and-play paper, eqs. 2, 3,
    /// with P the normal distribution of mean μ and variance v). `with_divergence` leaves the first out.
    pub fn term(&self, weights: &Weights<R>, spread: Spread, with_divergence: bool) -> R {
        let half = R::real(0.5);
        self.mean
            .iter()
            .zip(&self.variance)
            .map(|(mean, v)| {
                let [log, _] = log_of(*v);
                let beyond = value_of(*v, spread) - weights.target;
                let divergence = weights.divergence * half * (*v + *mean * *mean - R::ONE - log);
                weights.spread * beyond * beyond + if with_divergence { divergence } else { R::ZERO }
            })
            .sum()
    }

    /// Adds the gradient of [`Self::term`] for the rows of one of the matrices.
    pub fn backward(
        &self,
        weights: &Weights<R>,
        spread: Spread,
        with_divergence: bool,
        values: &[R],
        d_values: &mut [R],
    ) {
        let share = R::ONE / R::real(self.n.max(1) as f64);
        let two = R::real(2.0);
        // d/dx of a function of μ and v is (f_μ + 2·f_v·(x − μ))/n.
        let by_moments: Vec<[R; 3]> = self
            .mean
            .iter()
            .zip(&self.variance)
            .map(|(mean, v)| {
                let beyond = value_of(*v, spread) - weights.target;
                let by_spread = two * weights.spread * beyond * slope_of(*v, spread);
                let divergence = if with_divergence { weights.divergence } else { R::ZERO };
                let [_, by_log] = log_of(*v);
                let by_variance = divergence * R::real(0.5) * (R::ONE - by_log) + by_spread;
                [*mean, share * divergence * *mean, share * two * by_variance]
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

/// The spread of a column of variance v.
fn value_of<R: Real>(v: R, spread: Spread) -> R {
    let floor = R::real(VARIANCE_FLOOR);
    match spread {
        Spread::Variance => v,
        Spread::Deviation if v > floor => v.sqrt(),
        Spread::Deviation => floor.sqrt() + (v - floor) / (R::real(2.0) * floor.sqrt()),
    }
}

/// The derivative of [`value_of`].
fn slope_of<R: Real>(v: R, spread: Spread) -> R {
    match spread {
        Spread::Variance => R::ONE,
        Spread::Deviation => R::ONE / (R::real(2.0) * v.larger(R::real(VARIANCE_FLOOR)).sqrt()),
    }
}

/// Soft histograms of every column.
#[derive(Clone, Debug, PartialEq)]
pub struct Histograms<R> {
    n: usize,
    /// `[width, BINS]` frequencies.
    frequencies: Vec<R>,
    /// `[BINS]` logarithms of the masses of N(0, 1), tails in the end bins.
    log_normal: Vec<R>,
}

/// The lower of the two bins that share x, and the share of the upper one; beyond the ends all goes to the end bin.
fn bins_of<R: Real>(x: R) -> (usize, R, bool) {
    let place: f64 = (x.into() + REACH) * (BINS as f64 / (2.0 * REACH)) - 0.5;
    let last = (BINS - 1) as f64;
    if !(place > 0.0) {
        return (0, R::ZERO, false);
    }
    if place >= last {
        return (BINS - 2, R::ONE, false);
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and the last bin")]
    let lower = place as usize;
    (lower, R::real(place - lower as f64), true)
}

impl<R: Real> Histograms<R> {
    /// Of matrices `[_, width]` that lie one below the other.
    pub fn of(parts: &[&[R]], width: usize) -> Self {
        let n = parts.iter().map(|part| part.len() / width.max(1)).sum::<usize>();
        let mut frequencies = vec![R::ZERO; width * BINS];
        for row in parts.iter().flat_map(|part| part.chunks_exact(width.max(1))) {
            for (bins, x) in frequencies.chunks_exact_mut(BINS).zip(row) {
                let (lower, share, _) = bins_of(*x);
                bins[lower] += R::ONE - share;
                bins[lower + 1] += share;
            }
        }
        for frequency in &mut frequencies {
            *frequency = *frequency / R::real(n.max(1) as f64);
        }
        // Of the upper half, whose mirror image is the lower one.
        let above = |edge: usize| density_and_tail(edge as f64 * 2.0 * REACH / BINS as f64 - REACH).1;
        let mass = |i: usize| match i.max(BINS - 1 - i) {
            i if i == BINS - 1 => above(i),
            i => above(i) - above(i + 1),
        };
        Self { n, frequencies, log_normal: (0..BINS).map(|i| R::real(mass(i).ln())).collect() }
    }

    /// `weight·Σ_columns Σ_bins p·ln((p + ε)/q)`.
    pub fn term(&self, weight: R) -> R {
        let empty = R::real(EMPTY);
        let columns = self.frequencies.chunks_exact(BINS);
        weight * columns.flat_map(|p| p.iter().zip(&self.log_normal)).map(|(p, q)| *p * ((*p + empty).ln() - *q)).sum()
    }

    /// Adds the gradient of [`Self::term`] for the rows of one of the matrices.
    pub fn backward(&self, weight: R, values: &[R], d_values: &mut [R]) {
        let width = self.frequencies.len() / BINS;
        let empty = R::real(EMPTY);
        let share = weight * R::real(BINS as f64 / (2.0 * REACH) / self.n.max(1) as f64);
        let by_bin: Vec<R> = self
            .frequencies
            .iter()
            .zip(self.log_normal.iter().cycle())
            .map(|(p, q)| share * ((*p + empty).ln() - *q + *p / (*p + empty)))
            .collect();
        for (row, d_row) in values.chunks_exact(width.max(1)).zip(d_values.chunks_exact_mut(width.max(1))) {
            for ((x, d), by_bin) in row.iter().zip(d_row).zip(by_bin.chunks_exact(BINS)) {
                let (lower, _, inside) = bins_of(*x);
                if inside {
                    *d += by_bin[lower + 1] - by_bin[lower];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::finite_difference::{assert_gradient, assert_piecewise_gradient, random};

    const WIDTH: usize = 3;

    fn parts(x: &[f64]) -> [&[f64]; 2] {
        let (first, second) = x.split_at(x.len() / WIDTH / 2 * WIDTH);
        [first, second]
    }

    #[test]
    fn moments_agree_with_finite_differences() {
        let weights = Weights { divergence: 0.3, spread: 0.7, target: 0.4 };
        for (seed, n) in [(1, 20), (2, 2), (3, 1)] {
            for spread in [Spread::Deviation, Spread::Variance] {
                let mut x = random(seed, n * WIDTH);
                // A column without variance, and one with less than the floor.
                x.iter_mut().step_by(WIDTH).for_each(|x| *x = 0.25);
                x.iter_mut().skip(1).step_by(WIDTH).for_each(|x| *x *= 3e-4);
                let moments = |x: &[f64]| Moments::of(&parts(x), WIDTH);
                let mut d = vec![0.0; x.len()];
                moments(&x).backward(&weights, spread, true, &x, &mut d);
                assert!(d.iter().all(|d| d.is_finite()));
                assert_gradient("moments", &x, &d, |x| moments(x).term(&weights, spread, true));
            }
        }
    }

    #[test]
    fn histograms_agree_with_finite_differences() {
        let mut x = random(4, 30 * WIDTH);
        x.iter_mut().for_each(|x| *x *= 3.0);
        x[4] = 9.0;
        x[5] = -9.0;
        let histograms = |x: &[f64]| Histograms::of(&parts(x), WIDTH);
        let mut d = vec![0.0; x.len()];
        histograms(&x).backward(0.3, &x, &mut d);
        assert!(d[4] == 0.0 && d[5] == 0.0, "beyond the ends nothing pulls");
        assert_piecewise_gradient("histogram", &x, &d, |x| histograms(x).term(0.3));
    }

    #[test]
    fn a_standard_normal_column_has_no_divergence_and_both_forms_agree_on_others() {
        // Quantiles instead of a sample.
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
        let normal: Vec<f64> = (0..n).map(quantile).collect();
        let weights = Weights { divergence: 1.0, spread: 0.0, target: 1.0 };
        let both = |x: &[f64]| {
            let moments = Moments::of(&[x], 1).term(&weights, Spread::Deviation, true);
            [moments, Histograms::of(&[x], 1).term(1.0)]
        };
        assert!(both(&normal).iter().all(|d| d.abs() < 2e-3), "{:?}", both(&normal));
        let other: Vec<f64> = normal.iter().map(|x| 0.5 * x + 0.7).collect();
        let [moments, histogram] = both(&other);
        let exact = 0.5 * (0.25 + 0.49 - 1.0 - 0.25f64.ln());
        assert!((moments - exact).abs() < 1e-3 && (histogram - exact).abs() < 0.01, "{moments}, {histogram}: {exact}");
    }
}
