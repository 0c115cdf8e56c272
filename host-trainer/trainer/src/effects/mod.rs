//! Which effects a scene is worth having: named, forced by the command line, or measured and weighed.
//!
//! [`measure`] trains short pilots of a capture, without effects and with each, and draws training views that the pilots did not
//! see with the decoder; [`Price`] says what an effect's bytes and instructions cost in dB, and [`choose`] takes what gains most
//! beyond that.

mod pilot;
mod price;
mod request;
mod search;

use std::fmt;

pub use pilot::{LEAST_ITERATIONS, PILOTS_TIME_SHARE, PilotCapture, PilotError, PilotLog, PilotTraining, measure};
pub use price::{PilotFigures, Price, choose};
pub use request::{ParseEffectsError, Request};
pub use search::{Pilot, Pilots};

use crate::train::TrainConfig;
use crate::train::config::ExposureChoice;
use pocketsplat_kernels::scene::ModelShape;

/// Something that a scene may take into account; a scene without it has no part for it, and its decoder does no work for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// The colour head sees the unit vector from the camera to the anchor.
    ViewColour,
    /// The opacity and the covariance head see it.
    ViewGeometry,
    /// These heads see the distance from the camera to the anchor.
    ViewDistance,
    /// Opacities are compensated for the 0.3 px² dilation.
    DilationCompensation,
    /// The detail module's head adds to colours.
    Detail,
    /// Gaussians have three deviations and a rotation, not one deviation.
    Anisotropy,
    /// Each training photograph has an exposure and a white balance of its own; the scene shows their mean.
    Exposure,
}

impl Effect {
    /// All there are, in the order in which they are measured and named.
    pub const ALL: [Self; 7] = [
        Self::ViewColour,
        Self::ViewGeometry,
        Self::ViewDistance,
        Self::DilationCompensation,
        Self::Detail,
        Self::Anisotropy,
        Self::Exposure,
    ];

    /// Those that are measured: an exposure costs a decoder nothing, and the run itself decides about it; at one size of the image dilation compensation shows nothing of what it is for, and the distance of
    /// view paid in none of five captures (`docs/experiments/2026-11-21-neural-or-plain-gaussians.md`).
    pub const MEASURED: [Self; 4] = [Self::ViewColour, Self::ViewGeometry, Self::Detail, Self::Anisotropy];

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        self.name_and_key().0
    }

    /// The key of a configuration that decides about it, or the start of such keys.
    pub const fn key(self) -> &'static str {
        self.name_and_key().1
    }

    const fn name_and_key(self) -> (&'static str, &'static str) {
        match self {
            Self::ViewColour => ("view-colour", "train.shape.view_colour"),
            Self::ViewGeometry => ("view-geometry", "train.shape.view_geometry"),
            Self::ViewDistance => ("view-distance", "train.shape.view_distance"),
            Self::DilationCompensation => ("dilation-compensation", "train.shape.dilation_compensation"),
            Self::Detail => ("detail", "train.modules.detail"),
            Self::Anisotropy => ("anisotropy", "train.shape.anisotropic"),
            Self::Exposure => ("exposure", "train.exposure"),
        }
    }

    /// The switch of a shape that it is; `None` for a module, and for what no scene keeps.
    fn switch(self, shape: &mut ModelShape) -> Option<&mut bool> {
        Some(match self {
            Self::ViewColour => &mut shape.view_colour,
            Self::ViewGeometry => &mut shape.view_geometry,
            Self::ViewDistance => &mut shape.view_distance,
            Self::DilationCompensation => &mut shape.dilation_compensation,
            Self::Anisotropy => &mut shape.anisotropic,
            Self::Detail | Self::Exposure => return None,
        })
    }

    /// Whether a run has it.
    pub fn is_in(self, config: &TrainConfig) -> bool {
        match self {
            Self::Detail => config.modules.detail.is_some(),
            Self::Exposure => config.exposure == ExposureChoice::On,
            _ => self.switch(&mut config.shape.clone()).is_some_and(|on| *on),
        }
    }

    /// Gives it to a run, or takes it; settings that a module has are kept.
    pub fn set(self, config: &mut TrainConfig, on: bool) {
        if let Some(switch) = self.switch(&mut config.shape) {
            *switch = on;
        } else if self == Self::Exposure {
            config.exposure = if on { ExposureChoice::On } else { ExposureChoice::Off };
        } else {
            config.modules.detail = on.then(|| config.modules.detail.unwrap_or_default());
            config.shape.detail_hidden = config.modules.detail.map_or(0, |detail| detail.hidden);
        }
    }

    /// `config` with these of [`Self::MEASURED`] and no other; what is not measured stays.
    pub fn measured_only(effects: &[Self], config: &TrainConfig) -> TrainConfig {
        let mut config = *config;
        Self::MEASURED.into_iter().for_each(|effect| effect.set(&mut config, effects.contains(&effect)));
        config
    }

    /// Those that a run has.
    pub fn all_in(config: &TrainConfig) -> Vec<Self> {
        Self::ALL.into_iter().filter(|effect| effect.is_in(config)).collect()
    }

    /// Names of several, joined; `none` for none.
    pub fn names(effects: &[Self]) -> String {
        if effects.is_empty() {
            return "none".to_owned();
        }
        effects.iter().map(|effect| effect.name()).collect::<Vec<_>>().join(" + ")
    }
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_has_the_effects_it_is_given_and_a_shape_to_match() {
        let given = TrainConfig::default();
        for bits in 0..16 {
            let wanted: Vec<Effect> = (0..4).filter(|i| bits >> i & 1 == 1).map(|i| Effect::MEASURED[i]).collect();
            let config = Effect::measured_only(&wanted, &given);
            assert_eq!(Effect::all_in(&config), wanted);
            assert_eq!(config.modules.shape(config.shape), config.shape);
            assert_eq!(Effect::measured_only(&Effect::all_in(&given), &config), given, "nothing else changes");
        }
    }
}
