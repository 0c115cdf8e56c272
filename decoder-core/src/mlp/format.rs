//! The number formats that the heads are kept and multiplied in.

use super::head::Head;
use super::integer::{IntegerHead, Quantised};
use super::weight::{Half, Weight};
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

/// Integers read integers; the detail head stays in floats.
impl HeadFormat for I16 {
    type Detail = f32;
    type Values<'v> = Quantised<'v>;
    type Head<'s, const B: usize> = IntegerHead<'s, B>;

    fn values(inputs: &mut [f32]) -> Quantised<'_> {
        Quantised::of(inputs)
    }
}
