//! Explicit Gaussians with spherical harmonics (Kerbl et al. 2023, 3D Gaussian Splatting): drawn, and trained.
//!
//! [`cloud`] holds them in any number type, [`step`] draws one view and takes its loss back to them, [`render`] makes pictures of a file's,
//! [`train`] the rest of a run: [`start`], [`optimiser`], [`density`], [`checkpoint`].

pub mod checkpoint;
pub mod cloud;
pub mod config;
pub mod density;
pub mod frame;
pub mod optimiser;
pub mod render;
pub mod start;
pub mod step;
pub mod train;

pub use cloud::Cloud;
pub use config::CloudConfig;
pub use train::CloudTrainer;
