//! Quantisation steps of an anchor, from a table: 2^(q/8) times the scene's base steps.

use crate::entropy::{EIGHTHS, NormalModel, SCALE_ONE};
use crate::error::{DecodeError, Field};

/// Groups of channels that share a step.
pub const N_GROUPS: usize = 3;
/// Smallest exponent: an eighth of the base step.
pub const MIN_STEP_EXPONENT: i32 = -24;
/// Largest exponent: 1.83 base steps; HAC's 1 + tanh stays below 2.
pub const MAX_STEP_EXPONENT: i32 = 7;
/// Means leave the network in parts of a base step.
pub const MEAN_PARTS: i32 = 64;

/// Base steps of a feature and of a log-scale that are an input of one to the anchors that follow; offsets are none.
pub const PARENT_UNITS: [i32; N_GROUPS] = [16, 64, 1];

/// 2^(i/8), the part of an octave.
const PART_OF_OCTAVE: [f32; 8] =
    [1.0, 1.090_507_7, 1.189_207_1, 1.296_839_6, core::f32::consts::SQRT_2, 1.542_210_8, 1.681_792_9, 1.834_008_1];
/// round(4096·2^(−i/8)).
const INVERSE_PART_OF_OCTAVE: [i32; 8] = [4096, 3756, 3444, 3158, 2896, 2656, 2435, 2233];
/// 2⁻¹² of the inverse, and from 64ths to eighths.
const MEAN_SHIFT: u32 = 15;
/// Half of an eighth, which rounds, and half of a step.
const HALF_STEP: i32 = (1 << (MEAN_SHIFT - 1)) + ((EIGHTHS / 2) << MEAN_SHIFT);

/// Channels that share a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// The F features.
    Feature,
    /// The log-scales.
    LogScale,
    /// The 3K offsets.
    Offset,
}

impl Group {
    /// All, in the order of a file.
    pub const ALL: [Self; N_GROUPS] = [Self::Feature, Self::LogScale, Self::Offset];

    pub(super) const fn of_channel(channel: usize, feature_dim: usize, n_log_scales: usize) -> Self {
        if channel < feature_dim {
            Self::Feature
        } else if channel < feature_dim.saturating_add(n_log_scales) {
            Self::LogScale
        } else {
            Self::Offset
        }
    }
}

/// The step of one group of an anchor's channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupStep {
    /// Distance between neighbouring symbols' values; the value of a symbol is `f32(symbol)·step`.
    pub value: f32,
    /// 32 − q, from a scale in base steps to a scale index.
    scale_shift: i32,
    /// T, from means to eighths of the step.
    mean_factor: i32,
}

/// The steps of one anchor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steps {
    exponents: [i8; N_GROUPS],
    values: [f32; N_GROUPS],
}

impl Steps {
    /// Steps base·2^(q/8), the exponents q limited to [`MIN_STEP_EXPONENT`]..=[`MAX_STEP_EXPONENT`].
    #[must_use]
    pub fn new(base_steps: [f32; N_GROUPS], exponents: [i16; N_GROUPS]) -> Self {
        let exponents = exponents.map(|q| i32::from(q).clamp(MIN_STEP_EXPONENT, MAX_STEP_EXPONENT) as i8);
        let mut values = base_steps;
        for (value, &exponent) in values.iter_mut().zip(&exponents) {
            let part = PART_OF_OCTAVE.get(usize::from(exponent as u8 & 7)).copied().unwrap_or(1.0);
            // Octaves −3 to 0, as exact powers of two.
            let octave = match exponent >> 3 {
                ..=-3 => 0.125,
                -2 => 0.25,
                -1 => 0.5,
                0.. => 1.0,
            };
            *value = *value * part * octave;
        }
        Self { exponents, values }
    }

    /// The exponents, five bits each.
    pub(crate) fn to_bits(self) -> u16 {
        self.exponents.iter().rev().fold(0, |bits, &exponent| (bits << 5) | u16::from(exponent as u8 & 31))
    }

    /// The same for symbols that stand for themselves.
    pub(crate) fn unscaled(self) -> Self {
        Self { values: [1.0; N_GROUPS], ..self }
    }

    /// The steps whose exponents [`to_bits`](Self::to_bits) gave.
    pub(crate) fn from_bits(base_steps: [f32; N_GROUPS], bits: u16) -> Self {
        // −24..=7 are 32 numbers, so five bits tell them apart: 0..=7 stand for themselves.
        let exponent = |group: u32| {
            let low = (bits >> group.wrapping_mul(5) & 31) as i16;
            if low <= MAX_STEP_EXPONENT as i16 { low } else { low.wrapping_sub(32) }
        };
        Self::new(base_steps, [exponent(0), exponent(1), exponent(2)])
    }

    /// q, in eighths of an octave.
    #[inline]
    #[must_use]
    pub fn exponent(&self, group: Group) -> i32 {
        let [feature, log_scale, offset] = self.exponents;
        i32::from(match group {
            Group::Feature => feature,
            Group::LogScale => log_scale,
            Group::Offset => offset,
        })
    }

    /// Distance between neighbouring symbols' values; the value of a symbol is `f32(symbol)·step`.
    #[inline]
    #[must_use]
    pub fn value(&self, group: Group) -> f32 {
        let [feature, log_scale, offset] = self.values;
        match group {
            Group::Feature => feature,
            Group::LogScale => log_scale,
            Group::Offset => offset,
        }
    }

    /// The step of `group`.
    #[inline]
    #[must_use]
    pub fn of(&self, group: Group) -> GroupStep {
        let exponent = self.exponent(group);
        let part = INVERSE_PART_OF_OCTAVE.get((exponent & 7) as usize).copied().unwrap_or(4096);
        // q = 8·octave + part, so T = INVERSE[part]·2^(−octave) with octaves −3..=0: at most 2¹⁵.
        let octaves = (exponent >> 3).min(0).unsigned_abs();
        let scale_shift = SCALE_ONE.wrapping_sub(exponent);
        GroupStep { value: self.value(group), scale_shift, mean_factor: part.wrapping_shl(octaves) }
    }
}

impl GroupStep {
    /// A mean in 1/[`MEAN_PARTS`] of a base step as eighths of the step, `(mean·T + 2¹⁴) >> 15`, T = 4096·2^(−q/8), and half
    /// a step more, as the tables want it.
    #[inline(always)]
    pub(crate) fn raised_mean(&self, mean: i16) -> i32 {
        // An i16 times at most 2¹⁵.
        i32::from(mean).wrapping_mul(self.mean_factor).wrapping_add(HALF_STEP) >> MEAN_SHIFT
    }

    /// What a symbol gives the anchors that follow its own, in 2⁻¹⁴: its value in 1/[`PARENT_UNITS`] of the group's base steps,
    /// limited to one; `(symbol·T' + half) >> shift` with T' = 4096·2^(q/8).
    #[inline]
    #[must_use]
    pub fn parent_input(&self, group: Group, symbol: i32) -> i16 {
        let [features, log_scales, _] = PARENT_UNITS;
        let units = if group == Group::Feature { features } else { log_scales };
        // −q: octaves −1 to 3.
        let exponent = self.scale_shift.wrapping_sub(SCALE_ONE);
        let part = INVERSE_PART_OF_OCTAVE.get((exponent & 7) as usize).copied().unwrap_or(4096);
        // 2¹² of the part, 2⁻¹⁴ of the input: at least 1.
        let shift = units.ilog2().cast_signed().wrapping_sub(2).wrapping_add(exponent >> 3).cast_unsigned();
        // An i16 times at most 2¹².
        let half = 1_i32.wrapping_shl(shift.wrapping_sub(1));
        let value = symbol.wrapping_mul(part).wrapping_add(half).wrapping_shr(shift);
        value.clamp(-(1 << 14), 1 << 14) as i16
    }

    /// The distribution of a symbol, from a [raised mean](Self::raised_mean) and a scale in eighths of an octave of a base step.
    #[inline(always)]
    pub(crate) fn model(&self, raised_mean: i32, scale: i16) -> NormalModel {
        NormalModel::from_shifted(raised_mean, i32::from(scale).wrapping_add(self.scale_shift))
    }
}

pub(super) fn check_base_steps(base_steps: [f32; N_GROUPS]) -> Result<[f32; N_GROUPS], DecodeError> {
    for (index, step) in (0..).zip(base_steps) {
        // With 16 bits of symbol and 1.83 on top, a value stays below 10¹⁸, so that no product of two overflows.
        if !(step.is_finite() && step > 1e-12 && step < 1e12) {
            return Err(DecodeError::BadFloat { field: Field::ContextStep, index });
        }
    }
    Ok(base_steps)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_eighths_of_octaves() {
        for q in -40..=20_i16 {
            let steps = Steps::new([1.0, 0.1, 0.2], [q; 3]);
            assert_eq!(Steps::from_bits([1.0, 0.1, 0.2], steps.to_bits()), steps, "q {q} comes back");
            let clamped = f64::from(q).clamp(-24.0, 7.0);
            let expected = 2f64.powf(clamped / 8.0);
            let found = f64::from(steps.value(Group::Feature));
            assert!((found / expected - 1.0).abs() < 1e-6, "q {q}: {found} against {expected}");
            for mean in [-32768, -640, -1, 0, 5, 64, 32767_i16] {
                let expected = f64::from(mean) / 64.0 / expected * 8.0;
                let step = steps.of(Group::Offset);
                let model = step.model(step.raised_mean(mean), 0);
                let near = |found: i32| (f64::from(found) - expected).abs() <= 0.5 + expected.abs() * 2e-4;
                let found = (expected.round() as i32 - 8..).take(16).find(|&found| {
                    near(found) && NormalModel::new(found, SCALE_ONE - i32::from(steps.exponents[2])) == model
                });
                assert!(found.is_some(), "q {q}, mean {mean}: {expected}");
            }
        }
    }

    #[test]
    fn what_a_parent_gives_is_its_value_in_units() {
        for q in MIN_STEP_EXPONENT..=MAX_STEP_EXPONENT {
            let steps = Steps::new([1.0; N_GROUPS], [q as i16; N_GROUPS]);
            for (group, units) in [(Group::Feature, 16.0), (Group::LogScale, 64.0)] {
                for symbol in [i16::MIN, -300, -17, -1, 0, 1, 5, 40, 1000, i16::MAX] {
                    let value = f64::from(symbol) * (f64::from(q) / 8.0).exp2() / units;
                    let expected = value.clamp(-1.0, 1.0) * 16384.0;
                    let found = f64::from(steps.of(group).parent_input(group, symbol.into()));
                    assert!((found - expected).abs() <= 0.51 + expected.abs() * 2e-4, "q {q}: {found}, not {expected}");
                }
            }
        }
    }
}
