//! What the steps of each phase do to the values of anchors, and the context model's beginning.

use pocketsplat_format::context::Context;

use super::config::{Backbone, TrainConfig};
use super::{TrainError, Trainer, context_start};
use pocketsplat_kernels::integer_model;
use pocketsplat_kernels::ops::noise::Stream;
use pocketsplat_kernels::ops::perturb;
use pocketsplat_kernels::scene::{ContextNetwork, Head, Heads, Scene};
use pocketsplat_kernels::step::Phase;
use pocketsplat_kernels::step::coding::{Coding, IntegerModel, RateTerms};

/// Bits of the fraction of the heads' weights that a run with a context model ends with: they are drawn so in its last phase, so
/// that rounding them costs nothing.
pub(super) const HEAD_FRACTION_BITS: u8 = 7;

/// The integer form of a scene's context model, as bytes and as the networks that they stand for, and the heads as they are
/// written.
#[derive(Clone, Debug)]
pub(super) struct Integers {
    pub(super) section: Vec<u8>,
    pub(super) networks: Vec<ContextNetwork<f32>>,
    pub(super) heads: Heads<f32>,
}

impl Integers {
    /// Of the scene's context model.
    ///
    /// # Errors
    /// [`TrainError::NoContext`] when there is none, [`TrainError::IntegerModel`] when a weight has no integer form.
    pub(super) fn of(scene: &Scene<f32>) -> Result<Self, TrainError> {
        let n_channels = scene.shape.values_per_anchor();
        let model = scene.context.as_ref().ok_or(TrainError::NoContext)?;
        Ok(Self {
            section: integer_model::section(model, n_channels)?,
            networks: integer_model::rounded(model, n_channels)?,
            heads: scene.heads.map(written),
        })
    }

    /// What a decoder makes of the bytes.
    ///
    /// # Errors
    /// [`TrainError::IntegersUnread`].
    pub(super) fn context(&self, scene: &Scene<f32>) -> Result<Context<'_>, TrainError> {
        Ok(integer_model::parse(&self.section, &scene.shape)?)
    }
}

fn head_step() -> f32 {
    (-f32::from(HEAD_FRACTION_BITS)).exp2()
}

/// A head whose matrices are multiples of the last bit of the fraction.
fn written(head: &Head<f32>) -> Head<f32> {
    let step = head_step();
    let matrix = |weights: &[f32]| weights.iter().map(|weight| perturb::symbol(*weight, step) * step).collect();
    Head { w1: matrix(&head.w1), w2: matrix(&head.w2), ..head.clone() }
}

impl Trainer<'_> {
    /// Makes the context model where this iteration is the first to need it.
    ///
    /// # Errors
    /// [`TrainError`] when the scene is on the GPU and reading it back fails.
    pub(super) fn begin_context(&mut self) -> Result<(), TrainError> {
        let phase = self.config.phase(self.iteration);
        if self.scene.context.is_none() && matches!(phase, Phase::Context | Phase::IntegerModel) {
            self.take_back()?;
            let base_steps = self.config.hac.base_steps();
            let begin = match self.config.backbone {
                Backbone::ContextGs => context_start::initial_levels,
                Backbone::Scaffold | Backbone::Hac | Backbone::HacPlus => context_start::initial_context,
            };
            let model = begin(&self.scene, self.n_to_size_context_for(), base_steps, &mut self.rng);
            let n_taps = self.config.backbone.n_taps(self.scene.shape.feature_dim);
            self.scene.context = Some(model.with_taps(&self.scene.shape, n_taps, 0.0));
            self.optimiser.begin_context(&self.scene);
            self.count_views();
        }
        Ok(())
    }

    /// Anchors to size the context model for: all, or as many as rate–distortion pruning is expected to leave.
    fn n_to_size_context_for(&self) -> usize {
        let n = self.scene.anchors.len();
        if self.config.modules.weigh_bits() { context_start::n_to_size_for(n, self.lambda) } else { n }
    }
}

/// What iteration `iteration` does.
///
/// * `lambda`: weight of a value's bits. * `exact`: the integers, in the phase that needs them; without them a device makes its own.
pub(super) fn coding<'a>(
    config: &TrainConfig,
    lambda: f64,
    iteration: u32,
    exact: Option<(&'a Context<'a>, &'a Integers)>,
) -> Coding<'a, f32> {
    let hac = &config.hac;
    let stream = Stream::of_run(config.seed).branch(iteration);
    let masks_weigh_anchors = config.backbone == Backbone::HacPlus;
    let rate = RateTerms {
        lambda,
        sample: hac.sample,
        mask: if masks_weigh_anchors { 0.0 } else { hac.mask_weight },
        masks_weigh_anchors,
        grid: hac.grid_weight,
    };
    match config.phase(iteration) {
        Phase::Raw => Coding::Raw,
        Phase::Noise => Coding::Noise { stream, steps: hac.base_steps() },
        Phase::IntegerModel if exact.is_none() => Coding::Integers { stream, rate, head_step: head_step() },
        Phase::Context | Phase::IntegerModel => {
            let exact = exact.map(|(context, integers)| IntegerModel { context, networks: &integers.networks });
            Coding::Context { stream, rate, exact }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::module::{Modules, Rdo};
    use crate::train::test_capture::{tiny_capture, tiny_hac_config};

    #[test]
    fn only_pruning_by_worth_makes_the_context_smaller() {
        let capture = tiny_capture();
        let mut config = tiny_hac_config(60);
        config.hac.lambda = 0.004;
        let sized = |modules| {
            let trainer = Trainer::new(&capture, TrainConfig { modules, ..config }).unwrap();
            (trainer.n_to_size_context_for(), trainer.scene.anchors.len())
        };
        let (n, n_anchors) = sized(Modules { rdo: Some(Rdo::default()), ..Modules::default() });
        assert_eq!(n, n_anchors / 2);
        let (n, n_anchors) = sized(Modules::default());
        assert_eq!(n, n_anchors);
    }
}
