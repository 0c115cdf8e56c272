//! A neural Gaussian-splat scene and one step of its training, on the CPU.
//!
//! Modules in the order data flows through them, each importing only from those before it:
//! [`real`] and [`camera`] → [`scene`] → [`ops`] → [`integer_model`] → [`step`]. Operations are generic over [`real::Real`], so that their
//! gradients are checked against [finite differences](finite_difference) in f64.

pub mod camera;
pub mod finite_difference;
pub mod integer_model;
pub mod ops;
pub mod real;
pub mod scene;
pub mod step;
