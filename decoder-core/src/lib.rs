#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

mod arena;
mod bytes;
mod camera;
mod error;

pub mod arithmetic;
mod bake;
pub mod budget;
pub mod bundle;
pub mod context;
mod decoder;
#[cfg(feature = "embedded-graphics")]
pub mod display;
pub mod entropy;
pub mod math;
mod mlp;
mod project;
mod raster;
mod scene;
mod stopwatch;

pub use budget::{Budget, MaxSplats, Overflow, Plan, Quality, Residency, Resident, ScratchShape, Strips, Work};
pub use bundle::Bundle;
pub use camera::Camera;
pub use decoder::{Decoder, FrameReport, TileSink, count_gaussians, count_scratch_len};
pub use error::{DecodeError, ErrorClass, Field, SectionKind};
pub use project::chunks_in_view;
pub use stopwatch::{Stage, Stopwatch};
