//! The operations of [`pocketsplat_kernels::ops`] as kernels, each in the folder of its twin on the CPU.
//!
//! [`primitives`] is what a CPU does in a plain loop, and a GPU does not: sums, scans, sorts, lists of marked items.
//!
//! Gaussians, splats and footprints stand in slots: anchor by anchor of the view, offset by offset. A slot without a Gaussian has opacity
//! 0, one without a splat depth 0; so nothing has to be moved together, and the order is that of the CPU.

pub mod adam;
pub mod heads;
pub mod image;
pub mod loss;
pub mod primitives;
pub mod rate;
pub mod sound;
