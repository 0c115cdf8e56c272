//! What can be wrong with one view of a capture.

use std::path::{Path, PathBuf};

use pocketsplat_files::{FileKind, out_of_reach, shown, why_missing};

use super::PoseFault;
use super::camera_models::READABLE_MODELS;
use super::image_names::{PHOTOGRAPH_EXTENSIONS, conversion, foreign_name};

/// Why one view cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum ViewFault {
    /// The image is not there.
    #[error(
        "image missing: `{}` does not exist, nor does the same with the extension {}; restore it or take the view out of \
         {listed_in}",
        shown(path), PHOTOGRAPH_EXTENSIONS.join(" or ")
    )]
    Missing { path: PathBuf, listed_in: &'static str },
    /// The image is there, or a link in its place, and cannot be reached.
    #[error("image out of reach: `{}`: {why}; mend the link or the permissions", shown(path))]
    OutOfReach { path: PathBuf, why: String },
    /// The file is also another photograph's.
    #[error(
        "its name is `{written}`, and the file found for it, `{}`, is also found for `{other}`, but one file is not two \
         photographs; put each photograph where its name says",
        shown(path)
    )]
    SharedFile { path: PathBuf, other: String, written: String },
    /// The image cannot be decoded.
    #[error("image unreadable: `{}`: {message}; replace it with a whole PNG, JPEG or WebP", shown(path))]
    Unreadable { path: PathBuf, message: String },
    /// The file is no image at all.
    #[error("image unreadable: `{}`: it is {kind}; {}replace it with a whole PNG, JPEG or WebP", shown(path), first(*kind))]
    Kind { path: PathBuf, kind: FileKind },
    /// The image is of a format that is not read.
    #[error(
        "`{}` is {found}, needed: PNG, JPEG or WebP; convert the images, names need not change in the capture:\n  {}",
        shown(path), conversion(path.parent().unwrap_or(path), &shown(path))
    )]
    Format { path: PathBuf, found: &'static str },
    /// The image's size is not the capture's.
    #[error(
        "`{}` is {}×{} px, the training images are {}×{} px; export it again at that size",
        shown(path), found_px.0, found_px.1, needed_px.0, needed_px.1
    )]
    Size { path: PathBuf, found_px: (u32, u32), needed_px: (u32, u32) },
    /// The image has another shape than its camera.
    #[error(
        "`{}` is {}×{} px, its camera is for {}×{} px, which is another shape{}",
        shown(path), found_px.0, found_px.1, needed_px.0, needed_px.1,
        if (found_px.1, found_px.0) == *needed_px {
            ": it is turned on its side; store it as the poses were made from it (EXIF orientations are not applied)"
        } else {
            "; use the images that the poses were made from, or scale both sides alike"
        }
    )]
    Shape { path: PathBuf, found_px: (u32, u32), needed_px: (u32, u32) },
    /// The image does not cover the frame asked for.
    #[error(
        "`{}` is {}×{} px and does not cover the frame of {}×{} px; ask for a smaller frame",
        shown(path), found_px.0, found_px.1, needed_px.0, needed_px.1
    )]
    Small { path: PathBuf, found_px: (u32, u32), needed_px: (u32, u32) },
    /// The intrinsics are no lens.
    #[error("{found}; correct the camera's numbers or take the view out")]
    Lens { found: String },
    /// A camera model that cannot be undistorted.
    #[error("its camera model is `{model}`, needed: {READABLE_MODELS}; undistort the image first")]
    CameraModel { model: String },
    /// The view's camera is not in the model.
    #[error("its camera {camera_id} is not among the model's cameras; export the model again")]
    NoCamera { camera_id: u32 },
    /// The rotation is none.
    #[error("its rotation is a quaternion of length {length:.6}, needed: 1; export the model again")]
    Quaternion { length: f64 },
    /// The translation is none.
    #[error("its translation is {found:?}, needed: finite numbers; take the view out or export the model again")]
    Translation { found: [f64; 3] },
    /// The mask cannot be used.
    #[error("its mask `{}` {message}; restore the mask or take it out of the capture", shown(path))]
    Mask { path: PathBuf, message: String },
    /// The camera is far from all others.
    #[error(
        "its camera stands {median_distances:.0} times as far from the middle of all as half of them do, and near none; its pose is \
         probably wrong: mend it, or take the view out"
    )]
    Apart { median_distances: f64 },
    /// The pose is no rigid motion.
    #[error("`transform_matrix` {0}")]
    Pose(#[from] PoseFault),
}

impl ViewFault {
    /// The fault of an image that was not found at `path`.
    pub(super) fn of_missing(path: PathBuf, listed_in: &'static str) -> Self {
        match out_of_reach(&path) {
            Some(why) => Self::OutOfReach { path, why },
            None => Self::Missing { path, listed_in },
        }
    }

    /// The fault of a mask that was not found at `path`.
    pub(super) fn of_missing_mask(path: PathBuf) -> Self {
        Self::Mask { message: why_missing(&path), path }
    }

    /// The fault of an image with an unreadable header.
    pub(super) fn of_header(path: &Path, message: String) -> Self {
        let path = path.to_owned();
        match FileKind::of_file(&path).ok().flatten() {
            // Damaged, or cut.
            None | Some(FileKind::Png | FileKind::Jpeg | FileKind::WebP) => Self::Unreadable { path, message },
            Some(kind) => match foreign_name(kind) {
                Some(found) => Self::Format { path, found },
                None => Self::Kind { path, kind },
            },
        }
    }

    /// The kind of fault, as a code of [`Finding`](super::Finding).
    pub(super) fn code(&self) -> &'static str {
        match self {
            Self::Missing { .. } => "missing-image",
            Self::SharedFile { .. } => "shared-image",
            Self::Unreadable { .. } | Self::OutOfReach { .. } | Self::Kind { .. } => "unreadable-image",
            Self::Format { .. } => "image-format",
            Self::Size { .. } | Self::Small { .. } => "image-size",
            Self::Shape { .. } => "image-shape",
            Self::Lens { .. } => "bad-intrinsics",
            Self::CameraModel { .. } => "camera-model",
            Self::NoCamera { .. } => "missing-camera",
            Self::Quaternion { .. } | Self::Translation { .. } | Self::Pose(_) => "bad-pose",
            Self::Mask { .. } => "bad-mask",
            Self::Apart { .. } => "pose-outlier",
        }
    }

    /// The file at fault, where it is the view's own.
    pub(super) fn path(&self) -> Option<&Path> {
        match self {
            Self::Missing { path, .. }
            | Self::OutOfReach { path, .. }
            | Self::SharedFile { path, .. }
            | Self::Unreadable { path, .. }
            | Self::Kind { path, .. }
            | Self::Format { path, .. }
            | Self::Size { path, .. }
            | Self::Shape { path, .. }
            | Self::Small { path, .. }
            | Self::Mask { path, .. } => Some(path),
            _ => None,
        }
    }
}

/// What helps against a file of this kind, to be tried first.
fn first(kind: FileKind) -> String {
    kind.remedy().map_or_else(String::new, |remedy| format!("{remedy}, or "))
}
