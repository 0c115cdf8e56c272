//! Which layout a folder has, told by the files in it.

use std::path::Path;

use super::{DatasetError, Layout, blender, colmap, nerfstudio};

/// The layout of the folder `path`.
pub(super) fn layout_of(path: &Path) -> Option<Layout> {
    if path.join(blender::TRAIN_FILE).is_file() {
        Some(Layout::Blender)
    } else if colmap::has_model(path, true) {
        Some(Layout::Colmap)
    } else if path.join(nerfstudio::FILE).is_file() {
        Some(Layout::Nerfstudio)
    } else if colmap::has_model(path, false) {
        // After nerfstudio, which leaves the model in `colmap/sparse` that its transforms were made from.
        Some(Layout::Colmap)
    } else {
        None
    }
}

/// The error of a folder that is no capture; looks whether a folder in it is one.
pub(super) fn unknown_layout(path: &Path) -> DatasetError {
    let entries = std::fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
    let inside = entries.filter(|path| path.is_dir() && layout_of(path).is_some()).min();
    DatasetError::UnknownLayout { path: path.to_owned(), looked_for: Layout::LOOKED_FOR.to_vec(), inside }
}
