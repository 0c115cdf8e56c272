//! Whether the cameras would look at one thing if their poses were read another way.

use glam::{DMat3, DVec3};

use crate::camera::{Camera, MIN_DETERMINANT, nearest_to_axes};
use crate::dataset::apart::quantile;
use crate::dataset::listing::Shot;

/// Axes meet where half of them pass the focus within so much of their camera's distance from it.
const MEET: f64 = 0.2;
/// Another reading has to be better by so much.
const BETTER: f64 = 4.0;

/// How poses were probably meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Misread {
    /// World to camera, where camera to world was read, or the reverse.
    Inverted,
    /// With one coordinate of the places negated.
    Mirrored,
}

/// The reading of the poses by which the optical axes meet, where they do not as they were read.
///
/// Cameras that look outwards, or past each other, meet by no reading, and are not told.
pub(super) fn misread(shots: &[&Shot]) -> Option<Misread> {
    let poses: Vec<(DMat3, DVec3)> = shots.iter().map(|shot| (shot.rotation, shot.centre_world())).collect();
    let given = spread_of_axes(poses.iter().copied());
    let is_better = |spread: f64| spread <= MEET && BETTER * spread <= given;
    // The inverse of `p → R·p + t` has the rotation Rᵀ and, with c = −Rᵀ·t, the centre −R·c.
    let inverted = poses.iter().map(|(rotation, centre)| (rotation.transpose(), -(*rotation * *centre)));
    if is_better(spread_of_axes(inverted)) {
        return Some(Misread::Inverted);
    }
    let mirrored = |axis: usize| {
        let sign = DVec3::from_array([0, 1, 2].map(|i| if i == axis { -1.0 } else { 1.0 }));
        spread_of_axes(poses.iter().map(|(rotation, centre)| (*rotation, sign * *centre)))
    };
    (0..3).any(|axis| is_better(mirrored(axis))).then_some(Misread::Mirrored)
}

/// The median distance of the optical axes from the point nearest to all, in distances of their cameras from it; infinite where there is
/// no such point, or where it is neither in front of three quarters of the cameras nor behind.
///
/// * `poses`: world to camera rotations, and centres.
fn spread_of_axes(poses: impl Iterator<Item = (DMat3, DVec3)>) -> f64 {
    let cameras: Vec<Camera> = poses.map(|(rotation, centre)| camera(rotation, centre)).collect();
    let Some(focus) = nearest_to_axes(cameras.iter(), MIN_DETERMINANT) else { return f64::INFINITY };
    let at: Vec<DVec3> = cameras.iter().map(|camera| camera.rotation * focus + camera.translation).collect();
    let n_in_front = at.iter().filter(|at| at.z > 0.0).count();
    if 4 * n_in_front.max(at.len() - n_in_front) < 3 * at.len() {
        return f64::INFINITY;
    }
    let spread = quantile(at.iter().map(|at| at.truncate().length() / at.length()), 0.5);
    if spread.is_nan() { f64::INFINITY } else { spread }
}

/// A camera of no picture in particular.
fn camera(rotation: DMat3, centre: DVec3) -> Camera {
    let translation = -(rotation * centre);
    Camera { rotation, translation, focal_px: [1.0; 2], principal_px: [0.0; 2], width_px: 1, height_px: 1 }
}
