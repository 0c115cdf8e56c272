//! From a finished run to its bundle: coded, cut until it fits, measured, assembled.
//!
//! `choice` settles what codes the symbols, `sizes` says what a scene takes while it is trained, `fitting` leaves out anchors until the
//! bundle keeps the limits of the device. Both work on
//! [coded scenes](pocketsplat_codec::bundle::CodedScene); the file is assembled once, when its measures are known.

mod choice;
mod error;
mod fitting;
#[cfg(test)]
mod rounding;
mod sizes;
#[cfg(test)]
mod tests;

pub use choice::CoderChoice;
pub use error::EncodeError;
pub use fitting::{Cut, Fitted};
pub use sizes::EncodedSizes;

use pocketsplat_instructions::level::{LEVELS, Level};
use serde::{Deserialize, Serialize};

use crate::device::Limits;
use crate::train::config::Backbone;
use pocketsplat_codec::bundle::{PRUNING_RATES, WriteError, check_pruning_rates, check_steps};
use pocketsplat_kernels::scene::QuantisationSteps;

/// How a finished run becomes a bundle. Its limits also steer the training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Encoding {
    /// What codes the symbols.
    pub coder: CoderChoice,
    /// Pruning rates of the tiers, falling to 0.
    pub tiers: Vec<f32>,
    /// Steps of scenes without a context model.
    pub quantisation: QuantisationSteps,
    /// What the bundle has to fit into.
    #[serde(default, skip_serializing_if = "Limits::is_none")]
    pub limits: Limits,
}

impl Default for Encoding {
    fn default() -> Self {
        Self {
            coder: CoderChoice::Auto,
            tiers: PRUNING_RATES.to_vec(),
            quantisation: QuantisationSteps::default(),
            limits: Limits::default(),
        }
    }
}

impl Encoding {
    /// Refuses before any training what the writer would refuse after it.
    ///
    /// # Errors
    /// [`WriteError::Count`] for a level that there is not, [`WriteError::NotPositive`] for a step, [`WriteError::Tiers`] for pruning rates that do not fall to 0, [`WriteError::NoContext`]
    /// where the context is to code a scene that is trained without one.
    pub fn check(&self, backbone: Backbone) -> Result<(), WriteError> {
        if self.coder == CoderChoice::Context && !backbone.is_coded() {
            return Err(WriteError::NoContext);
        }
        if let Some(number) = self.limits.level.filter(|number| Level::numbered(*number).is_none()) {
            return Err(WriteError::Count { what: "level", found: number.into(), least: 1, most: LEVELS.len() });
        }
        check_steps(self.quantisation)?;
        check_pruning_rates(&self.tiers)
    }
}
