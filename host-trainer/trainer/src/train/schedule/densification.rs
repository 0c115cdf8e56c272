//! When and how anchors come and go.

use serde::{Deserialize, Serialize};

/// When and how anchors come and go (Lu et al. 2024, Scaffold-GS, section 3.3; constants of the published trainer).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Densification {
    /// Shares of the run at which statistics start, growth starts and both end; 500, 1,500 and 15,000 of 30,000.
    pub statistics_from: f64,
    /// See `statistics_from`.
    pub from: f64,
    /// See `statistics_from`.
    pub until: f64,
    /// Iterations between two events; not scaled with the run.
    pub interval: u32,
    /// Share of an interval an anchor must have been seen in to be judged.
    pub success: f64,
    /// Mean screen gradient, half-image units, above which an offset asks for a new anchor at the coarsest level.
    pub gradient_threshold: f64,
    /// Voxel edge of the coarsest level, lattice cells; levels follow at a quarter each while at least one cell.
    /// Without it what the method publishes: 4 where training starts from random points, 16 where it starts from a
    /// capture's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coarsest_cells: Option<u32>,
    /// Levels at most.
    pub levels: u32,
    /// Anchors whose mean opacity sum is below are pruned.
    pub min_opacity: f64,
    /// Growth stops here; of the candidates that still fit, those with the largest gradient sums are taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_anchors: Option<usize>,
    /// Of the anchors that there are when growth ends, those that contribute most to the training views are kept, so many.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kept_anchors: Option<usize>,
}

impl Default for Densification {
    fn default() -> Self {
        Self {
            statistics_from: 500.0 / 30_000.0,
            from: 1_500.0 / 30_000.0,
            until: 15_000.0 / 30_000.0,
            interval: 100,
            success: 0.8,
            gradient_threshold: 2e-4,
            coarsest_cells: None,
            levels: 3,
            min_opacity: 0.005,
            max_anchors: None,
            kept_anchors: None,
        }
    }
}
