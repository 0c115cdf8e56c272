//! What can be wrong with a capture as a whole.

use std::fmt;
use std::path::{Path, PathBuf};

use pocketsplat_files::{FileKind, shell_word, shown};

use super::camera_models::READABLE_MODELS;

/// Why a capture cannot be loaded; each message names the place, what was found, what is needed and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum DatasetError {
    /// The path is no folder.
    #[error("`{}` is not a folder; give the folder that holds the capture", shown(path))]
    NotAFolder { path: PathBuf },
    /// Something is there and cannot be reached.
    #[error("cannot reach `{}`: {why}; mend the link, or allow it: `chmod -R u+rX {}`", shown(path), shell_word(path))]
    OutOfReach { path: PathBuf, why: String },
    /// No known layout fits the folder.
    #[error(
        "`{}` is no capture that can be read: looked for {} and found none of them; {}",
        shown(path),
        looked_for.join(", "),
        match inside {
            Some(inside) => format!("its folder `{}` is one, give that", shown(inside)),
            None => "give the folder that holds one of them".to_owned(),
        }
    )]
    UnknownLayout { path: PathBuf, looked_for: Vec<&'static str>, inside: Option<PathBuf> },
    /// What is given is something else, such as photographs without poses.
    #[error("{found}")]
    NoCapture { found: String },
    /// A file of the capture cannot be read.
    #[error("cannot read `{}`: {source}; check that the file is there and may be read", shown(path))]
    Read { path: PathBuf, source: std::io::Error },
    /// A file of text is none.
    #[error("`{}` is no text, neither UTF-8 nor UTF-16 with a mark nor a byte a letter; export it again", shown(path))]
    NotText { path: PathBuf },
    /// A file is something else than its name says.
    #[error("`{}` is {kind}, needed: {needed}; {}", shown(path), remedy(path, *kind))]
    OtherKind { path: PathBuf, needed: &'static str, code: &'static str, kind: FileKind },
    /// A transforms file is no such JSON; the source gives line and column.
    #[error(
        "`{}` is not a transforms file: {source}; it needs `fl_x` or `camera_angle_x` and `frames`, each frame \
         with `file_path` and a `transform_matrix` of 4 rows of 4 numbers{}",
        shown(path), instead(path, *kind)
    )]
    Transforms { path: PathBuf, source: serde_json::Error, kind: Option<FileKind> },
    /// A file of another program's export is no such JSON; the source gives line and column.
    #[error(
        "`{}` is not {what}: {source}; it needs {needs}: export the capture again{}",
        shown(path), instead(path, *kind)
    )]
    Json { path: PathBuf, what: &'static str, needs: &'static str, source: serde_json::Error, kind: Option<FileKind> },
    /// The field of view is not an angle a pinhole camera can have.
    #[error(
        "`{}`: `camera_angle_x` is {found}, needed: the horizontal field of view in radians, between 0 and π; \
         convert it if it is in degrees",
        shown(path)
    )]
    FieldOfView { path: PathBuf, found: f64 },
    /// A transforms file gives no focal length.
    #[error(
        "`{}`: neither `fl_x` nor `camera_angle_x` is a number, for all frames or in the frame `{frame}`; give the \
         focal length in pixels or the horizontal field of view in radians",
        shown(path)
    )]
    NoFocal { path: PathBuf, frame: String },
    /// The capture has no model of that number.
    #[error("`{}` has no model {wanted}{}", shown(path), models_there(present))]
    ModelNumber { path: PathBuf, wanted: u32, present: Vec<u32> },
    /// The model went away while the capture was looked at.
    #[error("`{}` has no model in `sparse` or `colmap/sparse`; reconstruct the capture again", shown(path))]
    NoModel { path: PathBuf },
    /// A file of a COLMAP model is damaged.
    #[error("`{}`: {place}: {found}; export the model again, or copy it again if the file was cut", shown(path))]
    Model { path: PathBuf, place: String, found: String },
    /// A camera model that cannot be undistorted.
    #[error(
        "`{}`: {camera} has the camera model `{model}`, needed: {READABLE_MODELS}; undistort the capture first (COLMAP: \
         image_undistorter) or reconstruct it with one of these",
        shown(path)
    )]
    CameraModel { path: PathBuf, camera: String, model: String },
    /// There is no folder of images, or more than one to choose from.
    #[error("`{}` {}", shown(path), image_folder(wanted.as_deref(), present))]
    ImageFolder { path: PathBuf, wanted: Option<String>, present: Vec<String> },
    /// A point cloud is damaged or of an unknown kind.
    #[error("`{}` {found}; write it again, or take `ply_file_path` out, and training makes points", shown(path))]
    Ply { path: PathBuf, found: String },
    /// Too few training views are left after the unusable ones are set aside.
    #[error(
        "`{}`: {usable} of {listed} training views can be used, needed: at least {needed}; {}{}",
        shown(path),
        more_training_views(*usable, *held_out),
        list_faults(faults)
    )]
    TooFewViews { path: PathBuf, usable: usize, listed: usize, held_out: usize, needed: usize, faults: Vec<String> },
    /// The training cameras span no space, so the scene has no scale.
    #[error(
        "`{}`: all training cameras stand within {spread:.1e} of one point, so the scene has no scale; give views from \
         different places, or check the translations of the poses",
        shown(path)
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
    /// More than memory holds.
    #[error("{found} random points are asked for, needed: at most {most}")]
    RandomPoints { found: usize, most: usize },
    /// Somebody else's cache.
    #[error(
        "another process works with the decoded photographs in `{}`; wait for it to end, or choose another folder for the \
         run",
        shown(path)
    )]
    CacheInUse { path: PathBuf },
    /// No room for the decoded photographs.
    #[error(
        "the decoded photographs need {needed} bytes in `{}`, found free: {found}; make room, choose another folder for \
         the run, or load the photographs smaller (--max-resolution)",
        shown(path)
    )]
    DiskFull { path: PathBuf, needed: u64, found: u64 },
    /// The cache could not be written.
    #[error(
        "could not write the decoded photographs to `{}`: {source}; make the folder writable, or choose another one for the run",
        shown(path)
    )]
    CacheWrite { path: PathBuf, source: std::io::Error },
}

impl DatasetError {
    /// Of a file that the system does not let be read.
    pub(super) fn of_reading(path: &Path, source: std::io::Error) -> Self {
        Self::Read { path: path.to_owned(), source }
    }

    /// Of a file of text that is none.
    pub(super) fn of_no_text(path: &Path) -> Self {
        let path = path.to_owned();
        match kind_of(&path) {
            Some(kind) => Self::OtherKind { path, needed: "a file of text", code: "unreadable-file", kind },
            None => Self::NotText { path },
        }
    }

    /// Of a transforms file that is none.
    pub(super) fn of_transforms(path: &Path, source: serde_json::Error) -> Self {
        Self::Transforms { path: path.to_owned(), source, kind: kind_of(path) }
    }

    /// Of a file of another program's export that is none.
    pub(super) fn of_json(path: &Path, what: &'static str, needs: &'static str, source: serde_json::Error) -> Self {
        Self::Json { path: path.to_owned(), what, needs, source, kind: kind_of(path) }
    }

    /// Of a file of numbers that cannot be parsed at `place`.
    pub(super) fn of_model(path: &Path, place: String, found: String) -> Self {
        let path = path.to_owned();
        // By its first bytes only now: numbers may begin as a picture does.
        match kind_of(&path).filter(|kind| *kind != FileKind::Empty) {
            Some(kind) => Self::OtherKind { path, needed: "the file of a reconstruction", code: "bad-model", kind },
            None => Self::Model { path, place, found },
        }
    }

    /// Of a point cloud that cannot be parsed.
    pub(super) fn of_points(path: &Path, found: String) -> Self {
        let path = path.to_owned();
        match kind_of(&path).filter(|kind| !matches!(kind, FileKind::Empty | FileKind::Ply)) {
            Some(kind) => Self::OtherKind { path, needed: "a point cloud, .ply", code: "bad-points", kind },
            None => Self::Ply { path, found },
        }
    }

    /// The kind of error, as a code of [`Finding`](super::Finding).
    pub(super) fn code(&self) -> &'static str {
        match self {
            Self::NotAFolder { .. } => "not-a-folder",
            Self::UnknownLayout { .. } => "unknown-layout",
            Self::NoCapture { .. } => "no-capture",
            Self::Read { .. } | Self::OutOfReach { .. } | Self::NotText { .. } => "unreadable-file",
            Self::OtherKind { code, .. } => code,
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
            Self::MaxResolution { .. } | Self::TestEvery { .. } | Self::RandomPoints { .. } => "bad-option",
            Self::CacheInUse { .. } | Self::DiskFull { .. } | Self::CacheWrite { .. } => "cache",
        }
    }
}

fn kind_of(path: &Path) -> Option<FileKind> {
    FileKind::of_file(path).ok().flatten()
}

/// What to do about a file that is of another kind than its name says.
fn remedy(path: &Path, kind: FileKind) -> String {
    match (kind.remedy(), kind) {
        (Some(remedy), _) => remedy.to_owned(),
        (None, FileKind::Gzip) => {
            let (file, packed) = (shell_word(path), shell_word(&PathBuf::from(format!("{}.gz", path.display()))));
            format!("unpack it:\n  mv {file} {packed}\n  gunzip {packed}")
        }
        _ => "put the file itself in its place".to_owned(),
    }
}

/// What a file that should be JSON is instead, where its bytes say so.
fn instead(path: &Path, kind: Option<FileKind>) -> String {
    match kind {
        None | Some(FileKind::Json) => String::new(),
        Some(kind) => format!("; it is {kind}: {}", remedy(path, kind)),
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

/// Fewer views than this leave depth undetermined almost everywhere.
pub(super) const MIN_TRAIN_VIEWS: usize = 3;

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

/// What to do where too few views are left to train on.
///
/// * `held_out`: views that could be used but for `--test-every`.
pub(super) fn more_training_views(usable: usize, held_out: usize) -> String {
    if held_out > 0 && usable + held_out >= MIN_TRAIN_VIEWS {
        format!("train on all {} with `--test-every 0`, or take more photographs", usable + held_out)
    } else {
        "repair the views that were left out, or take more photographs".to_owned()
    }
}

fn list_faults(faults: &[String]) -> String {
    if faults.is_empty() { String::new() } else { format!("\n  {}", first_few(faults, "\n  ")) }
}
