//! Memory as a contract: limits in, an exact number of bytes out, the caller's bytes carved into typed slices.
//!
//! A [`Plan`] says how many bytes of scratch memory a decoder needs; with that many it draws, with one fewer
//! [`Decoder::bind`](crate::Decoder::bind) fails and names the number. Nothing is allocated later. [`ScratchShape`] gives
//! firmware the same number, or a bound on it, at compile time.
// Tests may index and add as they like; this is about sums that must not wrap.
#![cfg_attr(not(test), deny(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::panic))]

mod limits;
mod memory;
mod placement;
mod plan;
mod quality;
mod shape;
mod work;

pub use crate::mlp::HeadWeights;
pub use limits::{Budget, MaxSplats, Overflow, Residency, Strips};
pub(crate) use memory::{
    AnchorMemory, FrameMemory, ListMemory, ModelMemory, PainterMemory, ReaderMemory, SceneMemory, SumsMemory,
    TileMemory,
};
pub use placement::{Part, PartMemory};
pub(crate) use placement::{Placement, Regions};
pub use plan::Plan;
pub use quality::Quality;
pub use shape::{CoderShape, FrameShape, ModelShape, RecordShape, Resident, ScratchShape};
pub use work::Work;
