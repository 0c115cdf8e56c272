//! The context model: what an anchor's place says about its symbols (Chen et al. 2024, HAC, section 4), in integers.
//!
//! grid features → hidden units → per channel a mean and a scale, per group a quantisation step. Training runs the same
//! quantities in floats and ends on these integers; whatever decides a symbol is computed here and nowhere else.
// Tests may index and add as they like; this is about bytes that nobody vouches for.
#![cfg_attr(not(test), deny(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::panic))]

mod grid;
mod mlp;
mod steps;
mod taps;

pub use grid::{Corners, FEATURES_PER_LEVEL, GridFrame, GridLevel, LevelKind, WEIGHT_ONE};
pub use mlp::{MAX_BIAS, MAX_CONTEXT_HIDDEN, MAX_CONTEXT_LEVELS};
pub use steps::{Group, GroupStep, MAX_STEP_EXPONENT, MEAN_PARTS, MIN_STEP_EXPONENT, N_GROUPS, Steps};
pub use taps::{MAX_TAPS, TAP_BITS, first_tap};

use crate::bytes::{Cursor, Emitter, Fields};
use crate::entropy::{EIGHTHS, NormalModel};
use crate::error::{DecodeError, Field, SectionKind, in_range, saturate};
use mlp::Layer;
use steps::check_base_steps;
use taps::Taps;

/// Length of a level's record, bytes.
const LEVEL_LEN: usize = 8;
/// Length of what comes before the levels, bytes.
const HEAD_LEN: usize = 40;
/// Bits by which a weighted sum of rows is shortened to a feature: a feature of one is 2¹⁴.
const FEATURE_SHIFT: u32 = 10;

/// A feature of one.
pub const FEATURE_ONE: i16 = 1 << 14;

/// What a context section begins with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContextHead {
    /// Where the grid lies.
    pub frame: GridFrame,
    /// Steps of the three groups where the network says nothing.
    pub base_steps: [f32; N_GROUPS],
    /// Levels of the grid, 1..=[`MAX_CONTEXT_LEVELS`].
    pub n_levels: u8,
    /// Features that a feature's mean follows at most, 0..=[`MAX_TAPS`].
    pub n_taps: u8,
    /// Hidden units of the network, 1..=[`MAX_CONTEXT_HIDDEN`].
    pub n_hidden: u16,
}

/// The context section of a bundle, checked.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    frame: GridFrame,
    base_steps: [f32; N_GROUPS],
    levels: &'a [[u8; LEVEL_LEN]],
    hidden: Layer<'a>,
    output: Layer<'a>,
    taps: Taps<'a>,
    /// Four bits a row, set for +1; two rows a byte, the first in the low half.
    grid: &'a [u8],
    feature_dim: u16,
    n_log_scales: u16,
    n_channels: u16,
}

impl ContextHead {
    fn parse(record: &[u8; HEAD_LEN]) -> Result<Self, DecodeError> {
        let mut fields = Fields::new(record);
        let frame = GridFrame { min: fields.i32s(), scale: fields.u32s() };
        let base_steps = check_base_steps(fields.f32s())?;
        let [n_levels, n_taps] = fields.bytes();
        in_range(Field::ContextLevels, n_levels.into(), 1, MAX_CONTEXT_LEVELS.into())?;
        let n_hidden = fields.u16();
        in_range(Field::ContextHidden, n_hidden.into(), 1, MAX_CONTEXT_HIDDEN.into())?;
        Ok(Self { frame, base_steps, n_levels, n_taps, n_hidden })
    }

    /// Its bytes: the reverse of `parse`.
    #[must_use]
    pub fn emit(&self) -> [u8; HEAD_LEN] {
        let mut out = Emitter::new();
        out.i32s(self.frame.min);
        out.u32s(self.frame.scale);
        out.f32s(self.base_steps);
        out.bytes([self.n_levels, self.n_taps]);
        out.u16s([self.n_hidden]);
        out.finish()
    }
}

impl<'a> Context<'a> {
    /// Checks a section for anchors of `n_channels` channels, the first `feature_dim` of them features, then `n_log_scales`.
    ///
    /// # Errors
    /// [`DecodeError`] naming the section or the number outside its limits.
    pub fn parse(
        section: &'a [u8],
        feature_dim: usize,
        n_log_scales: usize,
        n_channels: usize,
    ) -> Result<Self, DecodeError> {
        let mut cursor = Cursor::new(section, SectionKind::Context);
        let ContextHead { frame, base_steps, n_levels, n_taps, n_hidden } = ContextHead::parse(cursor.record()?)?;
        let n_levels = usize::from(n_levels);
        let n_hidden = usize::from(n_hidden);
        let (levels, _) = cursor.bytes(n_levels.saturating_mul(LEVEL_LEN))?.as_chunks();
        let mut n_rows = 0_u32;
        for record in levels {
            n_rows = n_rows.saturating_add(checked_level(record)?.n_rows);
        }
        let n_inputs = n_levels.saturating_mul(FEATURES_PER_LEVEL);
        let n_outputs = n_channels.saturating_mul(2).saturating_add(N_GROUPS);
        let [hidden_shifts, output_shifts] = [cursor.bytes(n_hidden)?, cursor.bytes(n_outputs)?];
        let (hidden_biases, _) = cursor.bytes(n_hidden.saturating_mul(4))?.as_chunks();
        let (output_biases, _) = cursor.bytes(n_outputs.saturating_mul(4))?.as_chunks();
        let hidden_weights = cursor.bytes(n_inputs.saturating_mul(n_hidden))?;
        let output_weights = cursor.bytes(n_hidden.saturating_mul(n_outputs))?;
        let hidden = Layer { weights: hidden_weights, biases: hidden_biases, shifts: hidden_shifts, n_in: n_inputs };
        let output = Layer { weights: output_weights, biases: output_biases, shifts: output_shifts, n_in: n_hidden };
        hidden.check()?;
        output.check()?;
        let taps = Taps::new(cursor.bytes(first_tap(feature_dim, n_taps.into()))?, n_taps)?;
        let grid = cursor.bytes((n_rows as usize).div_ceil(2))?;
        if !cursor.rest().is_empty() {
            return Err(DecodeError::WrongLength {
                section: SectionKind::Context,
                expected: saturate(cursor.position()),
                found: saturate(section.len()),
            });
        }
        // At most 256, 6 and 358.
        let [feature_dim, n_log_scales, n_channels] = [feature_dim, n_log_scales, n_channels].map(|n| n as u16);
        Ok(Self { frame, base_steps, levels, hidden, output, taps, grid, feature_dim, n_log_scales, n_channels })
    }

    /// Inputs of the network: [`FEATURES_PER_LEVEL`] a level.
    #[must_use]
    pub fn n_inputs(&self) -> usize {
        self.hidden.n_in
    }

    /// Hidden units.
    #[must_use]
    pub fn n_hidden(&self) -> usize {
        self.output.n_in
    }

    /// Outputs: C means, C scales, three steps.
    #[must_use]
    pub fn n_outputs(&self) -> usize {
        self.output.biases.len()
    }

    /// Features that a feature's mean follows at most; 0 where the anchor's place says all.
    #[must_use]
    pub fn n_taps(&self) -> usize {
        self.taps.n_taps()
    }

    /// Residuals of an anchor's features to keep while it is decoded: none without taps.
    #[must_use]
    pub fn n_residuals(&self) -> usize {
        if self.n_taps() > 0 { usize::from(self.feature_dim) } else { 0 }
    }

    /// Features of an anchor.
    #[must_use]
    pub fn feature_dim(&self) -> usize {
        usize::from(self.feature_dim)
    }

    /// Where the grid lies.
    #[must_use]
    pub fn frame(&self) -> GridFrame {
        self.frame
    }

    /// Steps of the three groups where the network says nothing.
    #[must_use]
    pub fn base_steps(&self) -> [f32; N_GROUPS] {
        self.base_steps
    }

    /// The levels in the order of the inputs.
    pub fn levels(&self) -> impl Iterator<Item = GridLevel> + use<'a> {
        self.levels.iter().filter_map(level)
    }

    /// Group of a channel.
    #[must_use]
    pub fn group(&self, channel: usize) -> Group {
        Group::of_channel(channel, usize::from(self.feature_dim), usize::from(self.n_log_scales))
    }

    /// The grid's features at an anchor.
    ///
    /// Per level and feature `(Σ ±weight + 512) >> 10` over the corners: one is [`FEATURE_ONE`].
    ///
    /// * `features`: `[n_inputs]`, filled.
    ///
    /// # Budget
    /// 8 look-ups a volume, 4 a plane, of four features each.
    #[inline]
    pub fn features(&self, lattice: [i32; 3], features: &mut [i16]) {
        let unit = self.frame.unit(lattice);
        let mut first_row = 0_u32;
        for (level, out) in self.levels().zip(features.as_chunks_mut::<FEATURES_PER_LEVEL>().0) {
            let mut sums = [1_i32 << (FEATURE_SHIFT - 1); FEATURES_PER_LEVEL];
            for (row, weight) in level.corners(unit).iter() {
                let bits = self.row_bits(first_row.wrapping_add(row));
                // Weights add up to 2²⁴.
                for (bit, sum) in sums.iter_mut().enumerate() {
                    let weight = weight as i32;
                    *sum = sum.wrapping_add(if bits >> bit & 1 == 1 { weight } else { weight.wrapping_neg() });
                }
            }
            *out = sums.map(|sum| (sum >> FEATURE_SHIFT) as i16);
            first_row = first_row.wrapping_add(level.n_rows);
        }
    }

    /// The hidden units: `(W1·x + b1) >> shift`, limited to 0..=32767.
    ///
    /// * `features`: `[n_inputs]`. * `hidden`: `[n_hidden]`, filled.
    #[inline(always)]
    pub fn hidden(&self, features: &[i16], hidden: &mut [i16]) {
        self.hidden.rectified(features, hidden);
    }

    /// One output: `(W2·h + b2) >> shift`, limited to i16.
    #[inline(always)]
    #[must_use]
    pub fn output(&self, row: usize, hidden: &[i16]) -> i16 {
        self.output.limited(row, hidden)
    }

    /// The anchor's quantisation steps.
    #[inline]
    #[must_use]
    pub fn steps(&self, hidden: &[i16]) -> Steps {
        let first = usize::from(self.n_channels).saturating_mul(2);
        let raw = [0, 1, 2].map(|group: usize| self.output(first.saturating_add(group), hidden));
        Steps::new(self.base_steps, raw)
    }

    /// The distribution of a channel's symbol.
    ///
    /// * `residuals`: [`residual`](Self::residual) of every feature before, where there are taps.
    ///
    /// # Budget
    /// Two rows of the network.
    #[must_use]
    pub fn model(&self, channel: usize, steps: &Steps, hidden: &[i16], residuals: &[i16]) -> NormalModel {
        let mean = self.output(channel, hidden);
        let scale = self.output(channel.saturating_add(usize::from(self.n_channels)), hidden);
        let (group, step) = (self.group(channel), steps.of(self.group(channel)));
        let raised_mean = step.raised_mean(mean);
        // Without taps as the decoder has it, which then limits nothing.
        let follows = group == Group::Feature && self.n_taps() > 0;
        step.model(if follows { self.moved(channel, raised_mean, residuals) } else { raised_mean }, scale)
    }

    /// What a feature's symbol leaves of the mean that its anchor's place gives it, in eighths of the step.
    ///
    /// # Budget
    /// A row of the network.
    #[must_use]
    pub fn residual(&self, feature: usize, steps: &Steps, hidden: &[i16], symbol: i16) -> i16 {
        residual(symbol.into(), steps.of(Group::Feature).raised_mean(self.output(feature, hidden)))
    }

    /// The raised mean of `feature` as the residuals of the features before move it.
    #[inline(always)]
    pub(crate) fn moved(&self, feature: usize, raised_mean: i32, residuals: &[i16]) -> i32 {
        // Within 4096 steps every symbol near the mean is an i16.
        raised_mean.wrapping_add(self.taps.shift(feature, residuals)).clamp(i16::MIN.into(), i16::MAX.into())
    }

    /// Mean and scale of each channel from `first` on, in 1/[`MEAN_PARTS`] of a base step and in eighths of an octave of one.
    #[inline]
    pub(crate) fn moments(&self, first: usize, hidden: &[i16], moments: &mut [[i16; 2]]) {
        self.output.pairs(first, first.saturating_add(usize::from(self.n_channels)), hidden, moments);
    }

    fn row_bits(&self, row: u32) -> u8 {
        let byte = self.grid.get((row >> 1) as usize).copied().unwrap_or_default();
        if row & 1 == 0 { byte & 0xF } else { byte >> 4 }
    }
}

/// What a symbol leaves of a [raised mean](GroupStep::raised_mean), in eighths of the step; limited to i16.
#[inline(always)]
pub(crate) fn residual(symbol: i32, raised_mean: i32) -> i16 {
    let left = symbol.wrapping_mul(EIGHTHS).wrapping_add(EIGHTHS / 2).wrapping_sub(raised_mean);
    left.clamp(i16::MIN.into(), i16::MAX.into()) as i16
}

/// A level as its record has it.
fn level(record: &[u8; LEVEL_LEN]) -> Option<GridLevel> {
    let [kind, _, r0, r1, n_rows @ ..] = *record;
    let kind = LevelKind::from_code(kind)?;
    Some(GridLevel { kind, resolution: u16::from_le_bytes([r0, r1]), n_rows: u32::from_le_bytes(n_rows) })
}

impl GridLevel {
    /// The bytes of its record: what the reader of a bundle parses.
    #[must_use]
    pub fn emit(&self) -> [u8; LEVEL_LEN] {
        let mut out = Emitter::new();
        out.bytes([self.kind.code(), 0]);
        out.u16s([self.resolution]);
        out.u32s([self.n_rows]);
        out.finish()
    }
}

fn checked_level(record: &[u8; LEVEL_LEN]) -> Result<GridLevel, DecodeError> {
    let [kind, reserved, ..] = *record;
    in_range(Field::Reserved, reserved.into(), 0, 0)?;
    let unknown = DecodeError::OutOfRange { field: Field::GridKind, found: kind.into(), limit: 3 };
    let level = level(record).ok_or(unknown)?;
    in_range(Field::GridResolution, level.resolution.into(), 2, 1 << 15)?;
    if !level.is_dense() && !level.n_rows.is_power_of_two() {
        let limit = level.n_nodes().unwrap_or(u32::MAX);
        return Err(DecodeError::OutOfRange { field: Field::GridRows, found: level.n_rows, limit });
    }
    Ok(level)
}

const _: () = assert!(EIGHTHS == 8, "scale outputs and the tables count octaves alike");

#[cfg(test)]
mod tests {
    use super::{ContextHead, level};
    use crate::context::{GridFrame, GridLevel, LevelKind, MAX_CONTEXT_HIDDEN, MAX_CONTEXT_LEVELS};

    #[test]
    fn heads_come_back() {
        let frames = [[i32::MIN, -1, i32::MAX], [0, 77, -4000]].map(|min| GridFrame { min, scale: [0, 9, u32::MAX] });
        for frame in frames {
            for (n_levels, n_hidden) in [(1, 1), (MAX_CONTEXT_LEVELS, MAX_CONTEXT_HIDDEN), (7, 99)] {
                let n_taps = n_levels.wrapping_mul(2);
                let head = ContextHead { frame, base_steps: [1.0, 0.125, 0.3], n_levels, n_taps, n_hidden };
                assert_eq!(ContextHead::parse(&head.emit()), Ok(head));
            }
        }
    }

    #[test]
    fn levels_come_back() {
        for kind in [LevelKind::Volume, LevelKind::Xy, LevelKind::Xz, LevelKind::Yz] {
            for (resolution, n_rows) in [(2, 8), (u16::MAX, u32::MAX), (513, 1 << 19)] {
                let grid_level = GridLevel { kind, resolution, n_rows };
                assert_eq!(level(&grid_level.emit()), Some(grid_level));
            }
        }
    }
}
