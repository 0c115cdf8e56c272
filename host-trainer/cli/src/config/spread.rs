//! How far the cameras of a capture stand apart, so that a page moves by itself only where somebody stood.

use pocketsplat_capture::camera::Camera;

/// The share of the cameras, at the far end, that does not count: a stray pose governs nothing.
const LEFT_OUT: f64 = 0.05;
/// Parts of a normalised unit that are told.
const PARTS: f64 = 100.0;

/// How far cameras stand to the left of the first one, to the right of it, and ahead of it: each the 95th of a hundred, 0 where none does.
///
/// * The first camera is the bundle's preview. * Normalised units, to a hundredth. Nothing without a camera.
pub(super) fn spread<'a>(cameras: impl Iterator<Item = &'a Camera>) -> Option<[f64; 3]> {
    let cameras: Vec<&Camera> = cameras.collect();
    let first = cameras.first()?;
    let offsets: Vec<_> =
        cameras.iter().map(|camera| first.rotation * (camera.centre_world() - first.centre_world())).collect();
    let reach = |along: fn(&[f64; 3]) -> f64| {
        let mut values: Vec<f64> = offsets.iter().map(|offset| along(&offset.to_array())).collect();
        values.sort_by(f64::total_cmp);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
        let n_left_out = (LEFT_OUT * values.len() as f64).ceil() as usize;
        let last = values.len().saturating_sub(1 + n_left_out);
        (values[last].max(0.0) * PARTS).round() / PARTS
    };
    Some([reach(|[x, _, _]| -x), reach(|[x, _, _]| *x), reach(|[_, _, z]| *z)])
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::{DMat3, DVec3};

    use super::*;

    /// At a point, looking along z.
    fn camera(centre: DVec3) -> Camera {
        Camera {
            rotation: DMat3::IDENTITY,
            translation: -centre,
            focal_px: [100.0; 2],
            principal_px: [50.0; 2],
            width_px: 100,
            height_px: 100,
        }
    }

    #[test]
    fn a_row_of_cameras_reaches_to_its_ends_but_for_a_twentieth() {
        // From 10 to the left to 30 to the right; the first in between.
        let cameras: Vec<Camera> =
            std::iter::once(0).chain(-10..=30).map(|i| camera(DVec3::new(0.1 * f64::from(i), 0.2, 0.0))).collect();
        let [left, right, ahead] = spread(cameras.iter()).unwrap();
        assert!((0.7..=1.0).contains(&left) && (2.7..=3.0).contains(&right), "{left} {right}");
        assert_eq!(ahead, 0.0);
    }

    #[test]
    fn a_ring_reaches_beyond_its_middle() {
        let cameras: Vec<Camera> = (0..60)
            .map(|i| TAU * f64::from(i) / 60.0)
            .map(|angle| camera(3.0 * DVec3::new(angle.sin(), 0.0, -angle.cos())))
            .collect();
        let [left, right, ahead] = spread(cameras.iter()).unwrap();
        assert!(left > 2.8 && right > 2.8 && ahead > 5.5, "{left} {right} {ahead}");
    }

    #[test]
    fn one_stray_pose_in_twenty_moves_nothing() {
        let near = (0..19).map(|i| camera(DVec3::new(0.01 * f64::from(i), 0.0, 0.0)));
        let cameras: Vec<Camera> = near.chain([camera(DVec3::new(500.0, 0.0, 500.0))]).collect();
        let [left, right, ahead] = spread(cameras.iter()).unwrap();
        assert!(left == 0.0 && right < 0.2 && ahead == 0.0, "{left} {right} {ahead}");
        assert_eq!(spread([].into_iter()), None);
    }
}
