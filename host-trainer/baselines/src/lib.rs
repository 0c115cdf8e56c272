//! Published methods that compress explicit Gaussians, each as its paper describes it: what the project's own files are compared with.
//!
//! [`Baseline`] is what a method does, and each has a folder of its own: [`compact_3dgs`], [`light_gaussian`], [`rdo_gaussian`] and
//! [`self_organizing`]. They share the steps that come after training (`tuning`), `masks` that are learned, k-means (`k_means`),
//! `rotations` of one sign, and files: lattice places (`voxels`) in an `octree`, numbers as `bytes` or in columns, deflated (`packed`).

mod baseline;
mod bytes;
pub mod compact_3dgs;
mod k_means;
pub mod light_gaussian;
mod masks;
mod octree;
mod packed;
pub mod rdo_gaussian;
mod rotations;
pub mod self_organizing;
#[cfg(test)]
mod test_files;
#[cfg(test)]
mod test_scenes;
mod tuning;
mod voxels;

pub use baseline::{Baseline, TrainedScene, Unreadable};
pub use compact_3dgs::Compact3dgs;
pub use light_gaussian::LightGaussian;
pub use rdo_gaussian::RdoGaussian;
pub use self_organizing::SelfOrganizing;
