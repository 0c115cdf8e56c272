//! A head: hidden layer with ReLU, output layer of one block per offset.

use super::block::{Blocks, outputs};
use super::detail::Detail;
use super::format::{HeadFormat, MlpHead};
use super::shape::{HeadShape, LANES};
use super::weight::Weight;
use crate::arena::Arena;
use crate::bundle::{HeadView, HeadsView, WeightReader};
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

/// The heads, one block of outputs an offset: none is computed for an offset that is not drawn.
pub(crate) struct Heads<'s, N: HeadFormat> {
    pub(crate) shape: HeadShape,
    pub(crate) opacity: N::Head<'s, 1>,
    pub(crate) covariance: Covariance<'s, N>,
    pub(crate) colour: N::Head<'s, 3>,
    pub(crate) detail: Option<Detail<'s, N::Detail>>,
}

/// The covariance head.
pub(crate) enum Covariance<'s, N: HeadFormat> {
    /// A scale logit an offset.
    Isotropic(N::Head<'s, 1>),
    /// Three, and a quaternion.
    Anisotropic(N::Head<'s, 7>),
}

impl<'s, N: HeadFormat> Covariance<'s, N> {
    /// As [`MlpHead::activate`].
    pub(crate) fn activate<'h>(&self, inputs: N::Values<'_>, hidden: &'h mut [f32]) -> N::Values<'h> {
        match self {
            Self::Isotropic(head) => head.activate(inputs, hidden),
            // Unreachable without the feature; this arm drops the code, here and below.
            Self::Anisotropic(_) if !cfg!(feature = "anisotropy") => N::values(hidden),
            Self::Anisotropic(head) => head.activate(inputs, hidden),
        }
    }

    /// As [`MlpHead::block`]; of an isotropic Gaussian the first output alone means something.
    pub(crate) fn block(&self, index: usize, hidden: N::Values<'_>) -> Option<[f32; 7]> {
        match self {
            Self::Isotropic(head) => head.block(index, hidden).map(|[logit]| [logit, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
            Self::Anisotropic(_) if !cfg!(feature = "anisotropy") => None,
            Self::Anisotropic(head) => head.block(index, hidden),
        }
    }
}

impl<'s, N: HeadFormat> Heads<'s, N> {
    /// Converts the file's weights; takes [`n_weights`](super::HeadShape::n_weights) floats.
    pub(crate) fn convert(arena: &mut Arena<'s>, heads: &HeadsView<'_>, shape: HeadShape) -> Result<Self, DecodeError> {
        let mut weights = heads.weights();
        // In the order of the file.
        Ok(Self {
            shape,
            opacity: N::Head::convert(arena, &heads.opacity, &mut weights)?,
            covariance: if cfg!(feature = "anisotropy") && shape.covariance > 1 {
                Covariance::Anisotropic(N::Head::convert(arena, &heads.covariance, &mut weights)?)
            } else {
                Covariance::Isotropic(N::Head::convert(arena, &heads.covariance, &mut weights)?)
            },
            colour: N::Head::convert(arena, &heads.colour, &mut weights)?,
            detail: match &heads.detail {
                Some(head) if cfg!(feature = "detail") && shape.detail > 0 => {
                    Some(Detail::convert(arena, head, &mut weights)?)
                }
                _ => None,
            },
        })
    }
}

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
