//! The common frame: every capture is moved and scaled so that its training cameras span [`EXTENT`].

use glam::DVec3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::{EXTENT, Normalisation};
use crate::camera::Camera;

/// Half the side of the cube that random initial points fill, capture units; Synthetic-NeRF scenes lie within it.
pub(super) const RANDOM_CUBE_HALF: f64 = 1.3;

impl Normalisation {
    /// The similarity that puts the mean of `centres` at the origin and makes 1.1 × the largest distance from it
    /// [`EXTENT`], or `Err` with that largest distance where it gives no scale.
    pub(super) fn of_cameras(centres: &[DVec3]) -> Result<Self, f64> {
        // The count of views is far below 2^52.
        let centre = centres.iter().sum::<DVec3>() / centres.len() as f64;
        let spread = centres.iter().map(|c| c.distance(centre)).fold(0.0, f64::max);
        let scale = EXTENT / (1.1 * spread);
        // Cameras closer to each other than their coordinates resolve give a scale of rounding errors.
        let resolved = spread > 1e-9 * centre.abs().max_element().max(f64::MIN_POSITIVE);
        if resolved && scale.is_finite() { Ok(Self { centre, scale }) } else { Err(spread) }
    }

    /// Takes a point of the capture to the normalised frame: `(p − centre)·scale`.
    pub fn point(&self, point_world: DVec3) -> DVec3 {
        (point_world - self.centre) * self.scale
    }

    /// Takes a camera of the capture to the normalised frame, where it sees the same image.
    ///
    /// `R·p + t` with `p = q/scale + centre`, all times `scale` (projection ignores it): `R·q + scale·(R·centre + t)`.
    pub fn camera(&self, camera_world: &Camera) -> Camera {
        let translation = (camera_world.rotation * self.centre + camera_world.translation) * self.scale;
        Camera { translation, ..camera_world.clone() }
    }
}

/// Numbers drawn evenly from 0 to 1, without 1; the same for the same seed on every machine.
pub(super) fn unit_numbers(seed: u64) -> impl FnMut() -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // The upper 53 bits, the precision of f64, as a fraction of 1.
    move || (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// `n` points drawn evenly from the cube [−1.3, 1.3]³, capture units; the same for the same seed on every machine.
pub(super) fn random_points_world(n: usize, seed: u64) -> Vec<DVec3> {
    let mut unit = unit_numbers(seed);
    let mut coordinate = || RANDOM_CUBE_HALF * (2.0 * unit() - 1.0);
    (0..n).map(|_| DVec3::new(coordinate(), coordinate(), coordinate())).collect()
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;

    #[test]
    fn the_cameras_end_up_around_the_origin_spanning_the_extent() {
        let centres = [DVec3::new(10.0, 0.0, 1.0), DVec3::new(12.0, 1.0, 0.0), DVec3::new(11.0, 5.0, -1.0)];
        let normalisation = Normalisation::of_cameras(&centres).expect("a scale");
        let moved: Vec<DVec3> = centres.iter().map(|&c| normalisation.point(c)).collect();
        assert!(moved.iter().sum::<DVec3>().length() < 1e-12, "mean");
        let extent = 1.1 * moved.iter().map(|c| c.length()).fold(0.0, f64::max);
        assert!((extent - EXTENT).abs() < 1e-12, "extent {extent}");
    }

    #[test]
    fn a_point_projects_to_the_same_pixel_in_both_frames() {
        let normalisation = Normalisation { centre: DVec3::new(1.0, 2.0, 3.0), scale: 0.7 };
        let camera = Camera {
            rotation: DMat3::from_rotation_y(0.4),
            translation: DVec3::new(0.1, -0.2, 5.0),
            focal_px: [100.0, 110.0],
            principal_px: [32.0, 24.0],
            width_px: 64,
            height_px: 48,
        };
        let moved = normalisation.camera(&camera);
        let ratio = |camera: &Camera, p: DVec3| {
            let cam = camera.rotation * p + camera.translation;
            (cam.x / cam.z, cam.y / cam.z)
        };
        let p = DVec3::new(0.3, 0.6, -0.9);
        let (a, b) = (ratio(&camera, p), ratio(&moved, normalisation.point(p)));
        assert!((a.0 - b.0).abs() < 1e-12 && (a.1 - b.1).abs() < 1e-12, "{a:?} {b:?}");
        let centre = normalisation.point(camera.centre_world());
        assert!((moved.centre_world() - centre).length() < 1e-12, "centre");
    }

    #[test]
    fn cameras_in_one_place_have_no_scale() {
        assert_eq!(Normalisation::of_cameras(&[DVec3::ONE; 4]), Err(0.0));
        let jitter = [DVec3::splat(1e9), DVec3::splat(1e9 + 1e-7), DVec3::splat(1e9)];
        assert!(Normalisation::of_cameras(&jitter).is_err(), "a spread below the coordinates' resolution");
    }

    #[test]
    fn random_points_fill_the_cube_and_follow_the_seed() {
        let points = random_points_world(10_000, 7);
        assert_eq!(points, random_points_world(10_000, 7));
        assert_ne!(points, random_points_world(10_000, 8));
        assert!(points.iter().all(|p| p.abs().max_element() <= 1.3), "inside");
        let mean = points.iter().sum::<DVec3>() / 10_000.0;
        // The standard deviation of a mean of 10 000 is 1.3/√3/100.
        assert!(mean.length() < 0.04, "mean {mean}");
    }
}
