//! The trainable context model: what an anchor's place says about its values.

use pocketsplat_format::context::{
    FEATURES_PER_LEVEL, GridFrame, GridLevel, N_GROUPS, N_LEVELS, N_POSITION_INPUTS, first_tap,
};

use serde::{Deserialize, Serialize};

use super::grid_record::{Frame, levels};
use super::{Head, ModelShape};

/// What predicts, for every channel, mean and scale of its values, and for every group the quantisation step: a feature grid and
/// a network (Chen et al. 2024, HAC, section 4), or a network a level of anchors, which sees the values of the anchor that each
/// follows (Wang et al. 2024, ContextGS, section 4). [`pocketsplat_format::context`] is its integer form.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContextModel<R> {
    /// Where the grid lies on the lattice, or the places of anchors of level 2.
    #[serde(with = "Frame")]
    pub frame: GridFrame,
    /// Levels of the grid; none without one.
    #[serde(with = "levels")]
    pub levels: Vec<GridLevel>,
    /// `[Σ n_rows, 4]` rows of all levels, one after the other; only their signs count: +1 from 0 on, else −1.
    pub rows: Vec<R>,
    /// What makes distributions of the inputs: one network, or those of the anchors of levels 0, 1, 2.
    pub networks: Vec<ContextNetwork<R>>,
    /// Edges of the cells of levels 1 and 2, and of what level 2 lies in, as powers of two of the lattice's; none with a grid.
    pub shifts: Option<[u8; N_LEVELS]>,
    /// Steps of features, log-scales and offsets where the network says nothing.
    pub base_steps: [f32; N_GROUPS],
}

/// A network of a context model, and its taps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContextNetwork<R> {
    /// From 4 features a level of the grid, or the place and a parent's values, to 2C + 3 outputs: C means in base steps, C binary logarithms of scales in base steps,
    /// three binary logarithms of steps in base steps.
    pub mlp: Head<R>,
    /// Features that a feature's mean follows at most; 0 for none.
    pub n_taps: usize,
    /// Weights of the min(c, `n_taps`) features just before each feature c, from c = 0 on; see [`crate::ops::rate::taps`].
    pub taps: Vec<R>,
}

impl<R: Copy> ContextNetwork<R> {
    /// The parameter groups: those of the network, then the taps.
    pub fn groups(&self) -> [&[R]; 5] {
        let [w1, b1, w2, b2] = self.mlp.groups();
        [w1, b1, w2, b2, &self.taps]
    }

    /// The parameter groups in the same order, mutable.
    pub fn groups_mut(&mut self) -> [&mut Vec<R>; 5] {
        let [w1, b1, w2, b2] = self.mlp.groups_mut();
        [w1, b1, w2, b2, &mut self.taps]
    }

    /// The same with each parameter replaced by what `f` makes of it.
    pub fn map<T>(&self, f: impl Fn(R) -> T) -> ContextNetwork<T> {
        let taps = self.taps.iter().map(|tap| f(*tap)).collect();
        ContextNetwork { mlp: self.mlp.map(f), n_taps: self.n_taps, taps }
    }
}

impl<R: Copy> ContextModel<R> {
    /// Every parameter `value`, without taps.
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
        let networks = vec![ContextNetwork { mlp, n_taps: 0, taps: Vec::new() }];
        Self { frame, levels, rows: vec![value; n_rows * FEATURES_PER_LEVEL], networks, shifts: None, base_steps }
    }

    /// Every parameter `value`, for anchors that follow anchors.
    pub fn following(
        shape: &ModelShape,
        frame: GridFrame,
        shifts: [u8; N_LEVELS],
        n_hidden: usize,
        base_steps: [f32; N_GROUPS],
        value: R,
    ) -> Self {
        let n_out = 2 * shape.values_per_anchor() + N_GROUPS;
        let network = |level: usize| {
            let n_parent = if level + 1 < N_LEVELS { shape.feature_dim + shape.n_log_scales() } else { 0 };
            let mlp = Head::filled(N_POSITION_INPUTS + n_parent, n_hidden, n_out, value);
            ContextNetwork { mlp, n_taps: 0, taps: Vec::new() }
        };
        let networks = (0..N_LEVELS).map(network).collect();
        Self { frame, levels: Vec::new(), rows: Vec::new(), networks, shifts: Some(shifts), base_steps }
    }

    /// The same model with taps, all of them `value`.
    pub fn with_taps(mut self, shape: &ModelShape, n_taps: usize, value: R) -> Self {
        for network in &mut self.networks {
            network.n_taps = n_taps;
            network.taps = vec![value; first_tap(shape.feature_dim, n_taps)];
        }
        self
    }
}
