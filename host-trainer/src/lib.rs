//! Trains a structured neural Gaussian-splat scene from photographs and writes it as a compact bundle.
//!
//! Modules in the order data flows through them:
//! [`dataset`] (or [`synth`]) → [`scene`] → [`ops`] → [`train`] → [`bundle`] → [`render`] → [`metrics`] → [`plot`].

pub mod bundle;
pub mod camera;
pub mod cost;
pub mod dataset;
pub mod device;
pub mod effects;
pub mod instructions;
pub mod metrics;
pub mod ops;
pub mod plot;
pub mod render;
pub mod scene;
pub mod synth;
pub mod train;
pub mod verify;
