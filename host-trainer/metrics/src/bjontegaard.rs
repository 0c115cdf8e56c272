//! How far one rate-distortion curve lies from another.

use super::pchip::Pchip;

/// A point of a rate-distortion curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RatePoint {
    /// Size of everything that is needed to draw, bytes.
    pub size_bytes: f64,
    /// Quality, dB.
    pub psnr_db: f64,
}

/// Why two curves cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum BjontegaardError {
    /// No curve.
    #[error("the {curve} curve has {found} points, needs 2 or more")]
    TooFew { curve: &'static str, found: usize },
    /// A point without a place in the plane.
    #[error(
        "the {curve} curve has a point of {size_bytes} bytes and {psnr_db} dB, needs finite numbers, bytes above 0"
    )]
    NotAPoint { curve: &'static str, size_bytes: f64, psnr_db: f64 },
    /// More bytes for less quality: no function of quality goes through such points.
    #[error(
        "the {curve} curve does not rise: {} bytes give {} dB and {} bytes give {} dB; leave the worse point out",
        less.size_bytes, less.psnr_db, more.size_bytes, more.psnr_db
    )]
    NotRising { curve: &'static str, less: RatePoint, more: RatePoint },
    /// Nothing to compare at.
    #[error("the curves have no {axis} in common: {reference:?} and {compared:?}; train points nearer to each other")]
    NoOverlap { axis: &'static str, reference: [f64; 2], compared: [f64; 2] },
}

/// BD-rate: how many more bytes `compared` takes for the same PSNR, percent; negative is better (Bjøntegaard 2001,
/// VCEG-M33).
///
/// `100·(e^d − 1)` with `d` the mean over the PSNR that both curves reach of the difference of their ln bytes, which are
/// interpolated over PSNR by monotone piecewise cubics. Points may come in any order.
///
/// # Errors
/// [`BjontegaardError`] when a curve has fewer than two points or does not rise, or no PSNR is reached by both.
pub fn bd_rate_percent(reference: &[RatePoint], compared: &[RatePoint]) -> Result<f64, BjontegaardError> {
    let mean = mean_difference("PSNR, dB,", reference, compared, |point| (point.psnr_db, point.size_bytes.ln()))?;
    Ok(100.0 * mean.exp_m1())
}

/// BD-PSNR: how much better `compared` is at the same size, dB; as [`bd_rate_percent`] with the axes exchanged.
///
/// # Errors
/// [`BjontegaardError`] when a curve has fewer than two points or does not rise, or no size is reached by both.
pub fn bd_psnr_db(reference: &[RatePoint], compared: &[RatePoint]) -> Result<f64, BjontegaardError> {
    mean_difference("ln of bytes", reference, compared, |point| (point.size_bytes.ln(), point.psnr_db))
}

/// Mean of `compared − reference` of the second coordinate over what both have of the first.
fn mean_difference(
    axis: &'static str,
    reference: &[RatePoint],
    compared: &[RatePoint],
    coordinates: fn(&RatePoint) -> (f64, f64),
) -> Result<f64, BjontegaardError> {
    let of = |name, points| -> Result<_, BjontegaardError> {
        let points: Vec<(f64, f64)> = rising(name, points)?.iter().map(coordinates).collect();
        Ok((Pchip::new(&points), [points[0].0, points[points.len() - 1].0]))
    };
    let (reference, ends_a) = of("reference", reference)?;
    let (compared, ends_b) = of("compared", compared)?;
    let (from, to) = (ends_a[0].max(ends_b[0]), ends_a[1].min(ends_b[1]));
    if from >= to {
        return Err(BjontegaardError::NoOverlap { axis, reference: ends_a, compared: ends_b });
    }
    Ok((compared.integral(from, to) - reference.integral(from, to)) / (to - from))
}

/// The points by size, each better than the one before.
fn rising(curve: &'static str, points: &[RatePoint]) -> Result<Vec<RatePoint>, BjontegaardError> {
    if points.len() < 2 {
        return Err(BjontegaardError::TooFew { curve, found: points.len() });
    }
    for &RatePoint { size_bytes, psnr_db } in points {
        if !(size_bytes > 0.0 && size_bytes.is_finite() && psnr_db.is_finite()) {
            return Err(BjontegaardError::NotAPoint { curve, size_bytes, psnr_db });
        }
    }
    let mut points = points.to_vec();
    points.sort_by(|a, b| a.size_bytes.total_cmp(&b.size_bytes));
    match points.windows(2).find(|pair| pair[0].size_bytes >= pair[1].size_bytes || pair[0].psnr_db >= pair[1].psnr_db)
    {
        Some(pair) => Err(BjontegaardError::NotRising { curve, less: pair[0], more: pair[1] }),
        None => Ok(points),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(points: &[(f64, f64)]) -> Vec<RatePoint> {
        points.iter().map(|&(size_bytes, psnr_db)| RatePoint { size_bytes, psnr_db }).collect()
    }

    fn a() -> Vec<RatePoint> {
        curve(&[(300e3, 30.1), (500e3, 32.4), (900e3, 34.0), (1600e3, 34.8)])
    }

    #[test]
    fn a_curve_does_not_differ_from_itself() {
        let mut backwards = a();
        backwards.reverse();
        assert_eq!(bd_rate_percent(&a(), &backwards), Ok(0.0));
        assert_eq!(bd_psnr_db(&a(), &backwards), Ok(0.0));
    }

    #[test]
    fn a_tenth_fewer_bytes_are_minus_ten_percent() {
        let smaller: Vec<_> = a().iter().map(|p| RatePoint { size_bytes: 0.9 * p.size_bytes, ..*p }).collect();
        let rate = bd_rate_percent(&a(), &smaller).unwrap();
        assert!((rate + 10.0).abs() < 1e-9, "{rate}");
        let back = bd_rate_percent(&smaller, &a()).unwrap();
        assert!((back - 100.0 / 9.0).abs() < 1e-9, "{back}");
    }

    #[test]
    fn one_db_more_at_every_size_is_one_db() {
        let better: Vec<_> = a().iter().map(|p| RatePoint { psnr_db: p.psnr_db + 1.0, ..*p }).collect();
        let db = bd_psnr_db(&a(), &better).unwrap();
        assert!((db - 1.0).abs() < 1e-9, "{db}");
    }

    #[test]
    fn crossing_curves_give_the_values_of_another_implementation() {
        // The same definition on SciPy 1.17's `PchipInterpolator`.
        let b = curve(&[(250e3, 29.5), (420e3, 32.0), (800e3, 34.1), (1300e3, 34.9), (2100e3, 35.2)]);
        let (rate, db) = (bd_rate_percent(&a(), &b).unwrap(), bd_psnr_db(&a(), &b).unwrap());
        assert!((rate + 10.199_690_076).abs() < 1e-8, "{rate}");
        assert!((db - 0.316_408_179).abs() < 1e-8, "{db}");
    }

    #[test]
    fn curves_that_cannot_be_compared_say_why() {
        let message = |b: &[(f64, f64)]| bd_rate_percent(&a(), &curve(b)).unwrap_err().to_string();
        assert!(message(&[(1e6, 33.0)]).contains("compared curve has 1 points"), "{}", message(&[(1e6, 33.0)]));
        let apart = message(&[(1e6, 20.0), (2e6, 25.0)]);
        assert!(apart.contains("[30.1, 34.8]") && apart.contains("[20.0, 25.0]"), "{apart}");
        let falling = message(&[(1e6, 33.0), (2e6, 32.5)]);
        assert!(falling.contains("1000000 bytes give 33 dB and 2000000 bytes give 32.5 dB"), "{falling}");
        assert!(message(&[(0.0, 33.0), (2e6, 34.0)]).contains("0 bytes"));
        assert!(message(&[(1e6, 33.0), (2e6, f64::INFINITY)]).contains("inf dB"));
    }
}
