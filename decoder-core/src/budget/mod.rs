//! Memory as a contract: limits in, an exact number of bytes out, the caller's bytes carved into typed slices.
//!
//! A [`Plan`] says how many bytes of scratch memory a decoder needs; with that many it draws, with one fewer
//! [`Decoder::bind`](crate::Decoder::bind) fails and names the number. Nothing is allocated later. [`ScratchShape`] gives
//! firmware the same number, or a bound on it, at compile time.
#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::panic)]

mod arena;
mod limits;
mod plan;
mod quality;
mod scratch;
mod work;

pub(crate) use arena::Arena;
pub use limits::{Budget, MAX_FRAME_PX, MAX_STRIPS, MaxSplats, Overflow, Residency, Strips};
pub use plan::Plan;
pub use quality::{MAX_ALPHA_CUT, MAX_TRANSMITTANCE_STOP, Quality};
pub use scratch::ScratchShape;
pub use work::Work;
