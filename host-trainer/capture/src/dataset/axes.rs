//! Whether cameras without points look at what they surround: poses in other axes than they are read in look away from it.

use super::listing::{Listing, Note, Shot};
use crate::camera::{Camera, MIN_DETERMINANT, nearest_to_axes};

/// The axes meet where they pass the point at no more than this part of the cameras' distance from it, in the mean.
const MAX_MISS: f64 = 0.5;

/// A warning where the point in which the optical axes meet lies behind at least three quarters of the cameras.
///
/// Cameras that stand within a room and look outwards are such, too, so it is no error; where a capture brings points, these tell.
pub(super) fn looking_away(listing: &Listing) -> Option<Note> {
    if listing.points.as_ref().is_some_and(|(_, points)| !points.is_empty()) {
        return None;
    }
    let camera = |shot: &Shot| shot.lens.camera(shot.rotation, shot.translation);
    let cameras: Vec<Camera> = listing.sound().map(|(_, shot)| camera(shot)).collect();
    let focus = nearest_to_axes(cameras.iter(), MIN_DETERMINANT)?;
    let in_cameras: Vec<_> = cameras.iter().map(|camera| camera.rotation * focus + camera.translation).collect();
    let n_behind = in_cameras.iter().filter(|at| at.z < 0.0).count();
    let miss: f64 = in_cameras.iter().map(|at| at.truncate().length()).sum();
    let distance: f64 = in_cameras.iter().map(|at| at.length()).sum();
    let look_away = 4 * n_behind >= 3 * cameras.len() && miss <= MAX_MISS * distance;
    let text = format!(
        "cameras that look away from the point in which their axes meet: {n_behind} of {}; if the photographs show something from \
         around it, the poses are in OpenCV's axes (y down, z forward): turn the signs of the second and third column of every \
         `transform_matrix` to make them OpenGL's",
        cameras.len()
    );
    look_away.then(|| Note::warning("looking-away", text))
}
