//! The context model: what an anchor's place says about its symbols, in integers.
//!
//! Its inputs are features of a grid (Chen et al. 2024, HAC, section 4), or the values of an anchor that was decoded before
//! (Wang et al. 2024, ContextGS, section 4): inputs → hidden units → per channel a mean and a scale, per group a quantisation
//! step. Training runs the same quantities in floats and ends on these integers; whatever decides a symbol is computed here and
//! nowhere else.
// Tests may index and add as they like; this is about bytes that nobody vouches for.
#![cfg_attr(not(test), deny(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::panic))]

mod grid;
mod levels;
mod mlp;
mod network;
mod steps;
mod taps;

pub use grid::{Corners, FEATURES_PER_LEVEL, GridFrame, GridLevel, LevelKind, WEIGHT_ONE};
pub use levels::{MAX_LEVEL_SHIFT, MAX_SPAN_SHIFT, N_LEVELS, N_POSITION_INPUTS, Place, Trail};
pub use mlp::{MAX_BIAS, MAX_CONTEXT_HIDDEN, MAX_CONTEXT_INPUTS, MAX_CONTEXT_LEVELS};
pub use network::Network;
pub use steps::{Group, GroupStep, MAX_STEP_EXPONENT, MEAN_PARTS, MIN_STEP_EXPONENT, N_GROUPS, PARENT_UNITS, Steps};
pub use taps::{MAX_TAPS, TAP_BITS, first_tap};

use crate::bytes::{Cursor, Emitter, Fields};
use crate::entropy::EIGHTHS;
use crate::error::{DecodeError, Field, SectionKind, in_range};
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
    /// Levels of the grid, up to [`MAX_CONTEXT_LEVELS`]; 0 where anchors follow anchors instead.
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
    inputs: Inputs<'a>,
    /// That of the coarsest level first.
    networks: &'a [u8],
    taps: Taps<'a>,
    n_hidden: u16,
    feature_dim: u16,
    n_log_scales: u16,
    n_channels: u16,
}

/// Where the inputs of the network come from.
#[derive(Clone, Copy, Debug)]
enum Inputs<'a> {
    /// A grid around the scene.
    Grid {
        levels: &'a [[u8; LEVEL_LEN]],
        /// Four bits a row, set for +1; two rows a byte, the first in the low half.
        grid: &'a [u8],
    },
    /// An anchor that was decoded before: the edges of the cells of levels 1 and 2, and of what level 2 lies in, as powers of two.
    Levels([u8; N_LEVELS]),
}

impl ContextHead {
    fn parse(record: &[u8; HEAD_LEN]) -> Result<Self, DecodeError> {
        let mut fields = Fields::new(record);
        let frame = GridFrame { min: fields.i32s(), scale: fields.u32s() };
        let base_steps = check_base_steps(fields.f32s())?;
        let [n_levels, n_taps] = fields.bytes();
        in_range(Field::ContextLevels, n_levels.into(), 0, MAX_CONTEXT_LEVELS.into())?;
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
        let mut n_rows = 0_u32;
        let inputs = if n_levels == 0 {
            let [shift_1, shift_2, shift_3, reserved] = *cursor.record()?;
            in_range(Field::LevelShift, shift_2.into(), shift_1.into(), MAX_LEVEL_SHIFT.into())?;
            in_range(Field::LevelShift, shift_3.into(), 0, MAX_SPAN_SHIFT.into())?;
            in_range(Field::Reserved, reserved.into(), 0, 0)?;
            in_range(Field::ContextTaps, n_taps.into(), 0, 0)?;
            Inputs::Levels([shift_1, shift_2, shift_3])
        } else {
            let (levels, _) = cursor.bytes(usize::from(n_levels).saturating_mul(LEVEL_LEN))?.as_chunks();
            for record in levels {
                n_rows = n_rows.saturating_add(checked_level(record)?.n_rows);
            }
            Inputs::Grid { levels, grid: &[] }
        };
        let mut context = Self {
            frame,
            base_steps,
            inputs,
            networks: &[],
            taps: Taps::default(),
            n_hidden,
            // A header's numbers, which are u16.
            feature_dim: feature_dim as u16,
            n_log_scales: n_log_scales as u16,
            n_channels: n_channels as u16,
        };
        let lens = (0..context.n_networks())
            .map(|level| Layer::pair_len(context.n_level_inputs(level), context.n_hidden(), context.n_outputs()));
        context.networks = cursor.bytes(lens.fold(0, usize::saturating_add))?;
        for level in 0..context.n_networks() {
            context.network(level).check()?;
        }
        context.taps = Taps::new(cursor.bytes(first_tap(feature_dim, n_taps.into()))?, n_taps)?;
        if let Inputs::Grid { grid, .. } = &mut context.inputs {
            *grid = cursor.bytes((n_rows as usize).div_ceil(2))?;
        }
        cursor.end()?;
        Ok(context)
    }

    /// Inputs of the network: [`FEATURES_PER_LEVEL`] a level of the grid, or those of an anchor that follows another: its place,
    /// then features and log-scales of its parent.
    #[must_use]
    pub fn n_inputs(&self) -> usize {
        self.n_level_inputs(0)
    }

    /// Hidden units.
    #[must_use]
    pub fn n_hidden(&self) -> usize {
        self.n_hidden.into()
    }

    /// Outputs: C means, C scales, three steps.
    #[must_use]
    pub fn n_outputs(&self) -> usize {
        usize::from(self.n_channels).saturating_mul(2).saturating_add(N_GROUPS)
    }

    /// Features that a feature's mean follows at most; 0 where the anchor's place says all.
    #[must_use]
    pub fn n_taps(&self) -> usize {
        self.taps.n_taps()
    }

    /// Residuals of an anchor's features to keep while it is decoded: none without taps.
    #[must_use]
    pub fn n_residuals(&self) -> usize {
        if self.n_taps() > 0 { self.feature_dim() } else { 0 }
    }

    /// Inputs that a parent gives: its features and log-scales.
    #[must_use]
    pub fn n_parent_inputs(&self) -> usize {
        usize::from(self.feature_dim.wrapping_add(self.n_log_scales))
    }

    /// Numbers to keep while a chunk is decoded: the residuals, or what the two anchors give that others may follow.
    #[must_use]
    pub fn n_kept(&self) -> usize {
        match self.inputs {
            Inputs::Grid { .. } => self.n_notes(),
            Inputs::Levels(_) => self.n_notes().wrapping_mul(2),
        }
    }

    /// Numbers to note of an anchor: its residuals, or what it gives those that follow it.
    pub(crate) fn n_notes(&self) -> usize {
        match self.inputs {
            Inputs::Grid { .. } => self.n_residuals(),
            Inputs::Levels(_) => self.n_parent_inputs(),
        }
    }

    /// What to note of a channel's symbol.
    ///
    /// * `raised_mean`: as the anchor's place gives it.
    #[inline(always)]
    pub(crate) fn note(&self, group: Group, step: &GroupStep, raised_mean: i32, symbol: i32) -> i16 {
        if self.n_taps() > 0 { residual(symbol, raised_mean) } else { step.parent_input(group, symbol) }
    }

    /// The edges of the cells of levels 1 and 2, and of what level 2 lies in, as powers of two, where anchors follow anchors.
    #[must_use]
    pub fn level_shifts(&self) -> Option<[u8; N_LEVELS]> {
        match self.inputs {
            Inputs::Grid { .. } => None,
            Inputs::Levels(shifts) => Some(shifts),
        }
    }

    /// Level and place of the next anchor of a chunk, where anchors follow anchors.
    #[inline]
    pub fn place(&self, trail: &mut Trail, cell: [i32; 3]) -> Option<Place> {
        self.level_shifts().map(|shifts| trail.next(shifts, &self.frame, cell))
    }

    fn n_networks(&self) -> usize {
        match self.inputs {
            Inputs::Grid { .. } => 1,
            Inputs::Levels(_) => N_LEVELS,
        }
    }

    /// The network of anchors of a level, where anchors follow anchors; with a grid there is level 0 alone.
    ///
    /// # Budget
    /// Some 40 instructions a level from the coarsest on.
    #[must_use]
    pub fn network(&self, level: usize) -> Network<'_, 'a> {
        let (mut network, mut rest) =
            Network::first(self, self.networks, self.n_level_inputs(self.n_networks().saturating_sub(1)));
        for level in (level..self.n_networks().saturating_sub(1)).rev() {
            (network, rest) = Network::first(self, rest, self.n_level_inputs(level));
        }
        network
    }

    /// Inputs of the network of a level: places, and what a parent gives; with a grid its features.
    fn n_level_inputs(&self, level: usize) -> usize {
        match self.inputs {
            Inputs::Grid { levels, .. } => levels.len().wrapping_mul(FEATURES_PER_LEVEL),
            Inputs::Levels(_) if level == N_LEVELS.wrapping_sub(1) => N_POSITION_INPUTS,
            Inputs::Levels(_) => N_POSITION_INPUTS.wrapping_add(self.n_parent_inputs()),
        }
    }

    /// The inputs of an anchor that follows another.
    ///
    /// * `parent`: `[n_parent_inputs]` [`GroupStep::parent_input`] of each of its parent's symbols; at level 2 of no meaning.
    ///   * `inputs`: `[n_inputs]`, filled.
    pub fn follow(&self, place: &Place, parent: &[i16], inputs: &mut [i16]) {
        let Some((at, given)) = inputs.split_first_chunk_mut() else { return };
        *at = place.position;
        for (input, value) in given.iter_mut().zip(parent) {
            *input = *value;
        }
    }

    /// Features of an anchor.
    #[must_use]
    pub fn feature_dim(&self) -> usize {
        self.feature_dim.into()
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

    /// The levels of the grid in the order of the inputs; none where anchors follow anchors.
    pub fn levels(&self) -> impl Iterator<Item = GridLevel> + use<'a> {
        let records = match self.inputs {
            Inputs::Grid { levels, .. } => levels,
            Inputs::Levels(_) => &[],
        };
        records.iter().filter_map(level)
    }

    /// Group of a channel.
    #[must_use]
    pub fn group(&self, channel: usize) -> Group {
        Group::of_channel(channel, self.feature_dim(), self.n_log_scales.into())
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
        let Inputs::Grid { levels, grid } = self.inputs else { return };
        let unit = self.frame.unit(lattice);
        let mut first_row = 0_u32;
        for (record, out) in levels.iter().zip(features.as_chunks_mut::<FEATURES_PER_LEVEL>().0) {
            let Some(level) = level(record) else { continue };
            // The weights of the rows that have +1; those of all others are what is left of 2²⁴.
            let mut sums = [0_u32; FEATURES_PER_LEVEL];
            for (row, weight) in level.corners(unit).iter() {
                let row = first_row.wrapping_add(row);
                let byte = grid.get((row >> 1) as usize).copied().unwrap_or_default();
                let signs = byte >> ((row & 1) << 2);
                for (bit, sum) in sums.iter_mut().enumerate() {
                    *sum = sum.wrapping_add(if signs & (1 << bit) != 0 { weight } else { 0 });
                }
            }
            // Σ ±weight = 2·sum − 2²⁴.
            const ROUNDED: u32 = WEIGHT_ONE.wrapping_sub(1 << (FEATURE_SHIFT - 1));
            *out = sums.map(|sum| ((sum << 1).wrapping_sub(ROUNDED).cast_signed() >> FEATURE_SHIFT) as i16);
            first_row = first_row.wrapping_add(level.n_rows);
        }
    }

    /// The raised mean of `feature` as the residuals of the features before move it; without taps itself, unlimited.
    #[inline(always)]
    pub(crate) fn moved(&self, feature: usize, raised_mean: i32, residuals: &[i16]) -> i32 {
        if self.n_taps() == 0 {
            return raised_mean;
        }
        // Within 4096 steps every symbol near the mean is an i16.
        raised_mean.wrapping_add(self.taps.shift(feature, residuals)).clamp(i16::MIN.into(), i16::MAX.into())
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
