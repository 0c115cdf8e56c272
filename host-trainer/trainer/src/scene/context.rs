//! The trainable context model: what an anchor's place says about its values.

use pocketsplat_core::context::{FEATURES_PER_LEVEL, GridFrame, GridLevel, N_GROUPS};

use serde::{Deserialize, Serialize};

use super::grid_record::{Frame, levels};
use super::{Head, ModelShape};

/// A feature grid and a network that predicts, for every channel, mean and scale of its values, and for every group the
/// quantisation step (Chen et al. 2024, HAC, section 4). [`pocketsplat_core::context`] is its integer form.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContextModel<R> {
    /// Where the grid lies on the lattice.
    #[serde(with = "Frame")]
    pub frame: GridFrame,
    /// Its levels.
    #[serde(with = "levels")]
    pub levels: Vec<GridLevel>,
    /// `[Σ n_rows, 4]` rows of all levels, one after the other; only their signs count: +1 from 0 on, else −1.
    pub rows: Vec<R>,
    /// From 4 features a level to 2C + 3 outputs: C means in base steps, C binary logarithms of scales in base steps,
    /// three binary logarithms of steps in base steps.
    pub mlp: Head<R>,
    /// Steps of features, log-scales and offsets where the network says nothing.
    pub base_steps: [f32; N_GROUPS],
}

impl<R: Copy> ContextModel<R> {
    /// Every parameter `value`.
    pub fn filled(
        shape: &ModelShape,
        frame: GridFrame,
        levels: Vec<GridLevel>,
        n_hidden: usize,
        base_steps: [f32; N_GROUPS],
        value: R,
    ) -> Self {
        let n_rows: usize = levels.iter().map(|level| level.n_rows as usize).sum();
        let n_out = 2 * shape.values_per_anchor() + N_GROUPS;
        let mlp = Head::filled(levels.len() * FEATURES_PER_LEVEL, n_hidden, n_out, value);
        Self { frame, levels, rows: vec![value; n_rows * FEATURES_PER_LEVEL], mlp, base_steps }
    }
}
