#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

// Each module imports only modules before it in this list: error · rules · math · stopwatch · camera · bytes · entropy · context · bundle.
// `tests/tests/rooms.rs` holds the crate to it.
pub mod bundle;
mod bytes;
mod camera;
pub mod context;
pub mod entropy;
mod error;
pub mod math;
pub mod rules;
mod stopwatch;

pub use bundle::Bundle;
pub use camera::{Camera, Rotation};
pub use error::{DecodeError, ErrorClass, Field, Region, SectionKind, in_range, saturate};
pub use stopwatch::{Stage, Stopwatch};
