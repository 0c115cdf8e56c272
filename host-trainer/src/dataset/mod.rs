//! Captures: photographs with poses, normalised.
//!
//! [`load`] tells the layout of a folder by the files in it and hands it to that layout's reader. What every reader
//! shares lives apart from them: pixels in `image`, pose checks in `pose`, the common frame in `normalise`.
//! A view that cannot be used is left out and named in the [`LoadReport`]; only a capture that cannot be trained on
//! at all is an error.

use std::path::Path;

use glam::DVec3;

use crate::camera::Camera;

mod blender;
mod error;
mod image;
mod normalise;
mod options;
mod pose;
mod report;

pub use error::{DatasetError, ViewFault};
pub use options::{Background, LoadOptions, UnknownBackground};
pub use pose::PoseFault;
pub use report::{LoadReport, SkippedView, Split};

/// An 8-bit RGB image, row-major, interleaved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Width, pixels.
    pub width_px: u32,
    /// Height, pixels.
    pub height_px: u32,
    /// `[height, width, 3]`.
    pub rgb: Vec<u8>,
}

/// One photograph and the camera that took it, in the normalised frame.
#[derive(Clone, Debug)]
pub struct View {
    /// Name as the capture gives it, for messages and file names.
    pub name: String,
    /// Camera in the normalised frame, for this image's size.
    pub camera: Camera,
    /// The photograph, composited on the capture's background.
    pub image: Image,
}

/// The similarity that takes the capture's world to the normalised frame: `p_norm = (p_world − centre) · scale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normalisation {
    /// Mean centre of the training cameras, capture units.
    pub centre: DVec3,
    /// Normalised units per capture unit.
    pub scale: f64,
}

/// A capture ready for training.
#[derive(Clone, Debug)]
pub struct Capture {
    /// Views to train on.
    pub train: Vec<View>,
    /// Views held out.
    pub test: Vec<View>,
    /// Points to start from, normalised frame.
    pub points: Vec<DVec3>,
    /// Takes capture coordinates to the normalised frame.
    pub normalisation: Normalisation,
    /// 1.1 × the largest distance of a training camera to their mean, normalised units: [`EXTENT`] by construction.
    pub extent: f64,
    /// What lies behind everything, linear copy of the 8-bit value / 255.
    pub background: [f32; 3],
}

/// The extent every capture is scaled to, because constants such as the near cull 0.2 assume extents of about 5.
pub const EXTENT: f64 = 5.0;

/// Loads the capture in the folder `path`.
///
/// The layout is told by the files present: `transforms_train.json` means Blender (Synthetic-NeRF). Images are decoded
/// on all threads, composited on [`LoadOptions::background`] and only then reduced, so that at most one full-size image
/// per thread is held; the result does not depend on the number of threads.
///
/// # Errors
/// [`DatasetError`] names the file, what was found, what is needed and what to do: a folder of unknown layout, a
/// transforms file that cannot be read, fewer than three usable training views, or training cameras all in one place.
pub fn load(path: &Path, options: &LoadOptions) -> Result<(Capture, LoadReport), DatasetError> {
    options.check()?;
    if !path.is_dir() {
        return Err(DatasetError::NotAFolder { path: path.to_owned() });
    }
    if blender::is_layout_of(path) {
        return blender::load(path, options);
    }
    Err(DatasetError::UnknownLayout { path: path.to_owned(), looked_for: blender::TRAIN_FILE })
}
