//! The transcendental functions of both ends: branch-free f32, bit-identical on every target.
//!
//! Device, trainer and tests call the same functions. They contain no call to `std` or to the platform's maths
//! library, and Rust never fuses a multiplication and an addition on its own, so the results are the same bits
//! everywhere. Every function but [`sin_cos`] is straight-line code: a loop over it vectorises on a PC.

mod activation;
mod angle;
mod exp;

pub use activation::{sigmoid, tanh};
pub use angle::sin_cos;
pub use exp::{EXP_MAX, EXP_MIN, EXPONENTIAL, exp};
pub use pocketsplat_half::{from_half, is_finite_half, to_half};
