//! What `train` does where nothing else is said.

use pocketsplat_capture::dataset::Background;
use pocketsplat_trainer::train::TrainConfig;
use pocketsplat_trainer::train::config::{Backbone, Hac};
use pocketsplat_trainer::train::modules::{Modules, Rdo};

use super::{CaptureOptions, RunConfig};

/// Weight of a value's bits where offsets and anchors that are not worth their bits are pruned, for photographs that show the scene
/// everywhere (`docs/experiments/2026-11-22-train-without-options.md`). The loss is a mean over pixels: where most of them are
/// transparent, and right from the start, the same weight would count bits for more.
const LAMBDA: f64 = 0.002;

/// How long a run takes, and how large its images are; all presets train HAC with rate–distortion pruning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
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

    /// The configuration of a run without options.
    pub(crate) fn config(self) -> RunConfig {
        RunConfig {
            capture: CaptureOptions {
                max_resolution: self.longest_px(),
                background: Some(Background::Black),
                ..CaptureOptions::default()
            },
            train: TrainConfig {
                iterations: self.iterations(),
                hac: Hac { lambda: LAMBDA, ..Hac::default() },
                modules: Modules { rdo: Some(Rdo::default()), ..Modules::default() },
                ..TrainConfig::of(Backbone::Hac)
            },
            scales_lambda: true,
            ..RunConfig::default()
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
