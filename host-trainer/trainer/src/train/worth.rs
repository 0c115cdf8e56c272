//! What offsets and anchors are worth: the squared error that the training images gain without them, against their bits.

use super::bits::Bits;
use super::coding::Integers;
use super::{TrainError, Trainer};
use crate::ops::noise::Stream;
use crate::step::Workspace;

/// Bits of an anchor beside its values: its place in the octree and its masks. (Lego at 100 px, 17,494 anchors: 15.7 and
/// 5.8.)
const ANCHOR_OVERHEAD_BITS: f64 = 22.0;
/// Branch of the run's stream that probes draw their signs from.
const PROBES: u32 = 0x50_52_4f_42;

/// What each offset and each anchor gives and takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Worth {
    /// `[n, K]` mean squared error, over pixels, channels and views, that its removal adds; 0 where it is not drawn.
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

impl Trainer<'_> {
    /// Probes every training view once with random signs, see [`Workspace::probe`].
    ///
    /// An anchor's derivatives are summed over its offsets before they are squared: their images overlap.
    ///
    /// One bit more raises the rate term λ·(mean bits of a value) by λ/(n·C), n anchors of C values; the image's loss L is
    /// about proportional to the root of the mean squared error E, so dL/dE = L/(2E). Hence a bit is worth
    /// λ/(n·C) · 2E/L of E.
    ///
    /// Cost: a forward and a backward pass of the rasteriser a view. A probe's estimate of one offset in one view has a standard
    /// deviation of √2 times its mean; over v views that show it about √(2/v).
    ///
    /// # Errors
    /// [`TrainError::NoContext`] before there is a context model, [`TrainError::IntegerModel`] when it has no integer form.
    pub fn worth(&self) -> Result<Worth, TrainError> {
        let integers = Integers::of(&self.scene)?;
        let bits = Bits::of(&self.scene, &integers.context(&self.scene)?);
        let (n, k) = (self.scene.anchors.len(), self.scene.shape.n_offsets);
        let stream = Stream::of_run(self.config.seed).branch(PROBES).branch(self.iteration);
        let mut workspace = Workspace::new(&self.scene.shape);
        let (mut of_offsets, mut of_anchors) = (vec![0.0; n * k], vec![0.0; n]);
        let (mut squared_sum, mut n_values, mut loss) = (0.0, 0, 0.0);
        for (view, target) in (0u32..).zip(self.targets()) {
            let error = workspace.probe(&self.scene, &target, &self.config.loss, stream.branch(view));
            squared_sum += error.squared_sum;
            n_values += error.n_values;
            loss += error.loss / self.trained.len() as f64;
            for block in workspace.blocks() {
                let mut changes = vec![0.0; block.anchors.len()];
                for ((gaussian, d), source) in block.gaussians.iter().zip(&block.d_gaussians).zip(&block.sources) {
                    let change = f64::from(gaussian.opacity * d.opacity);
                    let row = source.row as usize;
                    of_offsets[block.anchors[row] as usize * k + source.offset as usize] += change * change;
                    changes[row] += change;
                }
                for (anchor, change) in block.anchors.iter().zip(changes) {
                    of_anchors[*anchor as usize] += change * change;
                }
            }
        }
        for sum in of_offsets.iter_mut().chain(&mut of_anchors) {
            *sum /= n_values.max(1) as f64;
        }
        let mean_squared_error = squared_sum / n_values.max(1) as f64;
        let price_in_loss = self.config.hac.lambda / (n * self.scene.shape.values_per_anchor()).max(1) as f64;
        let bit_price = price_in_loss * 2.0 * mean_squared_error / loss.max(f64::MIN_POSITIVE);
        Ok(Worth { of_offsets, of_anchors, bits, bit_price })
    }
}
