//! The differentiable operations of a training step, one file each: `forward`, `backward`, plain slices, no state.
//!
//! Order of a step: [`prefilter`] → [`head_input`] → [`head`] → [`neural_gaussians`] → [`project`] → [`tiles`] →
//! [`rasterise`] → [`l1`], [`ssim`], [`volume`] → the same backwards → [`adam`].
//!
//! With explicit Gaussians [`explicit_gaussians`] and [`spherical_harmonics`] stand in the place of the first four.
//!
//! Every operation is generic over [`Real`](crate::real::Real): the trainer runs it in f32, the tests compare its backward pass in f64
//! with central differences of its forward pass, and f32 with f64.

pub mod adam;
pub mod adaptive_step;
pub mod anchor_bits;
pub mod blur;
pub mod depth_order;
pub mod detail;
pub mod explicit_gaussians;
pub mod file_order;
pub mod grid_bits;
pub mod hash_grid;
pub mod head;
pub mod head_input;
pub mod high_pass;
pub mod l1;
pub mod mask;
pub mod matmul;
pub mod neural_gaussians;
pub mod noise;
pub mod normal;
pub mod normality;
pub mod opacity_target;
pub mod perturb;
pub mod pinhole;
pub mod prefilter;
pub mod project;
pub mod rasterise;
pub mod rate;
mod records;
pub mod simd;
pub mod spherical_harmonics;
pub mod ssim;
pub mod taps;
pub mod tiles;
pub mod volume;

pub use pinhole::Pinhole;
