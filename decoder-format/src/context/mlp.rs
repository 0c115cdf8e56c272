//! Dense layers in integers.

use super::grid::FEATURES_PER_LEVEL;
use crate::error::{DecodeError, Field};

/// Most hidden units: with it, and biases of at most [`MAX_BIAS`], no sum passes 2³¹ whatever the weights are.
pub const MAX_CONTEXT_HIDDEN: u16 = 256;
/// Most grid levels, hence 128 inputs of it.
pub const MAX_CONTEXT_LEVELS: u8 = 32;
/// Most inputs.
pub const MAX_CONTEXT_INPUTS: usize = 272;
/// Largest magnitude of a bias: inputs and hidden units are at most 2¹⁵, so 272·2⁷·2¹⁵ and 256·2⁷·2¹⁵ are left.
pub const MAX_BIAS: u32 = 1 << 29;
/// Largest shift of a sum.
const MAX_SHIFT: u8 = 31;

const _: () = assert!(MAX_CONTEXT_LEVELS as usize * FEATURES_PER_LEVEL <= MAX_CONTEXT_INPUTS);
const _: () = assert!(((MAX_CONTEXT_INPUTS as u64) << 22) + (MAX_BIAS as u64) < 1 << 31);
const _: () = assert!(MAX_CONTEXT_HIDDEN as usize <= MAX_CONTEXT_INPUTS);

/// One dense layer `(W·x + b) >> shift`, weights i8 and row-major.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layer<'a> {
    /// `[n_out, n_in]`.
    weights: &'a [u8],
    /// `[n_out]`.
    biases: &'a [[u8; 4]],
    /// `[n_out]`.
    shifts: &'a [u8],
}

/// What one output of a layer is made with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row<'a> {
    weights: &'a [u8],
    bias: [u8; 4],
    shift: u8,
}

impl Row<'_> {
    /// `Σ weights·inputs + bias`.
    ///
    /// # Budget
    /// n_in multiply-adds, about 4 instructions each on a Cortex-M4.
    #[inline(always)]
    fn output(&self, inputs: &[i16]) -> i32 {
        // Order does not matter: integers add up the same in any, and no sum overflows.
        self.weights.iter().zip(inputs).fold(i32::from_le_bytes(self.bias), |sum, (&weight, &input)| {
            sum.wrapping_add(i32::from(weight as i8).wrapping_mul(i32::from(input)))
        })
    }
}

/// The outputs of two rows, limited to i16.
#[inline(always)]
fn outputs([a, b]: [Row<'_>; 2], inputs: &[i16]) -> [i16; 2] {
    let biases = [a.bias, b.bias].map(i32::from_le_bytes);
    let [sum_a, sum_b] = pocketsplat_half::add_products_of_two_rows(biases, [a.weights, b.weights], inputs);
    [limited(sum_a, a.shift), limited(sum_b, b.shift)]
}

/// `sum >> shift`, limited to i16.
#[inline(always)]
fn limited(sum: i32, shift: u8) -> i16 {
    sum.wrapping_shr(shift.into()).clamp(i16::MIN.into(), i16::MAX.into()) as i16
}

impl<'a> Layer<'a> {
    /// Bytes of a network: shifts, biases and weights of both layers.
    pub(super) const fn pair_len(n_inputs: usize, n_hidden: usize, n_outputs: usize) -> usize {
        // A shift, four bytes of bias and the weights for each row.
        // With at most 256 hidden units, 719 outputs and 272 inputs nothing overflows.
        let [hidden, output] = [n_inputs.wrapping_add(5), n_hidden.wrapping_add(5)];
        n_hidden.wrapping_mul(hidden).wrapping_add(n_outputs.wrapping_mul(output))
    }

    /// The hidden and the output layer of a network at the front of `bytes`, not yet checked, and what follows it.
    pub(super) fn pair(bytes: &'a [u8], n_inputs: usize, n_hidden: usize, n_outputs: usize) -> ([Self; 2], &'a [u8]) {
        let mut rest = bytes;
        let mut next = |n: usize| {
            let (part, after) = rest.split_at_checked(n).unwrap_or_default();
            rest = after;
            part
        };
        let [hidden_shifts, output_shifts] = [next(n_hidden), next(n_outputs)];
        let (hidden_biases, _) = next(n_hidden.wrapping_mul(4)).as_chunks();
        let (output_biases, _) = next(n_outputs.wrapping_mul(4)).as_chunks();
        let hidden_weights = next(n_inputs.wrapping_mul(n_hidden));
        let output_weights = next(n_hidden.wrapping_mul(n_outputs));
        let hidden = Layer { weights: hidden_weights, biases: hidden_biases, shifts: hidden_shifts };
        let output = Layer { weights: output_weights, biases: output_biases, shifts: output_shifts };
        ([hidden, output], rest)
    }

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
        Ok(())
    }

    /// The rows of `n_in` weights from `first` on.
    #[inline]
    fn rows(&self, first: usize, n_in: usize) -> impl Iterator<Item = Row<'a>> + use<'a> {
        let weights = self.weights.get(first.saturating_mul(n_in)..).unwrap_or_default();
        let biases = self.biases.get(first..).unwrap_or_default();
        let shifts = self.shifts.get(first..).unwrap_or_default();
        // `max(1)`: a chunk size of zero would panic; there is always an input.
        let rows = weights.chunks_exact(n_in.max(1)).zip(biases.iter().zip(shifts));
        rows.map(|(weights, (&bias, &shift))| Row { weights, bias, shift })
    }

    /// Output `index`, limited to i16.
    ///
    /// * `inputs`: `[n_in]`.
    pub(super) fn limited(&self, index: usize, inputs: &[i16]) -> i16 {
        self.rows(index, inputs.len()).next().map_or(0, |row| limited(row.output(inputs), row.shift))
    }

    /// The outputs from `first` on beside those from `second` on, limited to i16.
    ///
    /// * `inputs`: `[n_in]`.
    ///
    /// # Budget
    /// Per pair 2·n_in multiply-adds, about 1.8 instructions each on a Cortex-M4, and 30 instructions.
    // On its own it gets the registers that it needs.
    #[inline(never)]
    pub(super) fn pairs(&self, first: usize, second: usize, inputs: &[i16], pairs: &mut [[i16; 2]]) {
        for ((a, b), pair) in self.rows(first, inputs.len()).zip(self.rows(second, inputs.len())).zip(pairs) {
            *pair = outputs([a, b], inputs);
        }
    }

    /// All outputs, limited to 0..=32767: a rectified hidden layer.
    ///
    /// * `inputs`: at least `[n_in]`; levels have fewer inputs than there is room for.
    #[inline(always)]
    pub(super) fn rectified(&self, inputs: &[i16], outputs: &mut [i16]) {
        let n_in = self.weights.len().checked_div(self.biases.len()).unwrap_or_default();
        let mut rows = self.rows(0, n_in);
        for pair in outputs.chunks_mut(2) {
            let Some(first) = rows.next() else { break };
            // The last of an odd number is computed twice.
            let second = rows.next().unwrap_or(first);
            for (output, unit) in pair.iter_mut().zip(self::outputs([first, second], inputs)) {
                *output = unit.max(0);
            }
        }
    }
}
