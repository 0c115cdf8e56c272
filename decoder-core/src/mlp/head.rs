//! A head: hidden layer with ReLU, output layer of one block per offset.

use super::block::{Blocks, n_rows, outputs};
use crate::budget::Arena;
use crate::bundle::{HeadView, Header, HeadsView, WeightReader};
use crate::error::DecodeError;

/// Outputs computed together in layers whose outputs are all needed.
const LANES: usize = 8;

/// One head; its output layer has blocks of `B` outputs.
pub(crate) struct Head<'s, const B: usize> {
    hidden: Blocks<'s, LANES>,
    output: Blocks<'s, B>,
    n_hidden: usize,
}

/// The three heads, one block of outputs an offset: none is computed for an offset that is not drawn.
pub(crate) struct Heads<'s> {
    pub(crate) opacity: Head<'s, 1>,
    pub(crate) covariance: Head<'s, 7>,
    pub(crate) colour: Head<'s, 3>,
}

/// Floats of all three heads in scratch memory.
pub(crate) fn n_weights(header: &Header) -> usize {
    let [n_in, f, k] = [header.head_inputs(), header.feature_dim.into(), header.n_offsets.into()];
    3 * LANES * n_rows::<LANES>(n_in, f) + n_rows::<1>(f, k) + 7 * n_rows::<7>(f, 7 * k) + 3 * n_rows::<3>(f, 3 * k)
}

/// Floats of the hidden layer's activations.
pub(crate) fn hidden_len(header: &Header) -> usize {
    usize::from(header.feature_dim).next_multiple_of(LANES)
}

impl<'s> Heads<'s> {
    /// Converts the file's weights; takes [`n_weights`] floats.
    pub(crate) fn convert(arena: &mut Arena<'s>, heads: &HeadsView<'_>) -> Result<Self, DecodeError> {
        let mut weights = heads.weights();
        // In the order of the file.
        Ok(Self {
            opacity: Head::convert(arena, &heads.opacity, &mut weights)?,
            covariance: Head::convert(arena, &heads.covariance, &mut weights)?,
            colour: Head::convert(arena, &heads.colour, &mut weights)?,
        })
    }
}

impl<'s, const B: usize> Head<'s, B> {
    fn convert(
        arena: &mut Arena<'s>,
        head: &HeadView<'_>,
        weights: &mut WeightReader<'_>,
    ) -> Result<Self, DecodeError> {
        Ok(Self {
            hidden: Blocks::convert(arena, weights.next_layer(), &head.b1, head.n_in)?,
            output: Blocks::convert(arena, weights.next_layer(), &head.b2, head.n_hidden)?,
            n_hidden: head.n_hidden,
        })
    }

    /// Fills `hidden` with `relu(W1·inputs + b1)` and returns the part of it that the output layer reads.
    ///
    /// * `hidden`: [`hidden_len`] floats.
    pub(crate) fn activate<'h>(&self, inputs: &[f32], hidden: &'h mut [f32]) -> &'h [f32] {
        for (units, block) in hidden.chunks_exact_mut(LANES).zip(self.hidden.iter()) {
            for (unit, sum) in units.iter_mut().zip(outputs(block, inputs)) {
                *unit = if sum > 0.0 { sum } else { 0.0 };
            }
        }
        hidden.get(..self.n_hidden).unwrap_or_default()
    }

    /// Outputs of block `index`, before any activation; with one block per offset, those of an offset.
    pub(crate) fn block(&self, index: usize, hidden: &[f32]) -> Option<[f32; B]> {
        self.output.block(index).map(|block| outputs(block, hidden))
    }
}
