//! The number formats that the heads are kept and multiplied in.

use super::weight::Weight;
use crate::arena::Arena;
use crate::bundle::{HeadView, WeightReader};
use crate::error::DecodeError;

/// Weights as f32.
#[derive(Clone, Copy, Debug)]
pub struct F32;
/// Weights as halves, which is what the file holds or nearly so; sums in f32.
#[derive(Clone, Copy, Debug)]
pub struct F16;
/// Weights, inputs and hidden units as 16-bit integers, sums of 32 bits; the detail head in f32.
#[derive(Clone, Copy, Debug)]
pub struct I16;

/// A format of the heads.
pub(crate) trait HeadFormat {
    /// What the detail head is kept in, whose second inputs, the colours, follow from the other heads.
    type Detail: Weight;
    /// What a layer reads.
    type Values<'v>: Copy;
    /// A head of B outputs an offset.
    type Head<'s, const B: usize>: MlpHead<'s, Self, B>;

    /// Puts the heads' inputs into this format, in their own memory.
    fn values(inputs: &mut [f32]) -> Self::Values<'_>;
}

/// A head: a hidden layer with ReLU, and an output layer of one block of B outputs an offset.
pub(crate) trait MlpHead<'s, N: HeadFormat + ?Sized, const B: usize>: Sized {
    /// Converts the file's weights; takes no more memory than [`HeadShape`](super::HeadShape) says of floats.
    fn convert(arena: &mut Arena<'s>, head: &HeadView<'_>, weights: &mut WeightReader<'_>)
    -> Result<Self, DecodeError>;

    /// Fills `hidden` with the hidden units and returns what the output layer reads of them.
    ///
    /// * `hidden`: [`hidden_len`](super::HeadShape::hidden_len) floats.
    fn activate<'h>(&self, inputs: N::Values<'_>, hidden: &'h mut [f32]) -> N::Values<'h>;

    /// Outputs of block `index`, before any activation; with one block per offset, those of an offset.
    fn block(&self, index: usize, hidden: N::Values<'_>) -> Option<[f32; B]>;
}
