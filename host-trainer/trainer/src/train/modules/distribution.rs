//! Distribution regularisation: features that are cheap to code because they all look alike.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::Module;
use crate::train::schedule::{ConfigError, within};
use pocketsplat_kernels::ops::loss::normality::{ChannelMoments, Weights};
use pocketsplat_kernels::real::Real;
use pocketsplat_kernels::scene::{ModelShape, Scene};
use pocketsplat_kernels::step::{Block, DeviceTerms, StepInfo, Terms};

/// Pulls the features of each channel, over the anchors of a view, towards the standard normal distribution, and their
/// deviation towards 1 (the plug-and-play paper, eqs. 2 and 3, with P the normal distribution of the channel's moments).
///
/// The mean over the channels i of `divergence·D(Pᵢ ‖ N(0, 1)) + spread·(σᵢ − 1)²`; raw values, before noise or rounding. (The paper
/// prints a sum: 50 features then weigh as much as the image, and cost quality.)
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Distribution {
    /// Weight of the divergence.
    pub divergence: f64,
    /// Weight of the deviation's squared distance to 1.
    pub spread: f64,
}

impl Default for Distribution {
    fn default() -> Self {
        Self { divergence: 1e-3, spread: 1e-3 }
    }
}

impl Module for Distribution {
    fn check(&self) -> Result<(), ConfigError> {
        within("train.modules.distribution.divergence", self.divergence, 0.0, 1e3)?;
        within("train.modules.distribution.spread", self.spread, 0.0, 1e3)
    }

    fn is_due(&self, _at: &StepInfo) -> bool {
        false
    }
}

impl Distribution {
    /// Of a channel, of so many.
    fn weights(&self, width: usize) -> [f64; 2] {
        let share = 1.0 / width.max(1) as f64;
        [self.divergence * share, self.spread * share]
    }
}

impl<R: Real> Terms<R> for Distribution {
    fn on_device(&self, at: &StepInfo, shape: &ModelShape, terms: &mut DeviceTerms) -> bool {
        if at.scaled {
            terms.normality = self.weights(shape.feature_dim);
        }
        true
    }

    fn on_anchors(&self, at: &StepInfo, scene: &Scene<R>, blocks: &mut [Block<R>]) -> R {
        if !at.scaled {
            return R::ZERO;
        }
        let width = scene.shape.feature_dim;
        let features_of = |block: &Block<R>| -> Vec<R> {
            let rows = block.anchors.iter().flat_map(|a| &scene.anchors.features[*a as usize * width..][..width]);
            rows.copied().collect()
        };
        let features: Vec<Vec<R>> = blocks.par_iter().map(features_of).collect();
        let parts: Vec<&[R]> = features.iter().map(Vec::as_slice).collect();
        let [divergence, spread] = self.weights(width).map(R::real);
        let weights = Weights { divergence, spread };
        let moments = ChannelMoments::of(&parts, width);
        blocks.par_iter_mut().zip(&features).for_each(|(block, features)| {
            moments.backward(&weights, features, &mut block.d_features);
        });
        moments.term(&weights)
    }
}
