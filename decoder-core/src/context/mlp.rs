//! The integer network from grid features to means, scales and steps.

use super::grid::FEATURES_PER_LEVEL;
use crate::bundle::saturate;
use crate::error::{DecodeError, Field};

/// Most hidden units: with it, and biases of at most [`MAX_BIAS`], no sum passes 2³¹ whatever the weights are.
pub const MAX_CONTEXT_HIDDEN: u16 = 256;
/// Most grid levels, hence 128 inputs.
pub const MAX_CONTEXT_LEVELS: u8 = 32;
/// Largest magnitude of a bias: inputs are at most 2¹⁴ and hidden units below 2¹⁵, so 128·2⁷·2¹⁴ and 256·2⁷·2¹⁵ are left.
pub const MAX_BIAS: u32 = 1 << 29;
/// Largest shift of a sum.
const MAX_SHIFT: u8 = 31;

const _: () = assert!((MAX_CONTEXT_LEVELS as u64 * FEATURES_PER_LEVEL as u64) << 21 <= 1 << 30);
const _: () = assert!(((MAX_CONTEXT_HIDDEN as u64) << 22) + (MAX_BIAS as u64) < 1 << 31);

/// One dense layer `(W·x + b) >> shift`, weights i8 and row-major.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layer<'a> {
    /// `[n_out, n_in]`.
    pub(super) weights: &'a [u8],
    /// `[n_out]`.
    pub(super) biases: &'a [[u8; 4]],
    /// `[n_out]`.
    pub(super) shifts: &'a [u8],
    pub(super) n_in: usize,
}

/// What one output of a layer is made with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row<'a> {
    weights: &'a [u8],
    bias: [u8; 4],
    shift: u8,
}

impl Row<'_> {
    /// `(Σ weights·inputs + bias) >> shift`.
    ///
    /// # Budget
    /// n_in multiply-adds, about 3.3 instructions each on a Cortex-M4.
    #[inline(always)]
    pub(super) fn output(&self, inputs: &[i16]) -> i32 {
        // Order does not matter: integers add up the same in any, and no sum overflows.
        let sum = self.weights.iter().zip(inputs).fold(i32::from_le_bytes(self.bias), |sum, (&weight, &input)| {
            sum.wrapping_add(i32::from(weight as i8).wrapping_mul(i32::from(input)))
        });
        sum.wrapping_shr(self.shift.into())
    }
}

impl<'a> Layer<'a> {
    pub(super) fn check(&self) -> Result<(), DecodeError> {
        for &shift in self.shifts {
            if shift > MAX_SHIFT {
                let limit = MAX_SHIFT.into();
                return Err(DecodeError::OutOfRange { field: Field::ContextShift, found: shift.into(), limit });
            }
        }
        for &bias in self.biases {
            let found = i32::from_le_bytes(bias).unsigned_abs();
            if found > MAX_BIAS {
                return Err(DecodeError::OutOfRange { field: Field::ContextBias, found, limit: MAX_BIAS });
            }
        }
        if self.weights.len() != self.n_in.saturating_mul(self.biases.len()) {
            return Err(DecodeError::OutOfRange {
                field: Field::ContextHidden,
                found: saturate(self.weights.len()),
                limit: saturate(self.n_in),
            });
        }
        Ok(())
    }

    /// The rows from `first` on.
    #[inline]
    pub(super) fn rows(&self, first: usize) -> impl Iterator<Item = Row<'a>> + use<'a> {
        let weights = self.weights.get(first.saturating_mul(self.n_in)..).unwrap_or_default();
        let biases = self.biases.get(first..).unwrap_or_default();
        let shifts = self.shifts.get(first..).unwrap_or_default();
        // `max(1)`: a chunk size of zero would panic; there is always an input.
        let rows = weights.chunks_exact(self.n_in.max(1)).zip(biases.iter().zip(shifts));
        rows.map(|(weights, (&bias, &shift))| Row { weights, bias, shift })
    }

    /// The outputs from `first` on, limited to i16.
    // On its own it gets the registers that it needs.
    #[inline(never)]
    pub(super) fn limited(&self, first: usize, inputs: &[i16], outputs: &mut [i16]) {
        for (row, output) in self.rows(first).zip(outputs) {
            *output = row.output(inputs).clamp(i16::MIN.into(), i16::MAX.into()) as i16;
        }
    }

    /// All outputs, limited to 0..=32767: a rectified hidden layer.
    #[inline(always)]
    pub(super) fn rectified(&self, inputs: &[i16], outputs: &mut [i16]) {
        for (row, output) in self.rows(0).zip(outputs) {
            *output = row.output(inputs).clamp(0, i16::MAX.into()) as i16;
        }
    }
}
