//! How coarsely values are rounded.

/// Distance between neighbouring values of each kind of channel; the value of a symbol is `symbol · step`.
///
/// The defaults take 28 % off a bundle of steps 0.02 and cost 0.14 dB (lego at 200 px;
/// `docs/experiments/2026-11-21-quantisation-steps.md`).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct QuantisationSteps {
    /// Of the features.
    pub feature: f32,
    /// Of the log-scales: 0.05 is 5 % of size.
    pub log_scale: f32,
    /// Of the offsets, in units of the anchor's extent.
    pub offset: f32,
}

impl QuantisationSteps {
    /// All of them times `share`.
    pub fn scaled(self, share: f32) -> Self {
        Self::from(<[f32; 3]>::from(self).map(|step| share * step))
    }
}

impl From<QuantisationSteps> for [f32; 3] {
    /// In the order of the channels.
    fn from(steps: QuantisationSteps) -> Self {
        [steps.feature, steps.log_scale, steps.offset]
    }
}

impl From<[f32; 3]> for QuantisationSteps {
    /// Of steps in the order of the channels.
    fn from([feature, log_scale, offset]: [f32; 3]) -> Self {
        Self { feature, log_scale, offset }
    }
}

impl Default for QuantisationSteps {
    fn default() -> Self {
        Self { feature: 0.1, log_scale: 0.05, offset: 0.1 }
    }
}
