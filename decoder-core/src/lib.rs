//! Decoder.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

mod camera;
mod error;

pub mod bundle;
pub mod entropy;
pub mod math;

pub use bundle::Bundle;
pub use camera::Camera;
pub use error::{DecodeError, ErrorClass, Field, SectionKind};
