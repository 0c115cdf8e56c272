//! A training step on a GPU, through Vulkan, Metal or Direct3D 12.
//!
//! [`adapters`] lists what there is, [`Gpu::open`] opens one. [`ops`] holds one file for each operation of [`pocketsplat_kernels::ops`], with its WGSL
//! beside it: a struct that compiles the kernels, and functions that add them to a list of [`Commands`] over [`Buffer`]s.
//!
//! The same adapter gives the same bits for the same input: no sum depends on the order in which threads run. Other adapters and the CPU
//! give others, within bounds that each kernel's test states.

mod adapter;
mod anchors;
mod buffer;
mod coding;
mod context;
mod error;
mod gpu;
mod group;
mod image;
mod kernel;
mod levels;
mod network_pass;
pub mod ops;
pub mod parity;
mod scene;
mod step;

pub use adapter::{Adapter, AdapterKind, adapters, choose};
pub use buffer::{Asked, Bind, Buffer};
pub use error::GpuError;
pub use gpu::Gpu;
pub use kernel::{Commands, Kernel};
pub use step::GpuStep;

/// Threads of a workgroup: 16×16 pixels, and what every adapter takes.
pub const GROUP_THREADS: usize = 256;

/// Buffers of one kernel, which every adapter takes.
pub const MAX_BINDINGS: usize = 8;

/// Bytes of a kernel's parameters, which every native driver takes.
pub const MAX_PARAMETER_BYTES: usize = 128;

/// Program text that kernels share.
const RECORDS: &str = include_str!("records.wgsl");
const MATH: &str = include_str!("math.wgsl");
const GROUPS: &str = include_str!("groups.wgsl");
