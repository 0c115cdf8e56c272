//! Which layout a folder has, told by the files in it.

use std::path::{Path, PathBuf};

use pocketsplat_files::{closed_folder, shown};

use super::listing::Listing;
use super::{
    DatasetError, Layout, LoadOptions, blender, bundler, colmap, llff, metashape, nerfstudio, no_poses, nsvf, opensfm,
    polycam, realitycapture, record3d,
};

/// How far below a capture's folder the folders of its layout lie, as `sparse/0`.
const DEPTH: u32 = 2;

/// What reads the captures of a layout.
pub(super) struct Reader {
    layout: Layout,
    /// Whether a folder is of the layout, told by the files in it.
    fits: fn(&Path) -> bool,
    /// Lists the capture in a folder of the layout.
    pub(super) list: fn(&Path, &LoadOptions) -> Result<Listing, DatasetError>,
}

/// The readers, in the order in which they are asked.
const READERS: [Reader; 12] = [
    Reader { layout: Layout::Blender, fits: |path| path.join(blender::TRAIN_FILE).is_file(), list: blender::list },
    Reader { layout: Layout::Colmap, fits: |path| colmap::has_model(path, true), list: colmap::list },
    Reader { layout: Layout::Nerfstudio, fits: |path| path.join(nerfstudio::FILE).is_file(), list: nerfstudio::list },
    // After nerfstudio, which leaves the model in `colmap/sparse` that its transforms were made from.
    Reader { layout: Layout::Colmap, fits: |path| colmap::has_model(path, false), list: colmap::list },
    Reader { layout: Layout::Polycam, fits: |path| polycam::folders(path).is_some(), list: polycam::list },
    Reader { layout: Layout::Record3d, fits: |path| record3d::files(path).is_some(), list: record3d::list },
    Reader { layout: Layout::Nsvf, fits: nsvf::is_layout_of, list: nsvf::list },
    Reader { layout: Layout::OpenSfm, fits: |path| opensfm::file(path).is_some(), list: opensfm::list },
    Reader { layout: Layout::Bundler, fits: |path| bundler::files(path).is_some(), list: bundler::list },
    Reader { layout: Layout::Metashape, fits: |path| metashape::file(path).is_some(), list: metashape::list },
    Reader {
        layout: Layout::RealityCapture,
        fits: |path| realitycapture::table(path).is_some(),
        list: realitycapture::list,
    },
    Reader { layout: Layout::Llff, fits: |path| path.join(llff::POSES).is_file(), list: llff::list },
];

/// The reader of the folder `path`; none where it is no capture.
pub(super) fn reader_of(path: &Path) -> Option<Reader> {
    READERS.into_iter().find(|reader| (reader.fits)(path))
}

/// The layout of the folder `path`, told by the files in it; none where it is no capture.
pub fn layout_of(path: &Path) -> Option<Layout> {
    reader_of(path).map(|reader| reader.layout)
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
