//! Probes of the training views, which find out what everything in the scene is [worth](Worth).

use super::{Bits, Worth};
use crate::train::context::integers::Integers;
use crate::train::error::TrainError;
use crate::train::exposures::Exposures;
use crate::train::read_ahead::ReadAhead;
use crate::train::views::{TrainingViews, target};
use pocketsplat_kernels::ops::rate::noise::Stream;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::{LossWeights, Workspace};

/// Branch of the run's stream that probes draw their signs from.
const PROBES: u32 = 0x50_52_4f_42;

/// The views, of all that are trained on, which a pass probes: all up to 100, else every second, third or fourth. More of them change which anchors
/// go, but not what a byte buys; fewer than every fourth were not tried (docs/experiments/2026-11-28-fewer-anchors-and-pixels.md).
pub fn probed<I: ExactSizeIterator>(views: I) -> impl Iterator<Item = I::Item> {
    let every = views.len().div_ceil(100).clamp(1, 4);
    views.step_by(every)
}

/// What a pass finds; the first two as in [`Worth`].
struct Errors {
    of_offsets: Vec<f64>,
    of_anchors: Vec<f64>,
    /// Of the image, over pixels, channels and views.
    mean_squared_error: f64,
    /// The loss on the image, mean over the views.
    loss: f64,
}

/// A run between two iterations, as far as its views are probed.
#[derive(Clone, Copy, Debug)]
pub struct Probe<'a> {
    /// The scene as it stands.
    pub scene: &'a Scene<f32>,
    /// The views.
    pub views: &'a TrainingViews<'a>,
    /// Their photographs.
    pub(in crate::train) photographs: &'a ReadAhead,
    /// How they were exposed.
    pub exposures: &'a Exposures,
    /// What lies behind the scene.
    pub background: [f32; 3],
    /// The loss on the image.
    pub loss: LossWeights,
    /// Weight of a value's bits in the loss.
    pub lambda: f64,
    /// Of the run.
    pub seed: u64,
    /// Iterations done.
    pub iteration: u32,
}

impl Probe<'_> {
    /// Probes the training views, see [`Workspace::probe`]: those of [`probed`]. Says also what the offsets and anchors cost.
    ///
    /// Cost: a forward and a backward pass of the rasteriser a view.
    ///
    /// One bit more raises the rate term λ·(mean bits of a value) by λ/(n·C), n anchors of C values; the image's loss L is
    /// about proportional to the root of the mean squared error E, so dL/dE = L/(2E). Hence a bit is worth
    /// λ/(n·C) · 2E/L of E.
    ///
    /// # Errors
    /// [`TrainError::NoContext`] before there is a context model, [`TrainError::IntegerModel`] when it has no integer form,
    /// [`TrainError::Photograph`].
    pub fn worth(&self) -> Result<Worth, TrainError> {
        let integers = Integers::of(self.scene)?;
        let bits = Bits::of(self.scene, &integers.context(self.scene)?);
        let Errors { of_offsets, of_anchors, mean_squared_error, loss } = self.errors()?;
        let price_in_loss = self.lambda / (of_anchors.len() * self.scene.shape.values_per_anchor()).max(1) as f64;
        let bit_price = price_in_loss * 2.0 * mean_squared_error / loss.max(f64::MIN_POSITIVE);
        Ok(Worth { of_offsets, of_anchors, bits, bit_price })
    }

    /// `[n]` how much the scene would lose with each anchor: for each bit, where there is a context model that says what they cost.
    ///
    /// # Errors
    /// As [`Self::worth`].
    #[expect(clippy::cast_possible_truncation, reason = "they are compared")]
    pub fn importance(&self) -> Result<Vec<f32>, TrainError> {
        if self.scene.context.is_some() {
            return Ok(self.worth()?.per_bit());
        }
        Ok(self.errors()?.of_anchors.into_iter().map(|error| error as f32).collect())
    }

    /// Probes training views with random signs, see [`Workspace::probe`]: those of [`probed`].
    ///
    /// An anchor's derivatives are summed over its offsets before they are squared: their images overlap.
    ///
    /// Cost: a forward and a backward pass of the rasteriser a view. A probe's estimate of one offset in one view has a standard
    /// deviation of √2 times its mean; over v views that show it about √(2/v).
    fn errors(&self) -> Result<Errors, TrainError> {
        let (n, k) = (self.scene.anchors.len(), self.scene.shape.n_offsets);
        let stream = Stream::of_run(self.seed).branch(PROBES).branch(self.iteration);
        let mut workspace = Workspace::new(&self.scene.shape);
        let (mut of_offsets, mut of_anchors) = (vec![0.0; n * k], vec![0.0; n]);
        let (mut squared_sum, mut n_values, mut loss) = (0.0, 0, 0.0);
        let mut photographs = self.photographs.beside();
        let TrainingViews { all, cameras, trained } = self.views;
        let trained: Vec<u32> = probed(trained.iter().copied()).collect();
        for (view, at) in (0u32..).zip(0..trained.len()) {
            let photograph = photographs.photograph(all, trained[at..].iter().copied())?;
            let target = target(&photograph, &cameras[trained[at] as usize], self.background)
                .exposed(self.exposures.of_view(trained[at] as usize));
            let error = workspace.probe(self.scene, &target, &self.loss, stream.branch(view));
            squared_sum += error.squared_sum;
            n_values += error.n_values;
            loss += error.loss / trained.len() as f64;
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
        Ok(Errors { of_offsets, of_anchors, mean_squared_error, loss })
    }
}
