//! A dense layer cut into blocks of outputs.

use crate::budget::Arena;
use crate::bundle::Halves;
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
        mut weights: impl Iterator<Item = f32>,
        biases: &Halves<'_>,
        n_in: usize,
    ) -> Result<Self, DecodeError> {
        let n_out = biases.len();
        // Not as rows: those of an odd number of halves do not divide into words.
        let (rows, _) = arena.take::<W>(B * n_rows::<B>(n_in, n_out))?.as_chunks_mut::<B>();
        rows.fill([W::zeroed(); B]);
        let rows_per_block = n_in + 1;
        for (output, bias) in biases.iter().enumerate() {
            // `max(1)` shows the compiler what is true anyway, and a panic path less is linked.
            let Some(block) = rows.chunks_exact_mut(rows_per_block.max(1)).nth(output / B) else { break };
            let lane = output % B;
            for (row, weight) in block.iter_mut().zip(core::iter::once(bias).chain(weights.by_ref())) {
                if let Some(slot) = row.get_mut(lane) {
                    *slot = W::keep(weight);
                }
            }
        }
        Ok(Self { rows_per_block, rows })
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
