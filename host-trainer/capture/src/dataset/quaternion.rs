//! Rotations that are written as quaternions: normalised where that is small, refused where it is not.

use std::path::Path;

use glam::{DMat3, DQuat};

use pocketsplat_files::shown;

use super::ViewFault;
use super::error::first_few;
use super::listing::Note;

/// Deviation of a length from 1 that rounding explains: text files carry at least three decimals.
const ROUNDED: f64 = 2e-3;

/// Largest deviation of a length from 1 that is taken for a missing normalisation.
const MAX_DEVIATION: f64 = 0.1;

/// The rotation of a quaternion as it is written.
///
/// # Errors
/// [`ViewFault::Quaternion`] where its length is not near 1.
pub(super) fn rotation_of(quaternion: DQuat) -> Result<DMat3, ViewFault> {
    let length = quaternion.length();
    if length.is_nan() || (length - 1.0).abs() > MAX_DEVIATION {
        return Err(ViewFault::Quaternion { length });
    }
    Ok(DMat3::from_quat(quaternion.normalize()))
}

/// Says which rotations had to be normalised by more than rounding explains.
///
/// * `path`: of the file that they stand in; `views`: the name and the quaternion of each.
pub(super) fn long_quaternions<'a>(path: &Path, views: impl Iterator<Item = (&'a str, DQuat)>) -> Option<Note> {
    let deviation = |quaternion: &DQuat| (quaternion.length() - 1.0).abs();
    let near: Vec<_> =
        views.filter(|(_, quaternion)| (ROUNDED..=MAX_DEVIATION).contains(&deviation(quaternion))).collect();
    let (_, worst) = near.iter().max_by(|(_, a), (_, b)| deviation(a).total_cmp(&deviation(b)))?;
    let names: Vec<&str> = near.iter().map(|(name, _)| *name).collect();
    let text = format!(
        "`{}`: rotations whose quaternion is not of length 1: {} ({}), the worst of length {:.6}; they were normalised: export \
         the model again with more digits if its views do not agree",
        shown(path),
        names.len(),
        first_few(&names, ", "),
        worst.length()
    );
    Some(Note::warning("quaternion-length", text))
}
