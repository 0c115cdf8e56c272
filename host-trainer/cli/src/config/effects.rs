//! How a run comes to its effects.

use pocketsplat_instructions::Processor;
use pocketsplat_trainer::effects::{LEAST_ITERATIONS, Price};
use serde::{Deserialize, Serialize};

/// How a run comes to its effects; once they are chosen they stand in its shape and modules, and nothing is measured again.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct EffectsConfig {
    /// Whether they are still to be measured.
    pub(crate) auto: bool,
    /// Shorter runs are not measured: pilots of an eighth of them say nothing.
    pub(crate) least_iterations: u32,
    /// The processor whose instructions count; a Cortex-M4 where none is named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) target: Option<Processor>,
    /// What they have to gain.
    pub(crate) price: Price,
}

impl Default for EffectsConfig {
    fn default() -> Self {
        Self { auto: true, least_iterations: LEAST_ITERATIONS, target: None, price: Price::default() }
    }
}
