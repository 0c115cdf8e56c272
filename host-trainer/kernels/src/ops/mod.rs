//! The differentiable operations of a training step, one file each: `forward`, `backward`, plain slices, no state.
//!
//! Folders in order, each importing only from those before it: [`heads`], from an anchor to its Gaussians → [`image`], from Gaussians to
//! pixels → [`loss`], from pixels to one number → [`rate`], the bits of what a bundle stores.
//!
//! Order of a step: [`prefilter`](image::prefilter) → [`head_input`](heads::head_input) → [`head`](heads::head) →
//! [`neural_gaussians`](heads::neural_gaussians) → [`project`](image::project) → [`tiles`](image::tiles) →
//! [`rasterise`](image::rasterise) → [`l1`](loss::l1), [`ssim`](loss::ssim), [`volume`](loss::volume) → the same backwards → [`adam`].
//!
//! With explicit Gaussians [`explicit_gaussians`](image::explicit_gaussians) and [`spherical_harmonics`](image::spherical_harmonics) stand
//! in the place of the first four.
//!
//! Every operation is generic over [`Real`](crate::real::Real): the trainer runs it in f32, the tests compare its backward pass in f64
//! with central differences of its forward pass, and f32 with f64.

pub mod adam;
pub mod heads;
pub mod image;
pub mod loss;
pub mod pinhole;
pub mod rate;
pub mod simd;

pub use pinhole::Pinhole;
