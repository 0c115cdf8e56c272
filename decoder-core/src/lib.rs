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

// Each module imports only modules before it in this list: arena · fixed · functions · mlp · scene · project · raster · arithmetic · bake · budget ·
// decoder · display. `tests/tests/rooms.rs` holds the crate to it, and counts the names below.
mod arena;
mod arithmetic;
mod bake;
mod budget;
mod decoder;
#[cfg(feature = "embedded-graphics")]
mod display;
mod fixed;
mod functions;
mod mlp;
mod project;
mod raster;
mod scene;

pub use arithmetic::{Arithmetic, ReferenceArithmetic, WithoutFpu};
pub use budget::{
    Budget, CoderShape, FrameShape, HeadWeights, MaxSplats, ModelShape, Overflow, Part, PartMemory, Plan, Quality,
    RecordShape, Residency, Resident, ScratchShape, Strips, Work,
};
pub use decoder::{
    ByteOrder, Decoder, Drawing, FrameReport, PixelFormat, RenderError, Rounding, Scratch, Tile, TileRow, TileSink,
    count_gaussians, count_scratch_len,
};
#[cfg(feature = "embedded-graphics")]
pub use display::DisplaySink;
pub use pocketsplat_format::{
    Bundle, Camera, DecodeError, ErrorClass, Field, Region, Rotation, SectionKind, Stage, Stopwatch,
};
pub use project::chunks_in_view;
