//! A dense layer cut into blocks of outputs.

use pocketsplat_format::DecodeError;
use pocketsplat_format::bundle::{Halves, LayerWeights};

use super::weight::{self, Half, LANES};
use crate::arena::Arena;

/// How the weights of the heads are kept in scratch memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum HeadWeights {
    /// 32 bits each.
    F32,
    /// 16 bits each.
    F16,
}

/// A dense layer: `[n_blocks, 1 + n_in, B]`, each block beginning with its biases.
#[derive(Clone, Copy)]
pub(crate) struct Blocks<'s, const B: usize> {
    rows_per_block: usize,
    rows: Rows<'s, B>,
}

/// Rows of weights.
#[derive(Clone, Copy)]
enum Rows<'s, const B: usize> {
    F32(&'s [[f32; B]]),
    F16(&'s [[Half; B]]),
}

/// Rows of `B` weights that a layer of `n_in` inputs and `n_out` outputs fills.
pub(crate) const fn n_rows<const B: usize>(n_in: usize, n_out: usize) -> usize {
    n_out.div_ceil(B) * (n_in + 1)
}

impl<'s, const B: usize> Blocks<'s, B> {
    /// Converts a layer's weights `[n_out, n_in]` and biases `[n_out]`; outputs beyond `n_out` become 0.
    pub(crate) fn convert(
        arena: &mut Arena<'s>,
        kept_as: HeadWeights,
        weights: LayerWeights<'_, '_>,
        biases: &Halves<'_>,
        n_in: usize,
    ) -> Result<Self, DecodeError> {
        // Not taken as rows: those of an odd number of halves do not divide into words.
        let rows = match filled(arena, kept_as, weights, biases, n_in, B)? {
            Values::F32(values) => Rows::F32(values.as_chunks::<B>().0),
            Values::F16(values) => Rows::F16(values.as_chunks::<B>().0),
        };
        Ok(Self { rows_per_block: n_in + 1, rows })
    }

    /// Whether two anchors at a time cost less than one after the other.
    pub(crate) fn takes_two(&self) -> bool {
        matches!(self.rows, Rows::F16(_))
    }

    /// Blocks of floats in order; none of halves.
    pub(crate) fn floats(&self) -> impl Iterator<Item = &'s [[f32; B]]> + use<'s, B> {
        let rows = match self.rows {
            Rows::F32(rows) => rows,
            Rows::F16(_) => &[],
        };
        rows.chunks_exact(self.rows_per_block.max(1))
    }

    /// Blocks of halves in order; none of floats.
    pub(crate) fn halves(&self) -> impl Iterator<Item = &'s [[Half; B]]> + use<'s, B> {
        let rows = match self.rows {
            Rows::F32(_) => &[],
            Rows::F16(rows) => rows,
        };
        rows.chunks_exact(self.rows_per_block.max(1))
    }

    /// The outputs of block number `index`.
    #[inline(always)]
    pub(crate) fn outputs(&self, index: usize, inputs: &[f32]) -> Option<[f32; B]> {
        match self.rows {
            Rows::F32(rows) => {
                block(rows, index, self.rows_per_block).map(|block| pocketsplat_half::outputs(block, inputs))
            }
            Rows::F16(rows) => outputs_of_halves(rows, index, self.rows_per_block, inputs),
        }
    }
}

impl Blocks<'_, LANES> {
    /// Fills `units` with the outputs, those below 0 with 0; nothing is done with blocks of halves.
    pub(super) fn rectify(&self, inputs: &[f32], units: &mut [f32]) {
        if let Rows::F32(rows) = self.rows {
            pocketsplat_half::rectified_units(rows, self.rows_per_block, inputs, units.as_chunks_mut().0);
        }
    }
}

// Not inlined: only floats are worth the text that a block takes at each of its callers.
#[inline(never)]
fn outputs_of_halves<const B: usize>(
    rows: &[[Half; B]],
    index: usize,
    rows_per_block: usize,
    inputs: &[f32],
) -> Option<[f32; B]> {
    block(rows, index, rows_per_block).map(|block| weight::outputs(block, inputs))
}

/// Block number `index`.
fn block<W>(rows: &[W], index: usize, rows_per_block: usize) -> Option<&[W]> {
    let (_, from) = rows.split_at_checked(index * rows_per_block)?;
    from.get(..rows_per_block)
}

/// Memory of weights.
enum Values<'v> {
    F32(&'v mut [f32]),
    F16(&'v mut [Half]),
}

/// The blocks of a layer, each `[1 + n_in, lanes]`, in memory of `arena`.
// Not inlined: one of it serves blocks of all widths.
#[inline(never)]
fn filled<'s>(
    arena: &mut Arena<'s>,
    kept_as: HeadWeights,
    mut weights: LayerWeights<'_, '_>,
    biases: &Halves<'_>,
    n_in: usize,
    lanes: usize,
) -> Result<Values<'s>, DecodeError> {
    let rows_per_block = n_in + 1;
    let n = biases.len().next_multiple_of(lanes.max(1)) * rows_per_block;
    let mut values = match kept_as {
        HeadWeights::F32 => Values::F32(arena.take(n)?),
        HeadWeights::F16 => Values::F16(arena.take(n)?),
    };
    match &mut values {
        Values::F32(values) => values.fill(0.0),
        Values::F16(values) => values.fill(bytemuck::Zeroable::zeroed()),
    }
    // `max(1)` shows the compiler what is true anyway, and a panic path less is linked.
    let lanes = lanes.max(1);
    for (output, bias) in biases.iter().enumerate() {
        let first = output / lanes * rows_per_block * lanes + output % lanes;
        let row = core::iter::once(bias).chain(weights.by_ref().take(rows_per_block.saturating_sub(1)));
        for (place, weight) in (first..).step_by(lanes).zip(row) {
            match &mut values {
                Values::F32(values) => values.get_mut(place).into_iter().for_each(|slot| *slot = weight),
                Values::F16(values) => values.get_mut(place).into_iter().for_each(|slot| *slot = Half::of(weight)),
            }
        }
    }
    Ok(values)
}

/// `sums` with `input·weight` added in order.
#[inline]
pub(crate) fn continued<const B: usize>(mut sums: [f32; B], weights: &[[f32; B]], inputs: &[f32]) -> [f32; B] {
    for (row, &x) in weights.iter().zip(inputs) {
        for (sum, weight) in sums.iter_mut().zip(row) {
            *sum += weight * x;
        }
    }
    sums
}
