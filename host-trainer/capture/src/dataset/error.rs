//! What can be wrong with a capture as a whole.

use std::fmt;
use std::path::PathBuf;

use super::camera_models::READABLE_MODELS;

/// Why a capture cannot be loaded; each message names the place, what was found, what is needed and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum DatasetError {
    /// The path is no folder.
    #[error("`{}` is not a folder; give the folder that holds the capture", path.display())]
    NotAFolder { path: PathBuf },
    /// No known layout fits the folder.
    #[error(
        "`{}` is no capture that can be read: looked for {} and found none of them; {}",
        path.display(),
        looked_for.join(", "),
        match inside {
            Some(inside) => format!("its folder `{}` is one, give that", inside.display()),
            None => "give the folder that holds one of them".to_owned(),
        }
    )]
    UnknownLayout { path: PathBuf, looked_for: Vec<&'static str>, inside: Option<PathBuf> },
    /// What is given is something else, such as photographs without poses.
    #[error("{found}")]
    NoCapture { found: String },
    /// A file of the capture cannot be read.
    #[error("cannot read `{}`: {source}; check that the file is there and may be read", path.display())]
    Read { path: PathBuf, source: std::io::Error },
    /// A transforms file is no such JSON; the source gives line and column.
    #[error(
        "`{}` is not a transforms file: {source}; it needs `fl_x` or `camera_angle_x` and `frames`, each frame \
         with `file_path` and a `transform_matrix` of 4 rows of 4 numbers",
        path.display()
    )]
    Transforms { path: PathBuf, source: serde_json::Error },
    /// A file of a telephone's export is no such JSON; the source gives line and column.
    #[error("`{}` is not {what}: {source}; it needs {needs}: export the capture again", path.display())]
    Json { path: PathBuf, what: &'static str, needs: &'static str, source: serde_json::Error },
    /// The field of view is not an angle a pinhole camera can have.
    #[error(
        "`{}`: `camera_angle_x` is {found}, needed: the horizontal field of view in radians, between 0 and π; \
         convert it if it is in degrees",
        path.display()
    )]
    FieldOfView { path: PathBuf, found: f64 },
    /// A transforms file gives no focal length.
    #[error(
        "`{}`: neither `fl_x` nor `camera_angle_x` is a number, for all frames or in the frame `{frame}`; give the \
         focal length in pixels or the horizontal field of view in radians",
        path.display()
    )]
    NoFocal { path: PathBuf, frame: String },
    /// The capture has no model of that number.
    #[error("`{}` has no model {wanted}{}", path.display(), models_there(present))]
    ModelNumber { path: PathBuf, wanted: u32, present: Vec<u32> },
    /// The model went away while the capture was looked at.
    #[error("`{}` has no model in `sparse` or `colmap/sparse`; reconstruct the capture again", path.display())]
    NoModel { path: PathBuf },
    /// A file of a COLMAP model is damaged.
    #[error("`{}`: {place}: {found}; export the model again, or copy it again if the file was cut", path.display())]
    Model { path: PathBuf, place: String, found: String },
    /// A camera model that cannot be undistorted.
    #[error(
        "`{}`: {camera} has the camera model `{model}`, needed: {READABLE_MODELS}; undistort the capture first (COLMAP: \
         image_undistorter) or reconstruct it with one of these",
        path.display()
    )]
    CameraModel { path: PathBuf, camera: String, model: String },
    /// There is no folder of images, or more than one to choose from.
    #[error("`{}` {}", path.display(), image_folder(wanted.as_deref(), present))]
    ImageFolder { path: PathBuf, wanted: Option<String>, present: Vec<String> },
    /// A point cloud is damaged or of an unknown kind.
    #[error("`{}` {found}; write it again, or take `ply_file_path` out to start from random points", path.display())]
    Ply { path: PathBuf, found: String },
    /// Too few training views are left after the unusable ones are set aside.
    #[error(
        "`{}`: {usable} of {listed} training views can be used, needed: at least {needed}{}",
        path.display(),
        list_faults(faults)
    )]
    TooFewViews { path: PathBuf, usable: usize, listed: usize, needed: usize, faults: Vec<String> },
    /// The training cameras span no space, so the scene has no scale.
    #[error(
        "`{}`: all training cameras stand within {spread:.1e} of one point, so the scene has no scale; give views from \
         different places, or check the translations of the poses",
        path.display()
    )]
    NoBaseline { path: PathBuf, spread: f64 },
    /// The limit on the resolution is no size.
    #[error("the largest resolution is {found} px, needed: at least 1; leave it out to load images at their own size")]
    MaxResolution { found: u32 },
    /// Every view would be held out.
    #[error(
        "one view in {found} is to be held out, needed: at least 2, so that some are left to train on; 0 holds out none"
    )]
    TestEvery { found: u32 },
    /// Somebody else's cache.
    #[error(
        "another process works with the decoded photographs in `{}`; wait for it to end, or choose another folder for the \
         run",
        path.display()
    )]
    CacheInUse { path: PathBuf },
    /// No room for the decoded photographs.
    #[error(
        "the decoded photographs need {needed} bytes in `{}`, found free: {found}; make room, choose another folder for \
         the run, or load the photographs smaller (--max-resolution)",
        path.display()
    )]
    DiskFull { path: PathBuf, needed: u64, found: u64 },
    /// The cache could not be written.
    #[error(
        "could not write the decoded photographs to `{}`: {source}; make the folder writable, or choose another one for the run",
        path.display()
    )]
    CacheWrite { path: PathBuf, source: std::io::Error },
}

impl DatasetError {
    /// The kind of error, as a code of [`Finding`](super::Finding).
    pub(super) fn code(&self) -> &'static str {
        match self {
            Self::NotAFolder { .. } => "not-a-folder",
            Self::UnknownLayout { .. } => "unknown-layout",
            Self::NoCapture { .. } => "no-capture",
            Self::Read { .. } => "unreadable-file",
            Self::Transforms { .. } => "bad-transforms",
            Self::Json { .. } => "bad-export",
            Self::FieldOfView { .. } | Self::NoFocal { .. } => "bad-intrinsics",
            Self::ModelNumber { .. } => "bad-option",
            Self::NoModel { .. } => "unknown-layout",
            Self::Model { .. } => "bad-model",
            Self::CameraModel { .. } => "camera-model",
            Self::ImageFolder { .. } => "image-folder",
            Self::Ply { .. } => "bad-points",
            Self::TooFewViews { .. } => "too-few-views",
            Self::NoBaseline { .. } => "no-baseline",
            Self::MaxResolution { .. } | Self::TestEvery { .. } => "bad-option",
            Self::CacheInUse { .. } | Self::DiskFull { .. } | Self::CacheWrite { .. } => "cache",
        }
    }
}

fn models_there(present: &[u32]) -> String {
    let numbers: Vec<String> = present.iter().map(u32::to_string).collect();
    match numbers.as_slice() {
        [] => ": there is one, without a number; leave `--model` out".to_owned(),
        numbers => format!(": there are {}; give `--model` one of these, or leave it out", numbers.join(", ")),
    }
}

fn image_folder(wanted: Option<&str>, present: &[String]) -> String {
    let there = match present {
        [] => "there is neither `images` nor `images_…` nor `input`".to_owned(),
        present => format!("there are `{}`", present.join("`, `")),
    };
    match (wanted, present) {
        (Some(wanted), _) => format!("has no folder `{wanted}`: {there}; give `--images` one that is there"),
        (None, []) => format!("has no folder of images: {there}; put the photographs into `images`"),
        (None, _) => format!("has several folders of images: {there}; choose one with `--images`"),
    }
}

/// How many items a message spells out before it counts the rest.
const SPELT_OUT: usize = 3;

/// The first items, and how many more there are.
pub(super) fn first_few<T: fmt::Display>(items: &[T], separator: &str) -> String {
    let mut texts: Vec<String> = items.iter().take(SPELT_OUT).map(T::to_string).collect();
    if items.len() > SPELT_OUT {
        texts.push(format!("… and {} more", items.len() - SPELT_OUT));
    }
    texts.join(separator)
}

fn list_faults(faults: &[String]) -> String {
    if faults.is_empty() { String::new() } else { format!("\n  {}", first_few(faults, "\n  ")) }
}
