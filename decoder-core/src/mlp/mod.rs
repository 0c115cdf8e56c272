//! The heads in the decoder's memory: weights in the order in which they are read, in the numbers that the arithmetic asks for.
//!
//! Sums of floats are ordered: bias first, then inputs ascending, one accumulator per output. Outputs are computed in blocks
//! of `B`, so that a block's accumulators stay in registers and one input serves them all; that changes no sum. The module
//! knows nothing of what inputs and outputs mean.

mod block;
mod detail;
mod format;
mod head;
mod heads;
mod integer;
mod pair;
mod shape;
mod sums;
mod weight;

pub use block::HeadWeights;
pub(crate) use format::{F32, HeadFormat, I16, MlpHead};
pub(crate) use heads::Heads;
pub(crate) use pair::Role;
pub(crate) use shape::HeadShape;
pub(crate) use sums::FeatureSums;
