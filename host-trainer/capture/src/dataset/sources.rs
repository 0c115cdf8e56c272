//! The files that a capture is read from, wherever they lie.

use std::path::{Path, PathBuf};

use super::LoadOptions;
use super::listing::Shot;

/// Photographs, masks, points and the list of views that [`load`](super::load) reads of the capture in the folder `path`: some may lie
/// outside of it, as a `transforms.json` may name them. None where the capture cannot be listed. Costs as much as the images' headers.
pub fn files_read(path: &Path, options: &LoadOptions) -> Vec<PathBuf> {
    let Ok(listing) = super::list(path, options) else { return Vec::new() };
    let masks = |shot: &Shot| shot.masks.iter().map(|mask| mask.path.clone()).collect::<Vec<_>>();
    let mut files: Vec<PathBuf> =
        listing.sound().flat_map(|(_, shot)| std::iter::once(shot.path.clone()).chain(masks(shot))).collect();
    files.extend(listing.points.as_ref().map(|(file, _)| file.clone()));
    files.push(listing.source.clone());
    files
}
