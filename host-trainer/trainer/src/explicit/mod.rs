//! Explicit Gaussians with spherical harmonics (Kerbl et al. 2023, 3D Gaussian Splatting): drawn, and trained.
//!
//! [`cloud`] holds them in any number type, [`step`] draws one view and takes its loss back to them, [`render`] makes pictures of a file's.

pub mod cloud;
pub mod render;
pub mod step;

pub use cloud::Cloud;
