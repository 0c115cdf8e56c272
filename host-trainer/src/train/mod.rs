//! Training: one step, the optimiser, growth and pruning, and the loop around them.

pub mod config;
pub mod step;

pub use config::TrainConfig;
