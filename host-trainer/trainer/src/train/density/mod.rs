//! Where anchors come and go: what training sees of them, growth and pruning.

pub mod densify;
pub mod statistics;
pub mod view_weight;
pub mod visibility;

pub use statistics::Statistics;
pub use visibility::Visibility;
