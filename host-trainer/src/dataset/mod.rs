//! Captures: photographs with poses, normalised.

use glam::DVec3;

use crate::camera::Camera;

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
