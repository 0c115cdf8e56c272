//! From trained floats to integer symbols.

use super::{ChannelName, WriteError};
use crate::scene::Scene;

/// Largest magnitude of a lattice coordinate: f32 holds every integer there, and a chunk may span it twice.
const MAX_LATTICE: i32 = (1 << 22) - 1;

/// Distance between neighbouring values of each kind of channel; the value of a symbol is `symbol · step`.
///
/// The defaults take 28 % off a bundle of steps 0.02 and cost 0.14 dB (lego at 200 px; `docs/benchmarks.md`).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct QuantisationSteps {
    /// Of the features.
    pub feature: f32,
    /// Of the six log-scales: 0.05 is 5 % of size.
    pub log_scale: f32,
    /// Of the offsets, in units of the anchor's extent.
    pub offset: f32,
}

impl Default for QuantisationSteps {
    fn default() -> Self {
        Self { feature: 0.1, log_scale: 0.05, offset: 0.1 }
    }
}

impl QuantisationSteps {
    /// The step of channel `channel`.
    fn of(&self, name: ChannelName) -> f32 {
        match name {
            ChannelName::Feature(_) => self.feature,
            ChannelName::LogScale(_) => self.log_scale,
            ChannelName::Offset(..) => self.offset,
        }
    }
}

/// All anchors as integers.
pub(super) struct Rows {
    pub(super) n_channels: usize,
    /// `[n_anchors]`.
    pub(super) lattice: Vec<[i32; 3]>,
    /// `[n_anchors, n_channels]`.
    pub(super) symbols: Vec<i16>,
    /// `[n_channels]` step of each channel.
    pub(super) steps: Vec<f32>,
}

/// A run of anchors as integers.
#[derive(Clone, Copy)]
pub(super) struct RowSlice<'r> {
    pub(super) lattice: &'r [[i32; 3]],
    pub(super) symbols: &'r [i16],
}

impl Rows {
    /// The anchors in runs of `n`.
    pub(super) fn chunks(&self, n: usize) -> impl Iterator<Item = RowSlice<'_>> {
        let symbols = self.symbols.chunks(n * self.n_channels);
        self.lattice.chunks(n).zip(symbols).map(|(lattice, symbols)| RowSlice { lattice, symbols })
    }

    /// The symbols of one channel over all anchors.
    pub(super) fn channel(&self, channel: usize) -> impl Iterator<Item = i16> {
        self.symbols.iter().skip(channel).step_by(self.n_channels).copied()
    }
}

/// Rounds every trained value to its nearest symbol, ties to even.
pub(super) fn quantise(scene: &Scene<f32>, steps: &QuantisationSteps) -> Result<Rows, WriteError> {
    for (what, step) in
        [("feature step", steps.feature), ("log-scale step", steps.log_scale), ("offset step", steps.offset)]
    {
        if !(step.is_finite() && step > 0.0) {
            return Err(WriteError::NotPositive { what, value: step.into() });
        }
    }
    let shape = &scene.shape;
    let n_anchors = scene.anchors.len();
    let n_channels = shape.values_per_anchor();
    let arrays = [
        ("features", &scene.anchors.features, shape.feature_dim),
        ("log-scales", &scene.anchors.log_scales, 6),
        ("offsets", &scene.anchors.offsets, 3 * shape.n_offsets),
    ];
    for (array, values, width) in arrays {
        let needed = n_anchors * width;
        if values.len() != needed {
            return Err(WriteError::Length { array, needed, found: values.len() });
        }
    }
    for (anchor, cell) in scene.anchors.lattice.iter().enumerate() {
        if let Some(&found) = cell.iter().find(|c| c.unsigned_abs() > MAX_LATTICE.unsigned_abs()) {
            return Err(WriteError::BeyondLattice { anchor, found, limit: MAX_LATTICE });
        }
    }
    let names: Vec<ChannelName> = (0..n_channels).map(|channel| ChannelName::of(shape, channel)).collect();
    let mut symbols = Vec::with_capacity(n_anchors * n_channels);
    for anchor in 0..n_anchors {
        let values = arrays.iter().flat_map(|&(_, values, width)| &values[anchor * width..(anchor + 1) * width]);
        for (&value, &channel) in values.zip(&names) {
            symbols.push(symbol(value, steps.of(channel), anchor, channel)?);
        }
    }
    let steps = names.iter().map(|&name| steps.of(name)).collect();
    Ok(Rows { n_channels, lattice: scene.anchors.lattice.clone(), symbols, steps })
}

fn symbol(value: f32, step: f32, anchor: usize, channel: ChannelName) -> Result<i16, WriteError> {
    if !value.is_finite() {
        return Err(WriteError::NotFinite { anchor, channel, value });
    }
    let symbol = (f64::from(value) / f64::from(step)).round_ties_even();
    if symbol.abs() > f64::from(i16::MAX) {
        return Err(WriteError::BeyondSymbols { anchor, channel, value, step });
    }
    Ok(symbol as i16)
}
