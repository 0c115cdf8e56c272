//! What offsets and anchors are worth: the squared error that the training images gain without them, against their bits.

pub mod bits;
mod probe;

pub use bits::Bits;
pub use probe::{Probe, probed};

/// Bits of an anchor beside its values: its place in the octree and its masks. (Lego at 100 px, 17,494 anchors: 15.7 and
/// 5.8.)
const ANCHOR_OVERHEAD_BITS: f64 = 22.0;

/// What each offset and each anchor gives and takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Worth {
    /// `[n, K]` mean squared error, over pixels, channels and [probed] views, that its removal adds; 0 where it is not drawn.
    pub of_offsets: Vec<f64>,
    /// `[n]` the same of all offsets of an anchor together.
    pub of_anchors: Vec<f64>,
    /// What they cost.
    pub bits: Bits,
    /// Mean squared error that pays for one bit, by the weight λ of the rate in the loss.
    pub bit_price: f64,
}

impl Worth {
    /// All bits of an anchor.
    pub fn anchor_bits(&self, anchor: usize) -> f64 {
        self.bits.of_anchors[anchor].iter().sum::<f64>() + ANCHOR_OVERHEAD_BITS
    }

    /// `[n]` mean squared error for each bit of an anchor.
    #[expect(clippy::cast_possible_truncation, reason = "scores are compared")]
    pub fn per_bit(&self) -> Vec<f32> {
        (0..self.of_anchors.len()).map(|anchor| (self.of_anchors[anchor] / self.anchor_bits(anchor)) as f32).collect()
    }
}
