//! Distribution regularisation: features that are cheap to code because they all look alike.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Module, Moment, Terms};
use crate::ops::Real;
use crate::ops::normality::{Form, Histograms, Moments, Spread, Weights};
use crate::scene::{Anchors, ModelShape, Scene};
use crate::train::config::within;
use crate::train::step::Block;

/// Which values are regularised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Vectors {
    /// The features.
    #[default]
    Features,
    /// All that is coded, in base steps.
    All,
}

/// What becomes of the terms of the channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reduction {
    /// Their sum, as eqs. 2 and 3 are printed: 50 features then weigh as much as the image, and cost quality.
    Sum,
    /// Their mean.
    #[default]
    Mean,
}

/// Pulls the values of each channel, over the anchors of a view, towards the standard normal distribution, and their spread
/// towards a target (the plug-and-play paper, eqs. 2 and 3).
///
/// `divergence·Σᵢ D(Pᵢ ‖ N(0, 1)) + spread·Σᵢ (σᵢ − σ₀)²` over the channels i, or the means; raw values, before noise or
/// rounding.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Distribution {
    /// Weight of the divergence.
    pub divergence: f64,
    /// Weight of the spread's squared distance to [`Self::target`].
    pub spread: f64,
    /// σ₀. At 1 the two terms agree; below, they settle between.
    pub target: f64,
    /// What counts as 1: values are divided by it. Features go about as far as a run has steps, so that a short one does not
    /// fill a deviation of 1 by itself.
    pub unit: f64,
    /// How the distribution of a channel is described.
    pub form: Form,
    /// Sum or mean over the channels.
    pub reduction: Reduction,
    /// Whether σ is the deviation or the variance.
    pub reading: Spread,
    /// Which values.
    pub vectors: Vectors,
    /// Share of the run from which on; without it as soon as values have a scale: from the first noise on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from: Option<f64>,
    /// Share of the run after which the terms are gone; without it they stay.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub until: Option<f64>,
}

impl Default for Distribution {
    fn default() -> Self {
        Self {
            divergence: 1e-3,
            spread: 1e-3,
            target: 1.0,
            unit: 1.0,
            form: Form::Moments,
            reduction: Reduction::Mean,
            reading: Spread::Deviation,
            vectors: Vectors::Features,
            from: None,
            until: None,
        }
    }
}

impl Module for Distribution {
    fn check(&self) -> Result<(), String> {
        within("train.modules.distribution.divergence", self.divergence, 0.0, 1e3)?;
        within("train.modules.distribution.spread", self.spread, 0.0, 1e3)?;
        within("train.modules.distribution.target", self.target, 0.0, 1e3)?;
        within("train.modules.distribution.unit", self.unit, 1e-6, 1e6)?;
        within("train.modules.distribution.from", self.from.unwrap_or(0.0), 0.0, 1.0)?;
        within("train.modules.distribution.until", self.until.unwrap_or(1.0), 0.0, 1.0)
    }
}

/// Which arrays of an anchor are regularised: index in the order of the base steps, width.
fn arrays(vectors: Vectors, shape: &ModelShape) -> impl Iterator<Item = (usize, usize)> + use<> {
    let widths = [shape.feature_dim, shape.n_log_scales(), 3 * shape.n_offsets];
    let n = if vectors == Vectors::Features { 1 } else { widths.len() };
    widths.into_iter().enumerate().take(n)
}

impl Distribution {
    /// `[n, width]` the values of a block's anchors, each in its step.
    fn values<R: Real>(&self, steps: [R; 3], scene: &Scene<R>, block: &Block<R>) -> Vec<R> {
        let Anchors { features, log_scales, offsets, .. } = &scene.anchors;
        let arrays: Vec<_> = arrays(self.vectors, &scene.shape).collect();
        let mut values = Vec::new();
        for anchor in block.anchors.iter().map(|a| *a as usize) {
            for (i, width) in &arrays {
                let row = &[features, log_scales, offsets][*i][anchor * width..(anchor + 1) * width];
                values.extend(row.iter().map(|x| *x / steps[*i]));
            }
        }
        values
    }

    /// Adds gradients of [`Self::values`] to those of the block's anchors.
    fn add<R: Real>(&self, steps: [R; 3], shape: &ModelShape, d_values: &[R], block: &mut Block<R>) {
        let row = arrays(self.vectors, shape).map(|(_, width)| width).sum::<usize>();
        let mut first = 0;
        for (i, width) in arrays(self.vectors, shape) {
            let sums = [&mut block.d_features, &mut block.d_log_scales, &mut block.d_offsets].into_iter().nth(i);
            let sums = sums.into_iter().flat_map(|sums| sums.chunks_exact_mut(width));
            for (sums, d) in sums.zip(d_values.chunks_exact(row)) {
                for (sum, d) in sums.iter_mut().zip(&d[first..]) {
                    *sum += *d / steps[i];
                }
            }
            first += width;
        }
    }
}

impl<R: Real> Terms<R> for Distribution {
    fn on_anchors(&self, at: &Moment, scene: &Scene<R>, blocks: &mut [Block<R>]) -> R {
        let begun = self.from.map_or(at.scaled, |from| at.is_after(from));
        if !begun || self.until.is_some_and(|until| at.is_after(until)) {
            return R::ZERO;
        }
        let steps = match self.vectors {
            Vectors::Features => [R::real(self.unit); 3],
            Vectors::All => at.base_steps.map(|step| R::real(self.unit * f64::from(step))),
        };
        let width = arrays(self.vectors, &scene.shape).map(|(_, width)| width).sum::<usize>();
        let values: Vec<Vec<R>> = blocks.par_iter().map(|block| self.values(steps, scene, block)).collect();
        let parts: Vec<&[R]> = values.iter().map(Vec::as_slice).collect();
        let share = match self.reduction {
            Reduction::Sum => 1.0,
            Reduction::Mean => 1.0 / width.max(1) as f64,
        };
        let weights = Weights {
            divergence: R::real(self.divergence * share),
            spread: R::real(self.spread * share),
            target: R::real(self.target),
        };
        let by_moments = self.form == Form::Moments;
        let moments = Moments::of(&parts, width);
        let histograms = (!by_moments).then(|| Histograms::of(&parts, width));
        blocks.par_iter_mut().zip(&values).for_each(|(block, values)| {
            let mut d_values = vec![R::ZERO; values.len()];
            moments.backward(&weights, self.reading, by_moments, values, &mut d_values);
            if let Some(histograms) = &histograms {
                histograms.backward(weights.divergence, values, &mut d_values);
            }
            self.add(steps, &scene.shape, &d_values, block);
        });
        let of_histograms = histograms.map_or(R::ZERO, |histograms| histograms.term(weights.divergence));
        moments.term(&weights, self.reading, by_moments) + of_histograms
    }
}
