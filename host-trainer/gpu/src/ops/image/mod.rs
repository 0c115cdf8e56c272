//! From Gaussians and a camera to pixels, and what growth learns from them.

pub mod prefilter;
pub mod project;
pub mod rasterise;
pub mod statistics;
pub mod tiles;
