//! One step of a run on anchors: what coding does in it, where it is computed, and how parameters follow.

use std::mem;

use pocketsplat_format::context::Context;

use super::learned::Learned;
use super::state::RunState;
use super::trainer::Trainer;
use super::watchdog;
use crate::train::TrainConfig;
use crate::train::config::Rates;
use crate::train::context::integers::Integers;
use crate::train::context::phases::coding;
use crate::train::context::start;
use crate::train::density::view_weight::view_weights;
use crate::train::error::{Cause, TrainError};
use crate::train::streams::{Purpose, random};
use pocketsplat_kernels::ops::rate::noise::Stream;
use pocketsplat_kernels::step::coding::Coding;
use pocketsplat_kernels::step::{Loss, Phase, StepInfo, StepReport, TargetView};

/// Length of the published runs, iterations.
const PUBLISHED_ITERATIONS: f64 = 30_000.0;

impl Trainer<'_> {
    /// Moves the parameters along the gradients of the step.
    pub(super) fn follow_gradients(&mut self, on_device: bool) -> Result<(), TrainError> {
        // The published loop leaves the parameters of its last iteration as they are.
        if self.state.iteration < self.setup.config.iterations {
            let progress = f64::from(self.state.iteration) / f64::from(self.setup.config.iterations);
            if on_device {
                self.move_on_device(progress)?;
            } else {
                let (rates, extent, workspace) =
                    (self.rates(), self.setup.capture.extent, &self.machine.device.workspace);
                let Learned { scene, optimiser, .. } = &mut self.state.learned;
                optimiser.apply(scene, workspace, &rates, progress, extent);
            }
            if self.setup.config.learns_background {
                let rate = self.setup.config.rates.background.at(progress);
                let Learned { optimiser, background, .. } = &mut self.state.learned;
                optimiser.apply_to_background(background, &self.machine.device.workspace, rate);
            }
        }
        Ok(())
    }

    /// A step of the scene as it stands here, and what is wrong with it.
    pub(super) fn step_here(
        &mut self,
        target: &TargetView<'_, f32>,
        loss: &Loss<'_, f32>,
        coding: &Coding<'_, f32>,
    ) -> Result<(StepReport<f32>, Option<Cause>), TrainError> {
        self.take_back()?;
        let workspace = &mut self.machine.device.workspace;
        let Learned { scene, background, .. } = &self.state.learned;
        let report = workspace.try_step(scene, target, loss, coding)?;
        let cause = watchdog::inspect(scene, target, *background, workspace, &report);
        Ok((report, cause))
    }

    /// The same on the integers of the context model.
    ///
    /// Drawn with the heads as they are written; the gradients move the weights behind them (straight through).
    pub(super) fn step_on_integers(
        &mut self,
        target: &TargetView<'_, f32>,
        loss: &Loss<'_, f32>,
    ) -> Result<(StepReport<f32>, Option<Cause>), TrainError> {
        self.take_back()?;
        let integers = Integers::of(self.scene())?;
        let context = integers.context(self.scene())?;
        let coding = self.coding(Some((&context, &integers)));
        let behind = mem::replace(&mut self.state.learned.scene.heads, integers.heads.clone());
        let stepped = self.step_here(target, loss, &coding);
        self.state.learned.scene.heads = behind;
        stepped
    }

    /// What modules are told of this iteration.
    pub(super) fn step_info(&self) -> StepInfo {
        let (config, iteration) = (&self.setup.config, self.state.iteration);
        let phase = config.phase(iteration);
        StepInfo {
            iteration,
            iterations: config.iterations,
            phase,
            scaled: !config.backbone.is_coded() || phase != Phase::Raw,
            stream: Stream::of_run(config.seed).branch(iteration),
        }
    }

    /// What the steps of this iteration do to the values of anchors.
    pub(super) fn coding<'c>(&self, exact: Option<(&'c Context<'c>, &'c Integers)>) -> Coding<'c, f32> {
        let TrainConfig { backbone, hac, .. } = &self.setup.config;
        let StepInfo { phase, stream, .. } = self.step_info();
        coding(phase, *backbone, hac, self.state.learned.lambda, stream, exact)
    }

    /// Makes the context model where this iteration is the first to need it.
    ///
    /// # Errors
    /// [`TrainError`] when the scene is on the GPU and reading it back fails.
    pub(super) fn begin_context(&mut self) -> Result<(), TrainError> {
        let phase = self.setup.config.phase(self.state.iteration);
        if self.scene().context.is_none() && matches!(phase, Phase::Context | Phase::IntegerModel) {
            self.take_back()?;
            let n = self.n_to_size_context_for();
            let TrainConfig { backbone, hac, seed, .. } = &self.setup.config;
            let RunState { iteration, learned: Learned { scene, optimiser, .. }, .. } = &mut self.state;
            let mut rng = random(*seed, Purpose::Context, *iteration);
            scene.context = Some(start::begin_context(scene, *backbone, n, hac.base_steps(), &mut rng));
            optimiser.begin_context(scene);
            self.weigh_views();
        }
        Ok(())
    }

    /// Anchors to size the context model for: all, or as many as rate–distortion pruning is expected to leave.
    fn n_to_size_context_for(&self) -> usize {
        let n = self.scene().anchors.len();
        if self.setup.config.modules.weigh_bits() { start::n_to_size_for(n, self.state.learned.lambda) } else { n }
    }

    /// Counts the training views that may show each anchor, from the first need of a rate on.
    pub(in crate::train) fn weigh_views(&mut self) {
        let scene = &mut self.state.learned.scene;
        if scene.context.is_some() {
            scene.anchors.view_weights = view_weights(scene, &self.setup.views.trained_cameras());
        }
    }

    /// The learning rates of this iteration.
    ///
    /// Masks move only where bits count, and no longer once the integer model decides: what is left then learns to do
    /// without the rest. A mask has a fixed way to go, from its start to the threshold; so that it comes as
    /// far in a shorter run, its rate is that of [`PUBLISHED_ITERATIONS`] times their ratio, once there is a rate term.
    pub(super) fn rates(&self) -> Rates {
        let factor = match self.setup.config.phase(self.state.iteration) {
            _ if !self.setup.config.backbone.is_coded() || !self.setup.config.modules.learns_masks() => 0.0,
            Phase::Raw | Phase::Noise => 1.0,
            Phase::Context => PUBLISHED_ITERATIONS / f64::from(self.setup.config.iterations),
            Phase::IntegerModel => 0.0,
        };
        Rates { mask: self.setup.config.rates.mask.times(factor), ..self.setup.config.rates }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::modules::{Modules, Rdo};
    use crate::train::test_capture::{tiny_capture, tiny_hac_config};

    #[test]
    fn only_pruning_by_worth_makes_the_context_smaller() {
        let capture = tiny_capture();
        let mut config = tiny_hac_config(60);
        config.hac.lambda = 0.004;
        let sized = |modules| {
            let trainer = Trainer::new(&capture, TrainConfig { modules, ..config }).unwrap();
            (trainer.n_to_size_context_for(), trainer.state.learned.scene.anchors.len())
        };
        let (n, n_anchors) = sized(Modules { rdo: Some(Rdo::default()), ..Modules::default() });
        assert_eq!(n, n_anchors / 2);
        let (n, n_anchors) = sized(Modules::default());
        assert_eq!(n, n_anchors);
    }
}
