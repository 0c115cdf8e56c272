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

/// The harmonic of degree 0, ½·√(1/π).
const Y00: f64 = 0.282_094_791_773_878_14;

/// A round Gaussian at each point, its deviation the mean distance to the three nearest others (Kerbl et al. 2023, section 5.1).
///
/// Coefficients of degree 3 are stored, none is drawn yet but those of degree 0.
///
/// * `colours`: of the points, RGB; where there are none the Gaussians are grey.
pub fn initial_cloud(points: &[DVec3], colours: &[[u8; 3]]) -> Cloud<f32> {
    let mut cloud = Cloud { degree: Degree::Zero, ..Cloud::empty(Degree::Three) };
    for (i, (point, nearest)) in points.iter().zip(nearest_squared::<3>(points)).enumerate() {
        let known: Vec<f64> = nearest.into_iter().filter(|squared| squared.is_finite()).map(f64::sqrt).collect();
        let mean = if known.is_empty() { LONE_SPACING } else { known.iter().sum::<f64>() / known.len() as f64 };
        let stored = Stored {
            centre: point.to_array().map(f32::real),
            log_scale: [f32::real(mean.max(LEAST_SPACING).ln()); 3],
            rotation: [1.0, 0.0, 0.0, 0.0],
            opacity_logit: logit(OPACITY),
        };
        let mut harmonics = [[0.0; 3]; MOST];
        harmonics[0] = colours.get(i).map_or([0.0; 3], |rgb| rgb.map(of_channel));
        cloud.push(&stored, &harmonics);
    }
    cloud
}

/// The coefficient of degree 0 that shows as this value from every side: a colour is ½ + Y₀₀·c.
fn of_channel(value: u8) -> f32 {
    f32::real((f64::from(value) / 255.0 - 0.5) / Y00)
}

/// ln(o/(1 − o)).
pub(super) fn logit(opacity: f32) -> f32 {
    (opacity / (1.0 - opacity)).ln()
}

#[cfg(test)]
mod tests {
    use pocketsplat_kernels::ops::image::explicit_gaussians::colour;

    use super::*;

    #[test]
    fn a_gaussian_reaches_as_far_as_its_neighbours_stand() {
        let points = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::Y, 3.0 * DVec3::Z];
        let cloud = initial_cloud(&points, &[]);
        assert_eq!((cloud.len(), cloud.degree, cloud.harmonics.len()), (4, Degree::Zero, 4 * MOST));
        assert_eq!(cloud.log_scales[0], [2f32.ln(); 3]);
        let twins = initial_cloud(&[DVec3::ONE; 2], &[]);
        assert!((twins.log_scales[0][0].exp() - 3e-4).abs() < 1e-7);
        assert!((initial_cloud(&[DVec3::ONE], &[]).log_scales[0][0].exp() - 0.1).abs() < 1e-7);
    }
    #[test]
    fn a_gaussian_shows_the_colour_of_its_point() {
        let points = [DVec3::ZERO, DVec3::X];
        let shown =
            |cloud: &Cloud<f32>, i| colour([3.0, 2.0, 1.0], Degree::Zero, cloud.centres[i], cloud.harmonics_of(i));
        let cloud = initial_cloud(&points, &[[255, 0, 51], [1, 2, 3]]);
        for (found, expected) in shown(&cloud, 0).into_iter().zip([1.0, 0.0, 0.2]) {
            assert!((found - expected).abs() < 1e-6, "{found}, expected {expected}");
        }
        assert!(cloud.harmonics_of(0)[1..].iter().flatten().all(|c| *c == 0.0));
        assert_eq!(shown(&initial_cloud(&points, &[]), 1), [0.5; 3]);
    }
}
