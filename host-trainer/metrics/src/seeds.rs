//! What a difference between two methods is worth, when seeds alone already make one.

use super::{BjontegaardError, RatePoint, bd_rate_percent};

/// Quantiles t(0.975) of Student's distribution for 1 to 10 degrees of freedom.
const STUDENT: [f64; 10] = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228];
/// The same of the normal distribution, to which they fall.
const NORMAL: f64 = 1.959_964;

/// The quantile t(0.975) for `freedom` degrees of freedom, from 1.
///
/// Beyond the table the first four terms of its series in 1/freedom (Abramowitz and Stegun 1964, 26.7.5), good to four digits.
fn student(freedom: usize) -> f64 {
    let (z, nu) = (NORMAL, freedom as f64);
    let series = || {
        let first = (z.powi(3) + z) / 4.0;
        let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
        let third = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0;
        z + first / nu + second / nu.powi(2) + third / nu.powi(3)
    };
    STUDENT.get(freedom - 1).copied().unwrap_or_else(series)
}

/// A mean difference, and its 95 % interval where there are seeds enough to tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeededDifference {
    /// How many more bytes for the same quality; negative is better.
    pub percent: f64,
    /// Ends of the interval; none with fewer than two seeds on either side.
    pub interval: Option<[f64; 2]>,
}

/// BD-rate of the curves `compared` against the curves `reference`, one curve a seed, each with the same rates.
///
/// Each curve counts by its ln BD-rate ([`bd_rate_percent`]) against the reference's mean curve (mean PSNR, geometric mean of bytes at
/// each rate); the result is the difference of the two sides' means, its interval that of a common variance (Student's t).
///
/// # Errors
/// Those of [`bd_rate_percent`]; [`BjontegaardError::TooFew`] for a side without curves.
pub fn bd_rate_over_seeds(
    reference: &[Vec<RatePoint>],
    compared: &[Vec<RatePoint>],
) -> Result<SeededDifference, BjontegaardError> {
    let mean_curve = mean_curve(reference);
    let against_mean = |curves: &[Vec<RatePoint>]| {
        let of = |curve: &Vec<RatePoint>| Ok((bd_rate_percent(&mean_curve, curve)? / 100.0).ln_1p());
        curves.iter().map(of).collect::<Result<Vec<f64>, BjontegaardError>>()
    };
    for (curve, curves) in [("reference", reference), ("compared", compared)] {
        if curves.is_empty() {
            return Err(BjontegaardError::TooFew { curve, found: 0 });
        }
    }
    let (a, b) = (against_mean(reference)?, against_mean(compared)?);
    let percent = |ln: f64| 100.0 * ln.exp_m1();
    let difference = mean(&b) - mean(&a);
    let interval = half_interval(&a, &b).map(|half| [percent(difference - half), percent(difference + half)]);
    Ok(SeededDifference { percent: percent(difference), interval })
}

/// Point by point, in the order of the points.
fn mean_curve(curves: &[Vec<RatePoint>]) -> Vec<RatePoint> {
    let n_points = curves.iter().map(Vec::len).min().unwrap_or(0);
    let point = |i: usize| {
        let of = |value: fn(&RatePoint) -> f64| mean(&curves.iter().map(|curve| value(&curve[i])).collect::<Vec<_>>());
        RatePoint { size_bytes: of(|point| point.size_bytes.ln()).exp(), psnr_db: of(|point| point.psnr_db) }
    };
    (0..n_points).map(point).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Half the 95 % interval of the difference of two means with a common variance; `None` with fewer than two values on either side.
fn half_interval(a: &[f64], b: &[f64]) -> Option<f64> {
    if a.len() < 2 || b.len() < 2 {
        return None;
    }
    let squares = |x: &[f64]| x.iter().map(|v| (v - mean(x)).powi(2)).sum::<f64>();
    let freedom = a.len() + b.len() - 2;
    let variance = (squares(a) + squares(b)) / freedom as f64;
    Some(student(freedom) * (variance * (1.0 / a.len() as f64 + 1.0 / b.len() as f64)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(of: &[(f64, f64)]) -> Vec<RatePoint> {
        of.iter().map(|&(size_bytes, psnr_db)| RatePoint { size_bytes, psnr_db }).collect()
    }

    #[test]
    fn quantiles_beyond_the_table_are_those_of_student() {
        for (freedom, known) in [(10, 2.228), (11, 2.201), (12, 2.179), (20, 2.086), (60, 2.000), (100_000, 1.960)] {
            assert!((student(freedom) - known).abs() < 6e-4, "{freedom}: {}", student(freedom));
        }
    }

    #[test]
    fn curves_of_seeds_differ_by_their_means_and_as_surely_as_seeds_agree() {
        let curve = |factor: f64| points(&[(factor * 2e5, 30.0), (factor * 4e5, 32.0), (factor * 8e5, 33.0)]);
        let seeds =
            |factor: f64, spread: f64| [-1.0, 0.0, 1.0].map(|s: f64| curve(factor * (spread * s).exp())).to_vec();
        let found = bd_rate_over_seeds(&seeds(1.0, 0.03), &seeds(0.8, 0.05)).unwrap();
        assert!((found.percent + 20.0).abs() < 1e-9, "{found:?}");
        // s² = (0.03² + 0.05²)/2, standard error s·√(2/3), four degrees of freedom.
        let half = 2.776 * ((0.03f64.powi(2) + 0.05f64.powi(2)) / 2.0 * 2.0 / 3.0).sqrt();
        let [low, high] = found.interval.unwrap();
        assert!((high - 100.0 * (0.8f64.ln() + half).exp_m1()).abs() < 1e-9, "{found:?}");
        assert!((low - 100.0 * (0.8f64.ln() - half).exp_m1()).abs() < 1e-9, "{found:?}");
        let alone = bd_rate_over_seeds(&seeds(1.0, 0.03), &[curve(0.8)]).unwrap();
        assert!((alone.percent + 20.0).abs() < 1e-9 && alone.interval.is_none(), "{alone:?}");
        assert!(bd_rate_over_seeds(&[], &[curve(1.0)]).is_err());
    }
}
