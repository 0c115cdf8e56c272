//! From an anchor's values to the Gaussians it stands for in one view.
//!
//! The module knows the meaning of channels and of the heads' inputs and outputs; it knows nothing of images.

mod anchor;
mod gaussian;
mod visit;

pub(crate) use anchor::{Anchor, ink_radius};
pub(crate) use gaussian::{Gaussian, GaussianSink, HeadOutputs, NO_ROTATION, Workspace};
pub(crate) use visit::{Evaluator, Pair};
