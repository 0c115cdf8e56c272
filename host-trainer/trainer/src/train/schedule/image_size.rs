//! How large images are, and when.

use serde::{Deserialize, Serialize};

/// Shares of a run that train on smaller images: coarse things need few pixels, and a step's time follows its pixels (Chen et al. 2025,
/// DashGaussian, section 4.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ImageSize {
    /// Share of the run up to which sides are a quarter.
    pub quarter_until: f64,
    /// Share up to which they are a half.
    pub half_until: f64,
}

impl ImageSize {
    /// How often the sides of an image are halved after this share of the run.
    pub fn halvings(&self, progress: f64) -> u32 {
        u32::from(progress < self.half_until) + u32::from(progress < self.quarter_until)
    }
}
