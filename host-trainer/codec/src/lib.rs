//! A bundle out of a trained scene, and what it takes.
//!
//! [`bundle`] codes and assembles, [`render`] draws with the decoder or by an independent reference in f64, [`manifest`] measures tiers,
//! [`verify`] checks a bundle's guarantees.

pub mod bundle;
pub mod manifest;
pub mod render;
pub mod verify;
