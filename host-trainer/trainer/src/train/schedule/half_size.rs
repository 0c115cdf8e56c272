//! Smaller images first.

use serde::{Deserialize, Serialize};

/// When images have half of their width and height: coarse things need few pixels, and a step's time follows its pixels (Chen et al. 2025,
/// DashGaussian, section 4.1, with one step in the place of many).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct HalfSize {
    /// Share of the run up to which they do; no longer than growth lasts, for what is small shows at the whole size alone.
    pub until: f64,
    /// Longer side that the largest image of a capture must have left, px; else all images stay whole.
    pub least_px: u32,
}

impl Default for HalfSize {
    fn default() -> Self {
        Self { until: 0.0, least_px: 150 }
    }
}
