//! What coding does to the values of anchors, and the bits that they take.

pub mod adaptive_step;
pub mod anchor_bits;
pub mod grid_bits;
pub mod hash_grid;
pub mod integer_network;
mod noise;
pub mod parents;
pub mod perturb;
pub mod sample;
