//! High-frequency detail compensation: a small head that adds to colours what the others smooth away.

use serde::{Deserialize, Serialize};

use super::Module;
use crate::train::schedule::{ConfigError, within};
use pocketsplat_kernels::ops::loss::high_pass;
use pocketsplat_kernels::real::Real;
use pocketsplat_kernels::scene::ModelShape;
use pocketsplat_kernels::step::{DeviceTerms, ImagePair, StepInfo, Terms};

/// Adds a residual to each Gaussian's colour, H = x + F(x ⊕ f) (the plug-and-play paper, eq. 5; see [`pocketsplat_kernels::ops::heads::detail`]).
///
/// The mean squared difference of image and photograph in high frequencies is added to the loss, as the paper's words ask for. (Its
/// eq. 6, as printed, only keeps residuals small.)
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Detail {
    /// Hidden width of the head.
    pub hidden: usize,
    /// Weight of the difference in high frequencies; 0 leaves the head to the image's own loss.
    pub weight: f64,
}

impl Default for Detail {
    fn default() -> Self {
        Self { hidden: 32, weight: 1.0 }
    }
}

impl Module for Detail {
    fn check(&self) -> Result<(), ConfigError> {
        within("train.modules.detail.hidden", self.hidden as f64, 1.0, 256.0)?;
        within("train.modules.detail.weight", self.weight, 0.0, 1e3)
    }

    fn shape(&self, shape: ModelShape) -> ModelShape {
        ModelShape { detail_hidden: self.hidden, ..shape }
    }

    fn is_due(&self, _at: &StepInfo) -> bool {
        false
    }
}

impl<R: Real> Terms<R> for Detail {
    fn on_device(&self, _at: &StepInfo, _shape: &ModelShape, terms: &mut DeviceTerms) -> bool {
        terms.high_pass += self.weight;
        true
    }

    fn is_on_image(&self) -> bool {
        self.weight > 0.0
    }

    fn on_image(&self, _at: &StepInfo, images: &ImagePair<'_, R>, d_image: &mut [R]) -> R {
        if self.weight == 0.0 {
            return R::ZERO;
        }
        let ImagePair { image, truth, size_px, level } = *images;
        high_pass::forward_backward(level, image, truth, size_px, R::real(self.weight), d_image)
    }
}
