//! Model instructions: section 5 of `MANIFEST.md`.

use super::{Bundle, Coder};
use crate::context::{LevelKind, first_tap};

/// What a bundle's frames are worth in model instructions, which belong to the format and do not follow the decoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ModelCost {
    /// Of an anchor that is decoded, `3330 + coding`.
    pub decoded: u32,
}

impl ModelCost {
    /// Of an anchor that passed the prefilter.
    pub const VISIBLE: u32 = 580;
    /// Of a multiply-add of the heads.
    pub const HEAD_MAC: u32 = 3;
    /// Of a Gaussian.
    pub const GAUSSIAN: u32 = 1560;
    /// Of a pair of a tile and a splat, which counts with all its 16 rows of pixels.
    pub const PAIR: u32 = 1511;
    /// Of a pair of a pixel and a splat.
    pub const PIXEL: u32 = 34;
    /// Of a pixel of the frame.
    pub const FRAME_PIXEL: u32 = 93;
    /// An anchor that is decoded, without its symbols.
    const SITE: u32 = 3330;
}

impl Bundle<'_> {
    /// What its frames are worth in model instructions.
    #[must_use]
    pub fn model_cost(&self) -> ModelCost {
        // At most 358 channels, 12 levels, 272 inputs, 256 hidden units, 2¹⁵ taps: below 2²¹.
        let channels = self.header().n_channels() as u32;
        let coding = match self.coder() {
            Coder::Static(_) => channels.saturating_mul(8),
            Coder::Context(context) => {
                let corners: u32 =
                    context.levels().map(|level| if level.kind == LevelKind::Volume { 8 } else { 4 }).sum();
                let [inputs, hidden, weights] =
                    [context.n_inputs(), context.n_hidden(), first_tap(context.feature_dim(), context.n_taps())]
                        .map(|n| n as u32);
                let outputs = channels.saturating_mul(2).saturating_add(3);
                let macs = hidden.saturating_mul(inputs.saturating_add(outputs)).saturating_add(weights);
                let terms = [(45, channels), (83, corners), (44, outputs.saturating_add(hidden)), (4, macs)];
                terms.iter().fold(0, |sum, (each, n)| n.saturating_mul(*each).saturating_add(sum))
            }
        };
        ModelCost { decoded: coding.saturating_add(ModelCost::SITE) }
    }
}
