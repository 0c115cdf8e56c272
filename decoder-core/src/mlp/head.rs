//! A head in floats: hidden layer with ReLU, output layer of one block per offset.

use super::block::{Blocks, outputs};
use super::format::{F16, F32, HeadFormat, MlpHead};
use super::shape::LANES;
use super::weight::{Half, Weight};
use crate::arena::Arena;
use crate::bundle::{HeadView, WeightReader};
use crate::error::DecodeError;

/// One head in floats; its output layer has blocks of `B` outputs.
pub(crate) struct Head<'s, W, const B: usize> {
    pub(super) hidden: Hidden<'s, W>,
    output: Blocks<'s, W, B>,
}

/// The hidden layer of a head.
pub(super) struct Hidden<'s, W> {
    pub(super) blocks: Blocks<'s, W, LANES>,
    pub(super) n_units: usize,
}

/// Floats read floats.
macro_rules! floats {
    ($($name:ty => $weight:ty),*) => {$(
        impl HeadFormat for $name {
            type Detail = $weight;
            type Values<'v> = &'v [f32];
            type Head<'s, const B: usize> = Head<'s, $weight, B>;

            #[inline(always)]
            fn values(inputs: &mut [f32]) -> &[f32] {
                inputs
            }
        }
    )*};
}

floats!(F32 => f32, F16 => Half);

impl<'s, N, W, const B: usize> MlpHead<'s, N, B> for Head<'s, W, B>
where
    N: for<'v> HeadFormat<Values<'v> = &'v [f32]>,
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
        self.hidden.activate(inputs, hidden)
    }

    fn block(&self, index: usize, hidden: &[f32]) -> Option<[f32; B]> {
        self.outputs(index, hidden)
    }
}

impl<W: Weight> Hidden<'_, W> {
    // Not inlined: one of it serves all heads.
    #[inline(never)]
    fn activate<'h>(&self, inputs: &[f32], units: &'h mut [f32]) -> &'h [f32] {
        // Not zipped: blocks are of a length that the compiler does not know, and their number would be a division, which
        // it may take for one by zero.
        let mut blocks = self.blocks.iter();
        for units in units.as_chunks_mut::<LANES>().0 {
            let Some(block) = blocks.next() else { break };
            for (unit, sum) in units.iter_mut().zip(outputs(block, inputs)) {
                *unit = if sum > 0.0 { sum } else { 0.0 };
            }
        }
        units.get(..self.n_units).unwrap_or_default()
    }
}

impl<'s, W: Weight, const B: usize> Head<'s, W, B> {
    pub(super) fn converted(
        arena: &mut Arena<'s>,
        head: &HeadView<'_>,
        weights: &mut WeightReader<'_>,
    ) -> Result<Self, DecodeError> {
        Ok(Self {
            hidden: Hidden {
                blocks: Blocks::convert(arena, weights.next_layer(), &head.b1, head.n_in)?,
                n_units: head.n_hidden,
            },
            output: Blocks::convert(arena, weights.next_layer(), &head.b2, head.n_hidden)?,
        })
    }

    /// Outputs of block `index`, before any activation.
    pub(super) fn outputs(&self, index: usize, hidden: &[f32]) -> Option<[f32; B]> {
        self.output.block(index).map(|block| outputs(block, hidden))
    }
}
