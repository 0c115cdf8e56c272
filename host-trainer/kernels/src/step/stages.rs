//! Where the time of a step goes.

use std::time::Instant;

/// Wall-clock seconds of the stages of a step; 0 where a device was not asked for them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageSeconds {
    /// Prefilter, copying the visible anchors, what coding does to their values.
    pub context: f64,
    /// Heads, Gaussians, projection.
    pub anchors: f64,
    /// Sorting and tile lists.
    pub tiles: f64,
    /// Blending.
    pub rasterise: f64,
    /// Image to planes and back, L1, SSIM, their gradients, the squared error.
    pub loss: f64,
    /// From the image's gradient to the splats'.
    pub rasterise_backward: f64,
    /// From the splats' gradients to the anchors' and the heads'.
    pub anchors_backward: f64,
    /// The rate, and the context model's gradients.
    pub context_backward: f64,
}

/// Reads the time since the last reading.
pub(super) struct StageTimer(Instant);

impl StageTimer {
    pub(super) fn start() -> Self {
        Self(Instant::now())
    }

    pub(super) fn lap(&mut self) -> f64 {
        let now = Instant::now();
        now.duration_since(std::mem::replace(&mut self.0, now)).as_secs_f64()
    }
}
