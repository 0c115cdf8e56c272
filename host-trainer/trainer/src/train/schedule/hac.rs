//! How a run trains towards few bits.

use pocketsplat_format::context::MAX_TAPS;
use serde::{Deserialize, Serialize};

use super::rates::DECAY_FROM;
use pocketsplat_kernels::scene::QuantisationSteps;

/// The kinds of scene that can be trained.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backbone {
    /// Anchors and three heads, trained for the image alone (Lu et al. 2024, Scaffold-GS).
    #[default]
    Scaffold,
    /// The same, trained for image and bits, with a context model and masks (Chen et al. 2024, HAC).
    Hac,
    /// HAC whose features follow the features before them, and whose masks answer for whole anchors (Chen et al. 2025, HAC++).
    HacPlus,
    /// The same as [`Self::Hac`] with another context: what an anchor coded before says of those around it (Wang et al. 2024,
    /// ContextGS, without its hyper-latents).
    #[serde(rename = "contextgs")]
    ContextGs,
}

impl Backbone {
    /// Whether it trains for bits too.
    pub fn is_coded(self) -> bool {
        self != Self::Scaffold
    }

    /// Taps of its context model for anchors of so many features: all features before one say something about it.
    pub(in crate::train) fn n_taps(self, feature_dim: usize) -> usize {
        match self {
            Self::Scaffold | Self::Hac | Self::ContextGs => 0,
            Self::HacPlus => (feature_dim - 1).min(MAX_TAPS.into()),
        }
    }
}

/// The rate's part of a run that trains for bits too; constants of the published trainer unless said otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hac {
    /// λ: weight of the mean bits of a value in the loss, for photographs that show the scene everywhere
    /// (docs/experiments/2026-11-22-train-without-options.md). The loss is a mean over pixels: where most of them are transparent, and
    /// right from the start, the same weight counts bits for more.
    pub lambda: f64,
    /// Share of the run from which on values are noised: 3,000 of 30,000 iterations.
    pub noise_from: f64,
    /// Share from which on anchors come and go again, after a pause that begins with the noise.
    pub pause_until: f64,
    /// Share from which on there is a context model and a rate: a third.
    pub context_from: f64,
    /// Share from which on values are rounded and the integer model decides. (HAC has no such phase.)
    pub exact_from: f64,
    /// Share of the anchors that a view shows over which its rate is taken; of those that few views show [more](pocketsplat_kernels::scene::Anchors::view_weights), so
    /// that over a run all anchors weigh alike, as they do in the file.
    pub sample: f64,
    /// Weight of the mean opening of the masks in the loss, while there is a rate; not with [`Backbone::HacPlus`], whose masks
    /// answer for their anchors' bits instead.
    pub mask_weight: f64,
    /// Weight of the bits of the grid's signs against those of the values. 0, for a bundle stores the signs as they are.
    /// (HAC codes them; 1.)
    pub grid_weight: f64,
    /// Steps of the noise at first, and what the context's steps are relative to. (HAC rounds sizes, not their logarithms,
    /// at 0.001, and has 0.2 for offsets; learned steps of offsets and log-scales then went to the upper end of their range.)
    pub base_steps: QuantisationSteps,
}

impl Default for Hac {
    fn default() -> Self {
        Self {
            lambda: 0.002,
            noise_from: 3_000.0 / 30_000.0,
            pause_until: 4_000.0 / 30_000.0,
            context_from: 10_000.0 / 30_000.0,
            exact_from: DECAY_FROM,
            sample: 0.05,
            mask_weight: 5e-4,
            grid_weight: 0.0,
            base_steps: QuantisationSteps { feature: 1.0, log_scale: 0.2, offset: 0.35 },
        }
    }
}

impl Hac {
    /// [`Self::base_steps`] in the order of the channels.
    pub fn base_steps(&self) -> [f32; 3] {
        self.base_steps.into()
    }

    /// Each setting with its name and limits.
    pub(in crate::train) fn ranges(&self) -> [(&'static str, f64, f64, f64); 11] {
        let QuantisationSteps { feature, log_scale, offset } = self.base_steps;
        [
            ("train.hac.lambda", self.lambda, 0.0, 1e3),
            ("train.hac.noise_from", self.noise_from, 0.0, 1.0),
            ("train.hac.pause_until", self.pause_until, 0.0, 1.0),
            ("train.hac.context_from", self.context_from, self.noise_from, 1.0),
            ("train.hac.exact_from", self.exact_from, self.context_from, 1.0),
            ("train.hac.sample", self.sample, 1e-6, 1.0),
            ("train.hac.mask_weight", self.mask_weight, 0.0, 1e3),
            ("train.hac.grid_weight", self.grid_weight, 0.0, 1e3),
            ("train.hac.base_steps.feature", feature.into(), 1e-9, 1e9),
            ("train.hac.base_steps.log_scale", log_scale.into(), 1e-9, 1e9),
            ("train.hac.base_steps.offset", offset.into(), 1e-9, 1e9),
        ]
    }
}
