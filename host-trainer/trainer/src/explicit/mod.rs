//! Explicit Gaussians with spherical harmonics (Kerbl et al. 2023, 3D Gaussian Splatting): drawn, and trained.
//!
//! [`cloud`] holds them in any number type, [`step`] draws one view and takes its loss back to them, [`render`] makes pictures of a file's,
//! [`train`] the rest of a run: [`start`], [`optimiser`], [`density`]. For those that come without
//! photographs, [`bulk`] says where they are, [`side`] from which side they were made to be seen, [`views`] stands cameras there, upright to
//! [`up`], and [`pictures`] makes a capture of what these see.

pub mod bulk;
pub mod cloud;
pub mod config;
pub mod density;
pub mod frame;
pub mod optimiser;
pub mod pictures;
pub mod render;
pub mod side;
pub mod start;
pub mod step;
#[cfg(test)]
mod test_scenes;
pub mod train;
pub mod up;
pub mod views;

pub use cloud::Cloud;
pub use config::CloudConfig;
pub use train::{CloudTrainer, Explicit};
