//! What coding does to the values of anchors, and the bits that they take.

pub mod adaptive_step;
pub mod anchor_bits;
pub mod file_order;
pub mod grid_bits;
pub mod hash_grid;
pub mod noise;
pub mod normal;
pub mod normal_bits;
pub mod perturb;
pub mod taps;
