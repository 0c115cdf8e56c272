//! From Gaussians and a camera to pixels.

pub mod depth_order;
pub mod explicit_gaussians;
pub mod prefilter;
pub mod project;
pub mod rasterise;
mod records;
pub mod spherical_harmonics;
pub mod tiles;
