//! What a run does where nothing else is said: every command that trains begins here.

use std::path::PathBuf;

use pocketsplat_capture::dataset::Background;
use pocketsplat_trainer::encode::Encoding;
use pocketsplat_trainer::train::TrainConfig;
use pocketsplat_trainer::train::config::{Backbone, HalfSize};
use pocketsplat_trainer::train::modules::{Modules, Rdo};

use serde::{Deserialize, Serialize};

use super::{CaptureOptions, EffectsConfig, RunConfig};

/// How long a run takes, and how large its images are; all presets train HAC with rate–distortion pruning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Preset {
    /// A first look: 200 px, 2,000 iterations.
    Quick,
    /// A good scene in a quarter of an hour: 400 px, 7,000 iterations.
    #[default]
    Standard,
    /// As the field publishes: images as they are, 30,000 iterations.
    Full,
}

impl Preset {
    /// Longest side of the images, px.
    pub(crate) const fn longest_px(self) -> Option<u32> {
        match self {
            Self::Quick => Some(200),
            Self::Standard => Some(400),
            Self::Full => None,
        }
    }

    /// Iterations of a run.
    pub(crate) const fn iterations(self) -> u32 {
        match self {
            Self::Quick => 2_000,
            Self::Standard => 7_000,
            Self::Full => 30_000,
        }
    }

    /// Share of the run on images of half the size, where it has been measured (docs/experiments/2026-11-28-smaller-images-first.md).
    const fn half_size_until(self) -> f64 {
        match self {
            Self::Standard => 0.35,
            Self::Quick | Self::Full => 0.0,
        }
    }

    /// The configuration of a run without options.
    pub(crate) fn config(self) -> RunConfig {
        RunConfig {
            preset: self,
            dataset: PathBuf::new(),
            output: PathBuf::new(),
            checkpoint_every: None,
            keep_checkpoints: false,
            fork_at: Vec::new(),
            capture: CaptureOptions {
                max_resolution: self.longest_px(),
                background: Some(Background::Black),
                ..CaptureOptions::default()
            },
            train: TrainConfig {
                backbone: Backbone::Hac,
                iterations: self.iterations(),
                half_size: HalfSize { until: self.half_size_until(), ..HalfSize::default() },
                modules: Modules { rdo: Some(Rdo::default()), ..Modules::default() },
                ..TrainConfig::default()
            },
            encoding: Encoding::default(),
            effects: EffectsConfig::default(),
            scales_lambda: true,
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::ValueEnum as _;

    use super::Preset;

    #[test]
    fn every_preset_can_be_trained() {
        for preset in Preset::value_variants() {
            preset.config().check().expect("a sound configuration");
        }
    }
}
