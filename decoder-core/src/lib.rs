#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

#[cfg(all(target_arch = "x86", not(target_feature = "sse2")))]
compile_error!(
    "pocketsplat-core does not draw the same pixels on x87, whose registers round to 64 bits of fraction: build for a \
     target with SSE2, such as i686"
);

// Each module imports only modules before it in this list: error · rules · math · stopwatch · camera · bytes · arena · entropy ·
// context · bundle · mlp · scene · project · raster · arithmetic · bake · budget · decoder · display. `tests/tests/rooms.rs` holds the crate to it.
mod arena;
mod arithmetic;
mod bake;
pub mod budget;
pub mod bundle;
mod bytes;
mod camera;
pub mod context;
mod decoder;
#[cfg(feature = "embedded-graphics")]
pub mod display;
pub mod entropy;
mod error;
pub mod math;
mod mlp;
mod project;
mod raster;
pub mod rules;
mod scene;
mod stopwatch;

pub use arithmetic::{Arithmetic, ReferenceArithmetic, WithoutFpu};
pub use budget::{
    Budget, HeadWeights, MaxSplats, Overflow, Part, PartMemory, Plan, Quality, Residency, Resident, ScratchShape,
    Strips, Work,
};
pub use bundle::Bundle;
pub use camera::{Camera, Rotation};
pub use decoder::{
    ByteOrder, Decoder, Drawing, FrameReport, PixelFormat, Rounding, Scratch, Tile, TileRow, TileSink, count_gaussians,
    count_scratch_len,
};
pub use error::{DecodeError, ErrorClass, Field, Region, RenderError, SectionKind};
pub use project::chunks_in_view;
pub use stopwatch::{Stage, Stopwatch};
