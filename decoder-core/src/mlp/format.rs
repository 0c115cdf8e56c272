//! The number formats that the heads are kept and multiplied in.

use pocketsplat_format::DecodeError;
use pocketsplat_format::bundle::{HeadView, WeightReader};

use super::block::HeadWeights;
use super::pair::Role;
use crate::arena::Arena;

/// Weights as f32; as halves where the [plan](crate::Plan::head_weights) says so, because there is no room for f32.
#[derive(Clone, Copy, Debug)]
pub(crate) struct F32;
/// Weights, inputs and hidden units as 16-bit integers, sums of 32 bits; the detail head in f32.
#[derive(Clone, Copy, Debug)]
pub(crate) struct I16;

/// A format of the heads.
pub(crate) trait HeadFormat: Copy {
    /// Whether hidden layers go on from sums over the feature.
    const READS_SUMS: bool;
    /// What a layer reads.
    type Values<'v>: Copy;
    /// A head of B outputs an offset; it reads its weights alone, so that several painters may have the same.
    type Head<'s, const B: usize>: MlpHead<'s, Self, B> + Copy + Send;

    /// Puts the heads' inputs into this format, in their own memory.
    fn values(inputs: &mut [f32]) -> Self::Values<'_>;

    /// Floats as they are, if layers read such.
    fn floats(inputs: &[f32]) -> Option<Self::Values<'_>>;
}

/// A head: a hidden layer with ReLU, and an output layer of one block of B outputs an offset.
pub(crate) trait MlpHead<'s, N: HeadFormat, const B: usize>: Sized {
    /// Converts the file's weights; takes no more memory than [`HeadShape`](super::HeadShape) says.
    ///
    /// * `free`: memory to work in, two rows of weights.
    fn convert(
        arena: &mut Arena<'s>,
        free: Arena<'_>,
        kept_as: HeadWeights,
        head: &HeadView<'_>,
        weights: &mut WeightReader<'_>,
    ) -> Result<Self, DecodeError>;

    /// Fills `sums` with `b₁ + W₁·feature`, whole blocks, if layers [go on](HeadFormat::READS_SUMS) from that.
    fn begin(&self, feature: &[f32], sums: &mut [f32]);

    /// Fills `hidden` with the hidden units, and returns what the output layer reads of them.
    ///
    /// * `hidden`: [`hidden_len`](super::HeadShape::hidden_len) floats. * `number`: of the head, for `role`.
    fn activate<'h>(
        &self,
        number: usize,
        inputs: N::Values<'_>,
        hidden: &'h mut [f32],
        role: &'h mut Role<'_>,
    ) -> N::Values<'h>;

    /// Outputs of block `index`, before any activation; with one block per offset, those of an offset.
    fn block(&self, index: usize, hidden: N::Values<'_>) -> Option<[f32; B]>;

    /// Whether two anchors at a time cost less than one after the other.
    fn takes_two(&self) -> bool {
        false
    }
}
