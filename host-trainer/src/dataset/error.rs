//! What can be wrong with a capture as a whole, and with one view of it.

use std::path::PathBuf;

use super::PoseFault;

/// Why a capture cannot be loaded; each message names the place, what was found, what is needed and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// The path is no folder.
    #[error("`{}` is not a folder: give the folder that holds the capture", path.display())]
    NotAFolder {
        /// The path given.
        path: PathBuf,
    },
    /// No known layout fits the folder.
    #[error(
        "`{}` is no capture that can be read: looked for `{looked_for}` (Blender layout) and did not find it; \
         give the folder that holds that file",
        path.display()
    )]
    UnknownLayout {
        /// The folder given.
        path: PathBuf,
        /// The file whose presence would have told the layout.
        looked_for: &'static str,
    },
    /// A file of the capture cannot be read.
    #[error("cannot read `{}`: {source}; check that the file is there and may be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A transforms file is no such JSON; the source gives line and column.
    #[error(
        "`{}` is not a transforms file: {source}; it needs `camera_angle_x` and `frames`, each frame with `file_path` \
         and a `transform_matrix` of 4 rows of 4 numbers",
        path.display()
    )]
    Transforms {
        /// The file.
        path: PathBuf,
        /// Where and what.
        source: serde_json::Error,
    },
    /// The field of view is not an angle a pinhole camera can have.
    #[error(
        "`{}`: `camera_angle_x` is {found}, needed: the horizontal field of view in radians, between 0 and π; \
         convert it if it is in degrees",
        path.display()
    )]
    FieldOfView {
        /// The file.
        path: PathBuf,
        /// The value in it.
        found: f64,
    },
    /// Too few training views are left after the unusable ones are set aside.
    #[error(
        "`{}`: {usable} of {listed} training views can be used, needed: at least {needed}{}",
        path.display(),
        list_faults(faults)
    )]
    TooFewViews {
        /// The file that lists the views.
        path: PathBuf,
        /// Views without a fault.
        usable: usize,
        /// Views in the file.
        listed: usize,
        /// Views a scene cannot be trained without.
        needed: usize,
        /// Why each of the others cannot be used: name and fault.
        faults: Vec<String>,
    },
    /// The training cameras span no space, so the scene has no scale.
    #[error(
        "`{}`: all training cameras stand within {spread:e} of one point, so the scene has no scale; give views from \
         different places, or check the last column of each `transform_matrix`",
        path.display()
    )]
    NoBaseline {
        /// The file that lists the views.
        path: PathBuf,
        /// Largest distance of a camera from their mean, capture units.
        spread: f64,
    },
    /// The limit on the resolution is no size.
    #[error("the largest resolution is {found} px, needed: at least 1; leave it out to load images at their own size")]
    MaxResolution {
        /// The value given.
        found: u32,
    },
}

/// How many faults a message spells out before it counts the rest.
pub(super) const FAULTS_SPELT_OUT: usize = 3;

fn list_faults(faults: &[String]) -> String {
    let mut text = String::new();
    for fault in faults.iter().take(FAULTS_SPELT_OUT) {
        text.push_str("\n  ");
        text.push_str(fault);
    }
    if faults.len() > FAULTS_SPELT_OUT {
        text.push_str(&format!("\n  … and {} more", faults.len() - FAULTS_SPELT_OUT));
    }
    text
}

/// Why one view cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewFault {
    /// The image is not there.
    #[error(
        "image missing: neither `{}` nor the same with `.png` exists; restore it or take the frame out of the \
         transforms file",
        path.display()
    )]
    Missing {
        /// The path as the capture gives it.
        path: PathBuf,
    },
    /// The image cannot be decoded.
    #[error("image unreadable: `{}`: {message}; replace it with a whole PNG or JPEG", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the decoder said.
        message: String,
    },
    /// The image's size is not the capture's.
    #[error(
        "`{}` is {}×{} px, the training images are {}×{} px; export it again at that size",
        path.display(), found_px.0, found_px.1, needed_px.0, needed_px.1
    )]
    Size {
        /// The file.
        path: PathBuf,
        /// Its width and height.
        found_px: (u32, u32),
        /// Width and height of most training images.
        needed_px: (u32, u32),
    },
    /// The pose is no rigid motion.
    #[error("`transform_matrix` {0}")]
    Pose(#[from] PoseFault),
}
