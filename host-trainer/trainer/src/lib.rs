//! Trains a structured neural Gaussian-splat scene from photographs and writes it as a compact bundle.
//!
//! Modules in the order data flows through them, each importing only from those before it:
//! [`real`] and [`camera`] → [`scene`] → [`ops`] → [`step`] → [`train`] → [`bundle`] → [`render`] → [`metrics`]. [`explicit`] draws and
//! trains explicit Gaussians instead of anchors, beside `train`. `gpu` (cargo feature `gpu`) is `ops` and `step` on a graphics card. [`integer_model`] is
//! what `train`'s last iterations and `bundle` share; [`device`] says what a device holds and [`encode`] makes the bundle of a run that
//! fits it; [`effects`], [`cost`] and [`verify`] ask all of them.

pub mod bundle;
pub mod camera;
pub mod cost;
pub mod device;
pub mod effects;
pub mod encode;
pub mod explicit;
pub mod export;
#[cfg(test)]
pub(crate) mod finite_difference;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod integer_model;
pub mod manifest;
pub mod metrics;
pub mod ops;
pub mod real;
pub mod render;
pub mod scene;
pub mod step;
pub mod train;
pub mod verify;

/// Revision of training: raised by the commit that changes what a run gives, from its photographs to its bundle, so that figures of two
/// programs are told apart.
pub const REVISION: u32 = 1;
