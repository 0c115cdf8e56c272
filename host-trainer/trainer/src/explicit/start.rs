//! Where explicit Gaussians start: one at each point.

use glam::DVec3;
use pocketsplat_capture::dataset::nearest_squared;
use pocketsplat_gaussians::Degree;

use super::Cloud;
use pocketsplat_kernels::ops::image::explicit_gaussians::Stored;
use pocketsplat_kernels::ops::image::spherical_harmonics::MOST;
use pocketsplat_kernels::real::Real;

/// Opacity of every Gaussian.
const OPACITY: f32 = 0.1;

/// Deviations are no smaller, normalised units: of points that lie in one place.
const LEAST_SPACING: f64 = 3e-4;

/// Deviations where there is a single point, normalised units.
const LONE_SPACING: f64 = 0.1;

/// A round grey Gaussian at each point, its deviation the mean distance to the three nearest others (Kerbl et al. 2023, section 5.1).
///
/// Coefficients of degree 3 are stored, none is drawn yet but those of degree 0.
pub fn initial_cloud(points: &[DVec3]) -> Cloud<f32> {
    let mut cloud = Cloud { degree: Degree::Zero, ..Cloud::empty(Degree::Three) };
    for (point, nearest) in points.iter().zip(nearest_squared::<3>(points)) {
        let known: Vec<f64> = nearest.into_iter().filter(|squared| squared.is_finite()).map(f64::sqrt).collect();
        let mean = if known.is_empty() { LONE_SPACING } else { known.iter().sum::<f64>() / known.len() as f64 };
        let stored = Stored {
            centre: point.to_array().map(f32::real),
            log_scale: [f32::real(mean.max(LEAST_SPACING).ln()); 3],
            rotation: [1.0, 0.0, 0.0, 0.0],
            opacity_logit: logit(OPACITY),
        };
        cloud.push(&stored, &[[0.0; 3]; MOST]);
    }
    cloud
}

/// ln(o/(1 − o)).
pub(super) fn logit(opacity: f32) -> f32 {
    (opacity / (1.0 - opacity)).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gaussian_reaches_as_far_as_its_neighbours_stand() {
        let points = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::Y, 3.0 * DVec3::Z];
        let cloud = initial_cloud(&points);
        assert_eq!((cloud.len(), cloud.degree, cloud.harmonics.len()), (4, Degree::Zero, 4 * MOST));
        assert_eq!(cloud.log_scales[0], [2f32.ln(); 3]);
        let twins = initial_cloud(&[DVec3::ONE; 2]);
        assert!((twins.log_scales[0][0].exp() - 3e-4).abs() < 1e-7);
        assert!((initial_cloud(&[DVec3::ONE]).log_scales[0][0].exp() - 0.1).abs() < 1e-7);
    }
}
