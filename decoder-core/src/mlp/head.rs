//! A head: hidden layer with ReLU, output layer of one block per offset.

use super::block::{Blocks, outputs};
use super::detail::Detail;
use super::shape::HeadShape;
use crate::budget::Arena;
use crate::bundle::{HeadView, HeadsView, WeightReader};
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
    pub(crate) shape: HeadShape,
    pub(crate) opacity: Head<'s, 1>,
    pub(crate) covariance: Head<'s, 7>,
    pub(crate) colour: Head<'s, 3>,
    pub(crate) detail: Option<Detail<'s>>,
}

impl<'s> Heads<'s> {
    /// Converts the file's weights; takes [`n_weights`](super::HeadShape::n_weights) floats.
    pub(crate) fn convert(arena: &mut Arena<'s>, heads: &HeadsView<'_>, shape: HeadShape) -> Result<Self, DecodeError> {
        let mut weights = heads.weights();
        // In the order of the file.
        Ok(Self {
            shape,
            opacity: Head::convert(arena, &heads.opacity, &mut weights)?,
            covariance: Head::convert(arena, &heads.covariance, &mut weights)?,
            colour: Head::convert(arena, &heads.colour, &mut weights)?,
            detail: match &heads.detail {
                Some(head) if cfg!(feature = "detail") && shape.detail > 0 => {
                    Some(Detail::convert(arena, head, &mut weights)?)
                }
                _ => None,
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
    /// * `hidden`: [`hidden_len`](super::HeadShape::hidden_len) floats.
    pub(crate) fn activate<'h>(&self, inputs: &[f32], hidden: &'h mut [f32]) -> &'h [f32] {
        // Not zipped: blocks are of a length that the compiler does not know, and their number would be a division, which
        // it may take for one by zero.
        let mut blocks = self.hidden.iter();
        for units in hidden.as_chunks_mut::<LANES>().0 {
            let Some(block) = blocks.next() else { break };
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
