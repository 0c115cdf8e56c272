//! Which layout a folder has, told by the files in it.

use std::path::{Path, PathBuf};

use pocketsplat_files::{closed_folder, shown};

use super::{
    DatasetError, Layout, blender, bundler, colmap, llff, metashape, nerfstudio, no_poses, nsvf, opensfm, polycam,
    realitycapture, record3d,
};

/// How far below a capture's folder the folders of its layout lie, as `sparse/0`.
const DEPTH: u32 = 2;

/// The layout of the folder `path`, told by the files in it; none where it is no capture.
pub fn layout_of(path: &Path) -> Option<Layout> {
    if path.join(blender::TRAIN_FILE).is_file() {
        Some(Layout::Blender)
    } else if colmap::has_model(path, true) {
        Some(Layout::Colmap)
    } else if path.join(nerfstudio::FILE).is_file() {
        Some(Layout::Nerfstudio)
    } else if colmap::has_model(path, false) {
        // After nerfstudio, which leaves the model in `colmap/sparse` that its transforms were made from.
        Some(Layout::Colmap)
    } else if polycam::is_layout_of(path) {
        Some(Layout::Polycam)
    } else if record3d::is_layout_of(path) {
        Some(Layout::Record3d)
    } else if nsvf::is_layout_of(path) {
        Some(Layout::Nsvf)
    } else if opensfm::is_layout_of(path) {
        Some(Layout::OpenSfm)
    } else if bundler::is_layout_of(path) {
        Some(Layout::Bundler)
    } else if metashape::is_layout_of(path) {
        Some(Layout::Metashape)
    } else if realitycapture::is_layout_of(path) {
        Some(Layout::RealityCapture)
    } else if llff::is_layout_of(path) {
        Some(Layout::Llff)
    } else {
        None
    }
}

/// The capture that a folder is a part of, such as of its `images` or `sparse/0`.
fn whole_of(path: &Path) -> Option<PathBuf> {
    path.ancestors().skip(1).take(3).find(|folder| layout_of(folder).is_some()).map(Path::to_owned)
}

/// The error of a folder that is no capture; looks whether a folder in it is one, and what else it may be.
pub(super) fn unknown_layout(path: &Path) -> DatasetError {
    let entries = std::fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
    if let Some((path, why)) = closed_folder(path, DEPTH) {
        return DatasetError::OutOfReach { path, why };
    }
    let inside = entries.filter(|path| path.is_dir() && layout_of(path).is_some()).min();
    if inside.is_none()
        && let Some(whole) = path.canonicalize().ok().and_then(|path| whole_of(&path))
    {
        let found = format!("`{}` is a part of the capture `{}`; give that folder", shown(path), shown(&whole));
        return DatasetError::NoCapture { found };
    }
    if inside.is_none()
        && let Some(found) = no_poses::found_instead(path)
    {
        return DatasetError::NoCapture { found };
    }
    DatasetError::UnknownLayout { path: path.to_owned(), looked_for: Layout::LOOKED_FOR.to_vec(), inside }
}
