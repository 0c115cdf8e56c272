//! Trains a structured neural Gaussian-splat scene from photographs and writes it as a compact bundle.
//!
//! Modules in the order data flows through them:
//! [`scene`] → [`ops`] → [`train`] → [`bundle`] → [`render`] → [`metrics`]; [`device`], [`effects`], [`cost`] and [`verify`] ask
//! them what fits a device.

pub mod bundle;
pub mod cost;
pub mod device;
pub mod effects;
pub mod instructions;
pub mod metrics;
pub mod ops;
pub mod render;
pub mod scene;
pub mod train;
pub mod verify;
