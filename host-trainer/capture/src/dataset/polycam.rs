//! Raw exports of Polycam: `keyframes` with one photograph and one file of its camera for each moment.
//!
//! As polyform, the publisher's converter, documents them: `t_ij` are rows of a camera-to-world matrix in ARKit's axes, which
//! are those of OpenGL.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::depth_map::DepthMap;
use super::image_names::is_image_name;
use super::listing::{Listing, every_nth, files_with};
use super::transforms::{Frame, Intrinsics, list_frames};
use super::{DatasetError, Layout, LoadOptions, non_finite};

/// Cameras and their images: optimised over all moments and undistorted first, as tracked where there are none.
const FOLDERS: [(&str, &str); 2] = [("corrected_cameras", "corrected_images"), ("cameras", "images")];

/// The folders of cameras and of images: the first that hold something, for an export may leave the corrected ones empty.
pub(super) fn folders(folder: &Path) -> Option<(PathBuf, PathBuf)> {
    let keyframes = folder.join("keyframes");
    let folders = FOLDERS.iter().map(|(cameras, images)| (keyframes.join(cameras), keyframes.join(images)));
    let there: Vec<_> = folders.filter(|(cameras, images)| cameras.is_dir() && images.is_dir()).collect();
    let holds_images = |images: &Path| {
        let mut entries = std::fs::read_dir(images).into_iter().flatten().flatten();
        entries.any(|entry| is_image_name(&entry.file_name().to_string_lossy()))
    };
    let full =
        |(cameras, images): &&(PathBuf, PathBuf)| !files_with(cameras, "json").is_empty() && holds_images(images);
    there.iter().find(full).or_else(|| there.first()).cloned()
}

/// Lists the capture in `folder`, views by their time.
///
/// # Errors
/// As [`super::load`], as far as files but no pixels tell.
pub(super) fn list(folder: &Path, options: &LoadOptions) -> Result<Listing, DatasetError> {
    let Some((cameras, images)) = folders(folder) else {
        return Err(DatasetError::NotAFolder { path: folder.join("keyframes") });
    };
    let frames = files_with(&cameras, "json").iter().map(|path| frame(path)).collect::<Result<Vec<_>, _>>()?;
    let split = |i| Some(every_nth(options.test_every, i));
    let mut listing = list_frames(Layout::Polycam, cameras, &images, &frames, None, Vec::new(), split);
    let map = |kind: &str, photograph: &Path| {
        folder.join("keyframes").join(kind).join(photograph.file_name().unwrap_or_default()).with_extension("png")
    };
    for shot in listing.views.iter_mut().flat_map(|view| &mut view.shot) {
        shot.depth = DepthMap::at(map("depth", &shot.path), map("confidence", &shot.path));
    }
    Ok(listing)
}

/// The frame that a camera's file describes; numbers that are missing become NaN, which its view is left out for.
fn frame(path: &Path) -> Result<Frame, DatasetError> {
    let needs = "`fx`, `fy`, `cx`, `cy`, `width`, `height` and `t_00` to `t_23`";
    let camera: Value = non_finite::read_export(path, "a camera of Polycam", needs)?;
    let number = |name: &str| camera[name].as_f64();
    let row = |i: usize| (0..4).map(|j| number(&format!("t_{i}{j}")).unwrap_or(f64::NAN)).collect();
    let own = Intrinsics {
        fl_x: Some(number("fx").unwrap_or(f64::NAN)),
        fl_y: Some(number("fy").unwrap_or(f64::NAN)),
        cx: number("cx"),
        cy: number("cy"),
        w: number("width"),
        h: number("height"),
        ..Intrinsics::default()
    };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Frame::new(stem, &[row(0), row(1), row(2)], own))
}
