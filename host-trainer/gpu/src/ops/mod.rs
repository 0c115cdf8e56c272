//! The operations of [`pocketsplat_kernels::ops`] as kernels.
//!
//! Gaussians, splats and footprints stand in slots: anchor by anchor of the view, offset by offset. A slot without a Gaussian has opacity
//! 0, one without a splat depth 0; so nothing has to be moved together, and the order is that of the CPU.

pub mod adam;
pub mod adaptive_step;
pub mod anchor_bits;
pub mod compact;
pub mod detail;
pub mod gather;
pub mod grid_bits;
pub mod hash_grid;
pub mod head;
pub mod head_input;
pub mod high_pass;
pub mod integer_network;
pub mod l1;
pub mod mask;
pub mod neural_gaussians;
mod noise;
pub mod normality;
pub mod opacity_target;
pub mod parents;
pub mod perturb;
pub mod prefilter;
pub mod project;
pub mod radix_sort;
pub mod rasterise;
pub mod sample;
pub mod scan;
pub mod sound;
pub mod ssim;
pub mod statistics;
pub mod sum;
pub mod target;
pub mod tiles;
pub mod volume;
pub mod written;
