//! Cameras on a circle around what a capture's cameras look at.

use std::f64::consts::TAU;

use glam::DVec3;
use pocketsplat_capture::camera::{Camera, nearest_to_axes};

/// Cameras of the orbit.
const N_CAMERAS: u32 = 24;
/// As [`nearest_to_axes`] takes it.
const MIN_DETERMINANT: f64 = 1e-6;

/// Cameras with the first one's lens, as far from the scene and as high above it as the given ones are on average.
///
/// The centre is the point nearest to all optical axes. Parallel axes have no such point; then there is no orbit.
pub(super) fn around(cameras: &[Camera]) -> Vec<Camera> {
    let Some(first) = cameras.first() else { return Vec::new() };
    let n = cameras.len() as f64;
    let Some(centre) = nearest_to_axes(cameras.iter(), MIN_DETERMINANT) else { return Vec::new() };
    let up = cameras.iter().map(|camera| -camera.rotation.row(1)).sum::<DVec3>().normalize_or(DVec3::Z);
    let height = cameras.iter().map(|camera| (camera.centre_world() - centre).dot(up)).sum::<f64>() / n;
    let distance = cameras.iter().map(|camera| camera.centre_world().distance(centre)).sum::<f64>() / n;
    // Never straight above, where a camera's up has no direction.
    let height = height.clamp(-0.95 * distance, 0.95 * distance);
    let radius = (distance * distance - height * height).sqrt();
    let [side, front] = [up.any_orthonormal_vector(), up.cross(up.any_orthonormal_vector())];
    (0..N_CAMERAS)
        .map(|i| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(N_CAMERAS)).sin_cos();
            let eye = centre + radius * (cos * side + sin * front) + height * up;
            first.looking_at(eye, centre, up)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::around;
    use pocketsplat_capture::camera::Camera;

    const LENS: Camera = Camera {
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
        focal_px: [50.0, 50.0],
        principal_px: [20.0, 15.0],
        width_px: 40,
        height_px: 30,
    };
    const TARGET: DVec3 = DVec3::new(0.3, -0.2, 0.1);

    /// Cameras on the upper half of a sphere of radius 3.
    fn cameras() -> Vec<Camera> {
        (0..40)
            .map(|i| {
                let (sin, cos) = (2.4 * f64::from(i)).sin_cos();
                let z = 0.05 + 0.9 * f64::from(i) / 40.0;
                let r = (1.0 - z * z).sqrt();
                LENS.looking_at(TARGET + 3.0 * DVec3::new(r * cos, r * sin, z), TARGET, DVec3::Z)
            })
            .collect()
    }

    #[test]
    fn the_orbit_circles_what_the_cameras_look_at() {
        let orbit = around(&cameras());
        assert_eq!(orbit.len(), 24, "cameras");
        for camera in &orbit {
            let eye = camera.centre_world();
            assert!((eye.distance(TARGET) - 3.0).abs() < 1e-9, "as far away as the others: {eye}");
            assert!((eye.z - TARGET.z - 3.0 * 0.489).abs() < 0.2, "about as high as the others: {eye}");
            let target = camera.rotation * TARGET + camera.translation;
            assert!(target.truncate().length() < 1e-9 && target.z > 0.0, "looks at the target: {target}");
            assert!((camera.rotation.determinant() - 1.0).abs() < 1e-9, "a rotation");
        }
    }

    #[test]
    fn parallel_cameras_have_no_orbit() {
        let beside = Camera { translation: DVec3::X, ..LENS };
        assert!(around(&[LENS, beside]).is_empty(), "no point is nearest to both axes");
        assert!(around(&[]).is_empty(), "no cameras");
    }
}
