//! Learning rates over a run.

use serde::{Deserialize, Serialize};

/// A learning rate over the run: `start` until share `from` is done, then on a geometric path to `end`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LearningRate {
    /// At iteration 0.
    pub start: f64,
    /// At the end: the last iteration, or the one where a published schedule ends.
    pub end: f64,
    /// Share of the run up to which it stays at `start`.
    #[serde(default)]
    pub from: f64,
}

impl LearningRate {
    /// A geometric path over the whole run.
    pub const fn falling(start: f64, end: f64) -> Self {
        Self { start, end, from: 0.0 }
    }

    /// lr(t) = start^(1 − u) · end^u with `progress` = t/T and u = max(0, (t/T − from)/(1 − from)).
    pub fn at(&self, progress: f64) -> f64 {
        if self.start <= 0.0 || progress <= self.from {
            return self.start.max(0.0);
        }
        let fallen = (progress - self.from) / (1.0 - self.from);
        (self.start.ln() * (1.0 - fallen) + self.end.ln() * fallen).exp()
    }

    /// The same path, `factor` times as high.
    pub fn times(&self, factor: f64) -> Self {
        Self { start: self.start * factor, end: self.end * factor, ..*self }
    }
}

/// Learning rates: they start as those of the published trainers of Scaffold-GS and HAC, and decay together.
///
/// The published rates of features, log-scales and the covariance head are constant: a value that still moves at the end flips
/// across the borders between symbols until the last step. Those of offsets, opacity, colour and the context model fall all the
/// way, to a hundredth and less: what rate–distortion pruning leaves, late in the run, hardly moves into the gaps. Here all of them stay
/// until 0.85 of the run and then fall to a tenth or a fifteenth. Masks fall all the way as published, and so does
/// a background that is learned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rates {
    /// Offsets; multiplied by the capture's extent.
    pub offset: LearningRate,
    /// Anchor features.
    pub feature: LearningRate,
    /// Log-scales.
    pub log_scale: LearningRate,
    /// Opacity head.
    pub opacity_head: LearningRate,
    /// Covariance head.
    pub covariance_head: LearningRate,
    /// Colour head.
    pub colour_head: LearningRate,
    /// Mask logits; multiplied by the capture's extent. Where there is a rate, as those below.
    pub mask: LearningRate,
    /// Grid of the context model.
    pub grid: LearningRate,
    /// Network of the context model.
    pub context: LearningRate,
    /// Background, where it is learned.
    #[serde(default = "background_rate")]
    pub background: LearningRate,
}

/// The rate of the background.
const fn background_rate() -> LearningRate {
    LearningRate::falling(0.01, 1e-4)
}

/// Share of the run after which rates fall.
pub(super) const DECAY_FROM: f64 = 0.85;

// docs/method.md has the same table, and a test in `optimiser` looks at each rate through a run.
impl Default for Rates {
    fn default() -> Self {
        let decaying = |start, end| LearningRate { start, end, from: DECAY_FROM };
        Self {
            offset: decaying(0.01, 1e-3),
            feature: decaying(0.015, 5e-4),
            log_scale: decaying(0.007, 5e-4),
            opacity_head: decaying(0.002, 2e-4),
            covariance_head: decaying(0.004, 4e-4),
            colour_head: decaying(0.008, 8e-4),
            mask: LearningRate::falling(0.01, 1e-4),
            grid: decaying(0.005, 5e-4),
            context: decaying(0.005, 5e-4),
            background: background_rate(),
        }
    }
}
