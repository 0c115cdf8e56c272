//! A head: hidden layer with ReLU, output layer of one block per offset.

use super::bank::Bank;
use super::block::{Blocks, outputs};
use super::detail::Detail;
use super::numbers::{HeadNumbers, TwoLayers};
use super::shape::HeadShape;
use super::weight::Weight;
use crate::budget::Arena;
use crate::bundle::{HeadView, HeadsView, WeightReader};
use crate::error::DecodeError;

/// Outputs computed together in layers whose outputs are all needed.
pub(super) const LANES: usize = 8;

/// One head in floats; its output layer has blocks of `B` outputs.
pub(crate) struct Head<'s, W, const B: usize> {
    pub(super) hidden: Blocks<'s, W, LANES>,
    output: Blocks<'s, W, B>,
    pub(super) n_hidden: usize,
}

/// The heads, one block of outputs an offset: none is computed for an offset that is not drawn.
pub(crate) struct Heads<'s, N: HeadNumbers> {
    pub(crate) shape: HeadShape,
    pub(crate) opacity: N::Head<'s, 1>,
    pub(crate) covariance: N::Head<'s, 7>,
    pub(crate) colour: N::Head<'s, 3>,
    pub(crate) detail: Option<Detail<'s, N::Detail>>,
    pub(crate) bank: Option<Bank<'s>>,
}

impl<'s, N: HeadNumbers> Heads<'s, N> {
    /// Converts the file's weights; takes [`n_weights`](super::HeadShape::n_weights) floats.
    pub(crate) fn convert(arena: &mut Arena<'s>, heads: &HeadsView<'_>, shape: HeadShape) -> Result<Self, DecodeError> {
        let mut weights = heads.weights();
        // In the order of the file.
        Ok(Self {
            shape,
            opacity: N::Head::convert(arena, &heads.opacity, &mut weights)?,
            covariance: N::Head::convert(arena, &heads.covariance, &mut weights)?,
            colour: N::Head::convert(arena, &heads.colour, &mut weights)?,
            detail: match &heads.detail {
                Some(head) if cfg!(feature = "detail") && shape.detail > 0 => {
                    Some(Detail::convert(arena, head, &mut weights)?)
                }
                // Left out of the plan, and before the next in the file.
                Some(_) if cfg!(feature = "feature-bank") => {
                    weights.next_layer().for_each(drop);
                    weights.next_layer().for_each(drop);
                    None
                }
                _ => None,
            },
            bank: match &heads.bank {
                Some(head) if cfg!(feature = "feature-bank") => Some(Bank::convert(arena, head, &mut weights)?),
                _ => None,
            },
        })
    }
}

impl<'s, N, W, const B: usize> TwoLayers<'s, N, B> for Head<'s, W, B>
where
    N: for<'v> HeadNumbers<Values<'v> = &'v [f32]>,
    W: Weight,
{
    fn convert(
        arena: &mut Arena<'s>,
        head: &HeadView<'_>,
        weights: &mut WeightReader<'_>,
    ) -> Result<Self, DecodeError> {
        Self::converted(arena, head, weights)
    }

    fn activate<'h>(&self, inputs: &[f32], hidden: &'h mut [f32]) -> &'h [f32] {
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

    fn block(&self, index: usize, hidden: &[f32]) -> Option<[f32; B]> {
        self.outputs(index, hidden)
    }
}

impl<'s, W: Weight, const B: usize> Head<'s, W, B> {
    pub(super) fn converted(
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

    /// Outputs of block `index`, before any activation.
    pub(super) fn outputs(&self, index: usize, hidden: &[f32]) -> Option<[f32; B]> {
        self.output.block(index).map(|block| outputs(block, hidden))
    }
}
