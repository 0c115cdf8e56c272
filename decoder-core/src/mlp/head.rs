//! A head: hidden layer with ReLU, output layer of one block per offset.

use super::block::{Blocks, n_rows, outputs};
use super::detail::{self, Detail};
use crate::budget::Arena;
use crate::bundle::{HeadView, Header, HeadsView, WeightReader};
use crate::error::DecodeError;

/// Outputs computed together in layers whose outputs are all needed.
pub(super) const LANES: usize = 8;

/// One head; its output layer has blocks of `B` outputs.
pub(crate) struct Head<'s, const B: usize> {
    pub(super) hidden: Blocks<'s, LANES>,
    output: Blocks<'s, B>,
    pub(super) n_hidden: usize,
}

/// The heads, one block of outputs an offset: none is computed for an offset that is not drawn.
pub(crate) struct Heads<'s> {
    pub(crate) opacity: Head<'s, 1>,
    pub(crate) covariance: Head<'s, 7>,
    pub(crate) colour: Head<'s, 3>,
    pub(crate) detail: Option<Detail<'s>>,
}

/// Floats of all heads in scratch memory.
pub(crate) fn n_weights(header: &Header) -> usize {
    let [n_in, f, c, k] =
        [header.head_inputs(), header.feature_dim.into(), header.colour_hidden.into(), header.n_offsets.into()];
    let first_layers = LANES * (2 * n_rows::<LANES>(n_in, f) + n_rows::<LANES>(n_in, c));
    let outputs = n_rows::<1>(f, k) + 7 * n_rows::<7>(f, 7 * k) + 3 * n_rows::<3>(c, 3 * k);
    first_layers + outputs + detail::n_weights(header)
}

/// Floats of the widest hidden layer's activations.
pub(crate) fn hidden_len(header: &Header) -> usize {
    usize::from(header.feature_dim.max(header.colour_hidden).max(header.detail_hidden)).next_multiple_of(LANES)
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
            detail: match &heads.detail {
                Some(head) => Some(Detail::convert(arena, head, &mut weights)?),
                None => None,
            },
        })
    }
}

impl<'s, const B: usize> Head<'s, B> {
    pub(super) fn convert(
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
