//! What a capture looked like when a run began, so that it goes on with the same one.

use rayon::prelude::*;

use serde::{Deserialize, Serialize};

use pocketsplat_capture::dataset::{Capture, View};

/// Numbers of a pose: rotation, translation.
const POSE_NUMBERS: usize = 9 + 3;

/// Numbers of a camera: its pose, focal lengths, principal point.
const CAMERA_NUMBERS: usize = POSE_NUMBERS + 2 + 2;

/// Largest difference of two cameras that count as the same, relative to numbers above 1: far below what training sees,
/// far above what the elementary functions of two machines differ by.
const CAMERA_TOLERANCE: f64 = 1e-9;

/// The training views and the background of a capture, with checksums in place of pixels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaptureSignature {
    background: [f32; 3],
    views: Vec<ViewSignature>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct ViewSignature {
    name: String,
    size_px: [u32; 2],
    camera: [f64; CAMERA_NUMBERS],
    /// CRC-32 of the pixels and the mask.
    pixels: u32,
}

/// Where a capture differs from the one a run began with.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CaptureDifference {
    /// More views, or fewer.
    #[error("it has {found} training views, the run began with {needed}")]
    Count {
        /// Views now.
        found: usize,
        /// Views then.
        needed: usize,
    },
    /// Other names, or another order.
    #[error("its training view {index} is `{found}`, the run began with `{needed}`")]
    Name {
        /// From 0.
        index: usize,
        /// Its name now.
        found: String,
        /// Its name then.
        needed: String,
    },
    /// Another resolution.
    #[error("its view `{view}` has {}×{} px, the run began with {}×{}", found[0], found[1], needed[0], needed[1])]
    Size {
        /// The view.
        view: String,
        /// Width and height now, pixels.
        found: [u32; 2],
        /// Width and height then, pixels.
        needed: [u32; 2],
    },
    /// Another pose or lens.
    #[error("the camera of its view `{view}` is another one than when the run began")]
    Camera {
        /// The view.
        view: String,
    },
    /// Another photograph or mask.
    #[error("the pixels or the mask of its view `{view}` are others than when the run began")]
    Pixels {
        /// The view.
        view: String,
    },
    /// Another background.
    #[error("its background is {found:?}, the run began with {needed:?}")]
    Background {
        /// RGB now.
        found: [f32; 3],
        /// RGB then.
        needed: [f32; 3],
    },
}

impl CaptureSignature {
    /// Reads every pixel that lies in memory once, on all threads: about a second for 10 GB. Of others the checksums are known.
    pub fn of(capture: &Capture) -> Self {
        Self { background: capture.background, views: capture.train.par_iter().map(ViewSignature::of).collect() }
    }

    /// Compares with the signature a run began with.
    ///
    /// # Errors
    /// The first [`CaptureDifference`].
    pub fn matches(&self, begun_with: &Self) -> Result<(), CaptureDifference> {
        self.matches_at_any_size(begun_with)?;
        for (now, then) in self.views.iter().zip(&begun_with.views) {
            let view = || now.name.clone();
            if now.size_px != then.size_px {
                return Err(CaptureDifference::Size { view: view(), found: now.size_px, needed: then.size_px });
            }
            if !are_close(&now.camera, &then.camera) {
                return Err(CaptureDifference::Camera { view: view() });
            }
        }
        match self.views.iter().zip(&begun_with.views).find(|(now, then)| now.pixels != then.pixels) {
            Some((now, _)) => Err(CaptureDifference::Pixels { view: now.name.clone() }),
            None => Ok(()),
        }
    }

    /// As [`Self::matches`], but the photographs may have another size: views, poses and the background are compared.
    ///
    /// # Errors
    /// The first [`CaptureDifference`].
    pub fn matches_at_any_size(&self, begun_with: &Self) -> Result<(), CaptureDifference> {
        let (found, needed) = (self.views.len(), begun_with.views.len());
        if found != needed {
            return Err(CaptureDifference::Count { found, needed });
        }
        for (index, (now, then)) in self.views.iter().zip(&begun_with.views).enumerate() {
            if now.name != then.name {
                return Err(CaptureDifference::Name { index, found: now.name.clone(), needed: then.name.clone() });
            }
            if !are_close(&now.camera[..POSE_NUMBERS], &then.camera[..POSE_NUMBERS]) {
                return Err(CaptureDifference::Camera { view: now.name.clone() });
            }
        }
        // Of a different background every view shows something; say that first.
        if self.background == begun_with.background {
            Ok(())
        } else {
            Err(CaptureDifference::Background { found: self.background, needed: begun_with.background })
        }
    }
}

fn are_close(now: &[f64], then: &[f64]) -> bool {
    now.iter().zip(then).all(|(a, b)| (a - b).abs() <= CAMERA_TOLERANCE * b.abs().max(1.0))
}

impl ViewSignature {
    fn of(view: &View) -> Self {
        let camera = &view.camera;
        let mut numbers = [0.0; CAMERA_NUMBERS];
        let all = camera.rotation.to_cols_array().into_iter().chain(camera.translation.to_array());
        for (to, from) in numbers.iter_mut().zip(all.chain(camera.focal_px).chain(camera.principal_px)) {
            *to = from;
        }
        Self {
            name: view.name.clone(),
            size_px: [camera.width_px, camera.height_px],
            camera: numbers,
            pixels: view.crc32(),
        }
    }
}
