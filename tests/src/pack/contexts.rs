//! Context sections of chosen integers.

use pocketsplat_format::context::{ContextHead, GridFrame, GridLevel, LevelKind, N_GROUPS, N_LEVELS, first_tap};

use super::numbers::Numbers;

/// Shift of the rows that give means, of those that give scales and steps.
const MEAN_SHIFT: u8 = 11;
const SCALE_SHIFT: u8 = 14;

/// One network: shifts, biases and weights of both layers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NetworkDraft {
    /// `[H]`.
    pub shift1: Vec<u8>,
    /// `[2C + 3]`.
    pub shift2: Vec<u8>,
    /// `[H]`.
    pub b1: Vec<i32>,
    /// `[2C + 3]`.
    pub b2: Vec<i32>,
    /// `[H, n]`.
    pub w1: Vec<i8>,
    /// `[2C + 3, H]`.
    pub w2: Vec<i8>,
}

/// A context section.
#[derive(Clone, Debug, PartialEq)]
pub struct ContextDraft {
    /// Where the grid lies, or what places are counted from.
    pub frame: GridFrame,
    /// Of features, log-scales, offsets.
    pub base_steps: [f32; N_GROUPS],
    /// Of the grid; none where anchors follow anchors.
    pub levels: Vec<GridLevel>,
    /// Where anchors follow anchors.
    pub shifts: Option<[u8; N_LEVELS]>,
    /// T.
    pub n_taps: u8,
    /// One, or those of levels 2, 1, 0.
    pub networks: Vec<NetworkDraft>,
    /// The weights of the taps.
    pub taps: Vec<i8>,
    /// Two rows a byte.
    pub grid: Vec<u8>,
}

/// What a context's widths follow from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ContextShape {
    /// F.
    pub features: usize,
    /// S.
    pub log_scales: usize,
    /// C.
    pub channels: usize,
    /// H.
    pub hidden: usize,
}

/// A level of the grid.
pub const fn level(kind: LevelKind, resolution: u16, n_rows: u32) -> GridLevel {
    GridLevel { kind, resolution, n_rows }
}

impl ContextDraft {
    /// A grid of random rows and a network of random weights: means of a few steps, and steps from an eighth to 1.8 base steps.
    pub fn grid(shape: ContextShape, frame: GridFrame, levels: Vec<GridLevel>, n_taps: u8, seed: u64) -> Self {
        let mut numbers = Numbers::of(seed);
        let n_rows: u32 = levels.iter().map(|level| level.n_rows).sum();
        let mut grid: Vec<u8> = numbers.many(n_rows.div_ceil(2) as usize, 0, 255).iter().map(|&x| x as u8).collect();
        if n_rows % 2 == 1 {
            *grid.last_mut().expect("a row") &= 0xF;
        }
        let n_tap_weights = first_tap(shape.features, n_taps.into());
        Self {
            frame,
            base_steps: [1.0 / 8.0; N_GROUPS],
            networks: vec![network(shape, 4 * levels.len(), &mut numbers)],
            levels,
            shifts: None,
            n_taps,
            taps: numbers.many(n_tap_weights, -40, 40).iter().map(|&x| x as i8).collect(),
            grid,
        }
    }

    /// Networks of random weights of anchors that follow anchors.
    pub fn following(shape: ContextShape, frame: GridFrame, shifts: [u8; N_LEVELS], seed: u64) -> Self {
        let mut numbers = Numbers::of(seed);
        let inputs = 3 + shape.features + shape.log_scales;
        Self {
            frame,
            base_steps: [1.0 / 8.0; N_GROUPS],
            levels: Vec::new(),
            shifts: Some(shifts),
            n_taps: 0,
            networks: [3, inputs, inputs].map(|n_in| network(shape, n_in, &mut numbers)).to_vec(),
            taps: Vec::new(),
            grid: Vec::new(),
        }
    }

    /// The section.
    pub fn section(&self) -> Vec<u8> {
        let head = ContextHead {
            frame: self.frame,
            base_steps: self.base_steps,
            n_levels: self.levels.len() as u8,
            n_taps: self.n_taps,
            n_hidden: self.networks[0].shift1.len() as u16,
        };
        let mut bytes = head.emit().to_vec();
        bytes.extend(self.levels.iter().flat_map(GridLevel::emit));
        if let Some([s_1, s_2, s_3]) = self.shifts {
            bytes.extend([s_1, s_2, s_3, 0]);
        }
        for network in &self.networks {
            bytes.extend(network.shift1.iter().chain(&network.shift2));
            bytes.extend(network.b1.iter().chain(&network.b2).flat_map(|bias| bias.to_le_bytes()));
            bytes.extend(network.w1.iter().chain(&network.w2).map(|weight| weight.cast_unsigned()));
        }
        bytes.extend(self.taps.iter().map(|tap| tap.cast_unsigned()));
        bytes.extend(&self.grid);
        bytes
    }
}

fn network(shape: ContextShape, n_in: usize, numbers: &mut Numbers) -> NetworkDraft {
    let ContextShape { features, log_scales, channels, hidden } = shape;
    let n_out = 2 * channels + N_GROUPS;
    let is_log_scale = |channel: usize| (features..features + log_scales).contains(&channel);
    let mut weights = |n: usize, reach: i32| numbers.many(n, -reach, reach).into_iter().map(|x| x as i8);
    let mut draft =
        NetworkDraft { shift1: vec![8; hidden], w1: weights(hidden * n_in, 40).collect(), ..NetworkDraft::default() };
    for output in 0..n_out {
        let (shift, bias, reach) = match output.checked_sub(channels) {
            // Log-scales of about −2: sixteen base steps of an eighth, in 64ths.
            None if is_log_scale(output) => (MEAN_SHIFT, -16 * 64, 16),
            None => (MEAN_SHIFT, 0, 32),
            Some(channel) if channel < channels => (SCALE_SHIFT, 12, 8),
            // Steps of features, log-scales, offsets.
            Some(group) => (SCALE_SHIFT, 0, if group == channels + 1 { 3 } else { 60 }),
        };
        draft.shift2.push(shift);
        draft.b2.push(bias << shift);
        draft.w2.extend(weights(hidden, reach));
    }
    draft.b1 = numbers.many(hidden, -(1 << 18), 1 << 19);
    draft
}
