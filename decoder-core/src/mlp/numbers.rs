//! What the heads are kept and multiplied in.

use super::head::Head;
use super::integer::{IntegerHead, Pair8, Pair16, Quantised};
use super::weight::{Half, StrictHalf, Weight};
use crate::arena::Arena;
use crate::arithmetic::{F16, F32, I8, I16, StrictF16};
use crate::bundle::{HeadView, WeightReader};
use crate::error::DecodeError;

/// A format of the heads.
pub(crate) trait HeadNumbers {
    /// What the detail head is kept in, whose second inputs, the colours, follow from the other heads.
    type Detail: Weight;
    /// What a layer reads.
    type Values<'v>: Copy;
    /// A head of B outputs an offset.
    type Head<'s, const B: usize>: TwoLayers<'s, Self, B>;

    /// Puts the heads' inputs into this format, in their own memory.
    fn values(inputs: &mut [f32]) -> Self::Values<'_>;
}

/// A head: a hidden layer with ReLU, and an output layer of one block of B outputs an offset.
pub(crate) trait TwoLayers<'s, N: HeadNumbers + ?Sized, const B: usize>: Sized {
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
        impl HeadNumbers for $name {
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

/// Integers read integers; the detail head stays in floats.
macro_rules! integers {
    ($($name:ty => $pair:ty),*) => {$(
        impl HeadNumbers for $name {
            type Detail = f32;
            type Values<'v> = Quantised<'v>;
            type Head<'s, const B: usize> = IntegerHead<'s, $pair, B>;

            fn values(inputs: &mut [f32]) -> Quantised<'_> {
                Quantised::of(inputs)
            }
        }
    )*};
}

floats!(F32 => f32, F16 => Half, StrictF16 => StrictHalf);
integers!(I16 => Pair16, I8 => Pair8);
