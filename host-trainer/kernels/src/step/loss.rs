//! What a step's loss consists of besides the rate: the image's terms, and those that modules add.

use serde::{Deserialize, Serialize};

use super::Block;
use super::coding::Phase;
use crate::ops::rate::noise::Stream;
use crate::ops::simd::Level;
use crate::real::Real;
use crate::scene::{ModelShape, Scene};

/// Weights of the loss (Scaffold-GS, eq. 10).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LossWeights {
    /// Share λ of 1 − SSIM; L1 has 1 − λ.
    pub dssim: f64,
    /// Mean volume of the Gaussians.
    pub volume: f64,
}

impl Default for LossWeights {
    fn default() -> Self {
        Self { dssim: 0.2, volume: 0.01 }
    }
}

/// What a step's loss consists of besides the rate.
#[derive(Clone, Copy)]
pub struct Loss<'a, R> {
    /// Weights of the image's terms.
    pub weights: LossWeights,
    /// The terms of modules, and what they are told of the run.
    pub modules: Option<(&'a [&'a dyn Terms<R>], &'a StepInfo)>,
    /// Anchors whose [place](crate::scene::Anchors::prune_rank) is below are not there.
    pub pruned_share: f32,
}

impl<R> Loss<'_, R> {
    /// The image's terms alone.
    pub fn plain(weights: LossWeights) -> Self {
        Self { weights, modules: None, pruned_share: 0.0 }
    }
}

/// Where a run stands when a module is asked.
#[derive(Clone, Copy, Debug)]
pub struct StepInfo {
    /// Current iteration, from 1.
    pub iteration: u32,
    /// Iterations of the run.
    pub iterations: u32,
    /// What the step does to the values of anchors.
    pub phase: Phase,
    /// Whether the values of anchors have a scale that means something: from the first noise on where the run comes to
    /// that, else always. Before, a network can undo any change of scale.
    pub scaled: bool,
    /// Random numbers of this iteration.
    pub stream: Stream,
}

impl StepInfo {
    /// Whether more than `share` of the run is done.
    pub fn is_after(&self, share: f64) -> bool {
        f64::from(self.iteration) > self.iteration_at(share)
    }

    /// Whether just `share` of the run is done.
    pub fn is_at(&self, share: f64) -> bool {
        f64::from(self.iteration) == self.iteration_at(share)
    }

    fn iteration_at(&self, share: f64) -> f64 {
        (share * f64::from(self.iterations)).round()
    }
}

/// Two images that are compared.
#[derive(Clone, Copy, Debug)]
pub struct ImagePair<'a, R> {
    /// What was drawn, planes `[3, height, width]`.
    pub image: &'a [R],
    /// The photograph.
    pub truth: &'a [R],
    /// Width and height.
    pub size_px: [usize; 2],
    /// Instruction set of the loops.
    pub level: Level,
}

/// Terms that a device computes itself; a weight of 0 is none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeviceTerms {
    /// Weight of [`high_pass`](crate::ops::loss::high_pass).
    pub high_pass: f64,
    /// Opacity that a Gaussian should have on average, and the weight of [`opacity_target`](crate::ops::loss::opacity_target).
    pub opacity_target: [f64; 2],
    /// Divergence and spread of [`normality`](crate::ops::loss::normality) of the raw features.
    pub normality: [f64; 2],
}

/// What a module adds to the loss of a step: each function returns its terms and adds their gradients.
pub trait Terms<R: Real>: Sync {
    /// Writes the terms of this step as devices know them; `false` where it has one that only the functions below compute, so that such a
    /// step has its anchors on the CPU.
    fn on_device(&self, _at: &StepInfo, _shape: &ModelShape, _terms: &mut DeviceTerms) -> bool {
        false
    }

    /// Whether [`Self::on_image`] has a term: for a device this costs two copies of the image.
    fn is_on_image(&self) -> bool {
        false
    }

    /// Terms on the image.
    ///
    /// * `d_image`: planes as the image; added to.
    fn on_image(&self, _at: &StepInfo, _pictures: &ImagePair<'_, R>, _d_image: &mut [R]) -> R {
        R::ZERO
    }

    /// Terms on the Gaussians of the view, after the forward pass.
    ///
    /// * `blocks`: [`Block::d_gaussians`] is added to.
    fn on_gaussians(&self, _at: &StepInfo, _scene: &Scene<R>, _blocks: &mut [Block<R>]) -> R {
        R::ZERO
    }

    /// Terms on the parameters of the visible anchors, after the backward pass.
    ///
    /// * `blocks`: gradients of anchors are added to.
    fn on_anchors(&self, _at: &StepInfo, _scene: &Scene<R>, _blocks: &mut [Block<R>]) -> R {
        R::ZERO
    }
}
