//! A bundle as explicit Gaussians, which other programs draw.
//!
//! Opacity, shape and colour of a bundle's Gaussians follow the view; those of a file do not, but for a colour of low degree. [`bake()`]
//! takes of what the training cameras see the mean shape and the colour that fits best, [`refine()`] moves these by gradient descent
//! towards the bundle's own pictures.

mod bake;
mod least_squares;
mod principal_axes;
mod refine;

pub use bake::{Baked, bake};
pub use refine::{Refinement, refine};
