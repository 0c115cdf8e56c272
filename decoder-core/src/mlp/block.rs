//! A dense layer cut into blocks of outputs.

use crate::arena::Arena;
use crate::bundle::{Halves, LayerWeights};
use crate::error::DecodeError;
use crate::mlp::weight::Weight;

/// A dense layer: `[n_blocks, 1 + n_in, B]`, each block beginning with its biases.
pub(crate) struct Blocks<'s, W, const B: usize> {
    rows_per_block: usize,
    rows: &'s [[W; B]],
}

/// Rows of `B` weights that a layer of `n_in` inputs and `n_out` outputs fills.
pub(crate) const fn n_rows<const B: usize>(n_in: usize, n_out: usize) -> usize {
    n_out.div_ceil(B) * (n_in + 1)
}

impl<'s, W: Weight, const B: usize> Blocks<'s, W, B> {
    /// Converts a layer's weights `[n_out, n_in]` and biases `[n_out]`; outputs beyond `n_out` become 0.
    pub(crate) fn convert(
        arena: &mut Arena<'s>,
        weights: LayerWeights<'_, '_>,
        biases: &Halves<'_>,
        n_in: usize,
    ) -> Result<Self, DecodeError> {
        // Not as rows: those of an odd number of halves do not divide into words.
        let values = arena.take::<W>(B * n_rows::<B>(n_in, biases.len()))?;
        fill(values, weights, biases, n_in + 1, B);
        let (rows, _) = values.as_chunks::<B>();
        Ok(Self { rows_per_block: n_in + 1, rows })
    }

    /// All blocks in order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &'s [[W; B]]> + use<'s, W, B> {
        self.rows.chunks_exact(self.rows_per_block.max(1))
    }

    /// Block number `index`.
    pub(crate) fn block(&self, index: usize) -> Option<&'s [[W; B]]> {
        let (_, from) = self.rows.split_at_checked(index * self.rows_per_block)?;
        from.get(..self.rows_per_block)
    }
}

/// Fills the blocks of a layer, each `[rows_per_block, lanes]`.
// Not inlined: one of it serves blocks of all widths.
#[inline(never)]
fn fill<W: Weight>(
    values: &mut [W],
    mut weights: LayerWeights<'_, '_>,
    biases: &Halves<'_>,
    rows_per_block: usize,
    lanes: usize,
) {
    values.fill(W::zeroed());
    // `max(1)` shows the compiler what is true anyway, and a panic path less is linked.
    let lanes = lanes.max(1);
    for (output, bias) in biases.iter().enumerate() {
        let Some(block) = values.chunks_exact_mut((rows_per_block * lanes).max(1)).nth(output / lanes) else { break };
        let lane = block.get_mut(output % lanes..).unwrap_or_default();
        for (slot, weight) in lane.iter_mut().step_by(lanes).zip(core::iter::once(bias).chain(weights.by_ref())) {
            *slot = W::keep(weight);
        }
    }
}

/// The outputs of one block: bias, then `input·weight` added in order.
#[inline]
pub(crate) fn outputs<W: Weight, const B: usize>(block: &[[W; B]], inputs: &[f32]) -> [f32; B] {
    let Some((biases, weights)) = block.split_first() else { return [0.0; B] };
    continued(biases.map(W::value), weights, inputs)
}

/// `sums` with `input·weight` added in order.
#[inline]
pub(crate) fn continued<W: Weight, const B: usize>(mut sums: [f32; B], weights: &[[W; B]], inputs: &[f32]) -> [f32; B] {
    for (row, &x) in weights.iter().zip(inputs) {
        for (sum, &weight) in sums.iter_mut().zip(row) {
            *sum = weight.added(*sum, x);
        }
    }
    sums
}
