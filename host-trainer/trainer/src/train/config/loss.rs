//! The image's loss over a run.

use serde::{Deserialize, Serialize};

use super::{ConfigError, within};
use crate::step::{Difference, LossWeights};

/// Weights of the image's loss: L1 and SSIM as published (Lu et al. 2024, Scaffold-GS, eq. 10), later what PSNR measures and SSIM.
///
/// Growth follows the gradient of the loss. That of the root of the mean square is large at few places, and anchors that grow
/// there cost SSIM; so it comes when growth has ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LossPath {
    /// Share λ of 1 − SSIM; the difference has 1 − λ.
    pub dssim: f64,
    /// Mean volume of the Gaussians.
    pub volume: f64,
    /// Share of the run after which the difference is [`Difference::Rmse`]; 1: never.
    #[serde(default = "never")]
    pub rmse_from: f64,
}

/// Runs from before there was a choice.
const fn never() -> f64 {
    1.0
}

impl Default for LossPath {
    fn default() -> Self {
        Self { dssim: 0.2, volume: 0.01, rmse_from: 0.6 }
    }
}

impl LossPath {
    /// * `is_after`: whether a share of the run is done.
    pub(in crate::train) fn at(&self, is_after: impl FnOnce(f64) -> bool) -> LossWeights {
        let Self { dssim, volume, rmse_from } = *self;
        let difference = if is_after(rmse_from) { Difference::Rmse } else { Difference::L1 };
        LossWeights { difference, dssim, volume }
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        within("train.loss.dssim", self.dssim, 0.0, 1.0)?;
        within("train.loss.volume", self.volume, 0.0, 1e6)?;
        within("train.loss.rmse_from", self.rmse_from, 0.0, 1.0)
    }
}
