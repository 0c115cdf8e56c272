//! Cameras for a scene that came without: around its bulk, or inside it.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{EXTENT, Normalisation};

use super::bulk::Bulk;

/// Field of view along the shorter side, around a bulk and inside it, radians.
const FIELD_AROUND: f64 = 0.7;
const FIELD_INSIDE: f64 = 1.3;

/// Distances around a bulk: from this share of the one at which it fills the picture to the other.
const DISTANCES: [f64; 2] = [0.85, 1.15];

/// How far inside a room cameras leave its centre, share of the way to its walls.
const INSIDE_SHARE: f64 = 0.45;

/// `n` cameras that see the bulk from all sides, or from its inside all around; the first ones of more are the same.
///
/// Directions and places follow the additive recurrence of Roberts (2018), whose every beginning is spread evenly.
///
/// * `size_px`: width and height.
pub fn generated(bulk: &Bulk, n: usize, size_px: [u32; 2]) -> Vec<Camera> {
    (0..n).map(|i| if bulk.surrounds { inside(bulk, i, size_px) } else { around(bulk, i, size_px) }).collect()
}

fn around(bulk: &Bulk, i: usize, size_px: [u32; 2]) -> Camera {
    let [a, b, c, ..] = spread(i);
    let [nearest, farthest] = DISTANCES;
    let distance = bulk.radius / (0.5 * FIELD_AROUND).sin() * (nearest + (farthest - nearest) * c);
    let direction = on_sphere(a, b);
    camera(bulk.centre + direction * distance, -direction, FIELD_AROUND, size_px)
}

fn inside(bulk: &Bulk, i: usize, size_px: [u32; 2]) -> Camera {
    let [a, b, x, y, z] = spread(i);
    let place = bulk.centre + bulk.half_range * INSIDE_SHARE * (2.0 * DVec3::new(x, y, z) - 1.0);
    camera(place, on_sphere(a, b), FIELD_INSIDE, size_px)
}

/// Five numbers in 0..1: the fractions of (i + ½)·φ⁻ᵏ, where φ⁶ = φ + 1.
fn spread(i: usize) -> [f64; 5] {
    const PHI: f64 = 1.134_724_138_401_519_5;
    [1, 2, 3, 4, 5].map(|k| ((i as f64 + 0.5) * PHI.powi(-k)).fract())
}

fn on_sphere(a: f64, b: f64) -> DVec3 {
    let z = 1.0 - 2.0 * a;
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * b).sin_cos();
    DVec3::new(radius * cos, radius * sin, z)
}

/// OpenCV axes: x right, y down, z forward.
fn camera(place: DVec3, forward: DVec3, field: f64, [width_px, height_px]: [u32; 2]) -> Camera {
    // Any direction that is not the view's.
    let up = if forward.z.abs() < 0.9 { DVec3::Z } else { DVec3::X };
    let right = forward.cross(up).normalize();
    let down = forward.cross(right);
    let rotation = DMat3::from_cols(right, down, forward).transpose();
    let focal = 0.5 * f64::from(width_px.min(height_px)) / (0.5 * field).tan();
    Camera {
        rotation,
        translation: -(rotation * place),
        focal_px: [focal; 2],
        principal_px: [0.5 * f64::from(width_px), 0.5 * f64::from(height_px)],
        width_px,
        height_px,
    }
}

/// The frame in which these cameras are trained from: their mean at the origin, 1.1 × the largest distance from it [`EXTENT`].
///
/// `None` where they all stand in one point.
pub fn normalisation_of(cameras: &[Camera]) -> Option<Normalisation> {
    let centre = cameras.iter().map(Camera::centre_world).sum::<DVec3>() / cameras.len().max(1) as f64;
    let spread = cameras.iter().map(|camera| camera.centre_world().distance(centre)).fold(0.0, f64::max);
    let scale = EXTENT / (1.1 * spread);
    (spread > 0.0 && scale.is_finite()).then_some(Normalisation { centre, scale })
}

#[cfg(test)]
mod tests {
    use super::*;

    const BULK: Bulk = Bulk {
        centre: DVec3::new(1.0, 2.0, 3.0),
        radius: 2.0,
        half_range: DVec3::new(2.0, 1.0, 3.0),
        surrounds: false,
    };

    #[test]
    fn cameras_around_see_the_whole_bulk() {
        let cameras = generated(&BULK, 64, [80, 60]);
        assert_eq!(cameras[..8], generated(&BULK, 8, [80, 60])[..]);
        for camera in &cameras {
            let [x, y, z] = (camera.rotation * BULK.centre + camera.translation).to_array();
            let (u, v) = (camera.focal_px[0] * x / z + 40.0, camera.focal_px[1] * y / z + 30.0);
            assert!((u - 40.0).abs() < 1e-6 && (v - 30.0).abs() < 1e-6, "({u}, {v})");
            assert!(z > 1.5 * BULK.radius, "outside of it");
            assert!((camera.rotation.determinant() - 1.0).abs() < 1e-9);
        }
        let mean = cameras.iter().map(Camera::centre_world).sum::<DVec3>() / 64.0;
        assert!(mean.distance(BULK.centre) < 0.5, "from all sides: {mean}");
    }

    #[test]
    fn cameras_inside_stay_between_the_walls() {
        let cameras = generated(&Bulk { surrounds: true, ..BULK }, 64, [80, 60]);
        for camera in &cameras {
            let away = (camera.centre_world() - BULK.centre).abs();
            assert!(away.cmplt(0.5 * BULK.half_range).all(), "{away}");
        }
        let forward = cameras.iter().map(|c| c.rotation.transpose() * DVec3::Z).sum::<DVec3>() / 64.0;
        assert!(forward.length() < 0.2, "all around: {forward}");
    }

    #[test]
    fn cameras_are_normalised_as_those_of_captures() {
        let cameras = generated(&BULK, 32, [8, 8]);
        let normalisation = normalisation_of(&cameras).unwrap();
        let farthest = cameras.iter().map(|c| normalisation.point(c.centre_world()).length()).fold(0.0, f64::max);
        assert!((1.1 * farthest - EXTENT).abs() < 1e-9);
        assert_eq!(normalisation_of(&cameras[..1]), None);
    }
}
