//! From an anchor and a direction of view to Gaussians.

pub mod detail;
pub mod head;
pub mod head_input;
pub mod mask;
pub mod matmul;
pub mod neural_gaussians;
