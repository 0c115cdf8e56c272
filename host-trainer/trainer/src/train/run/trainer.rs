//! A run on anchors: one iteration after the other.

use std::mem;
use std::time::Instant;

use cpu_time::ProcessTime;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::checkpoint::{CaptureSignature, Kernels};
use super::observer::{Observer, Outcome};
use super::residence::Residence;
use super::watchdog::{self, Watchdog};
use crate::train::TrainConfig;
use crate::train::config::Rates;
use crate::train::context::integers::Integers;
use crate::train::context::phases::coding;
use crate::train::context::start;
use crate::train::density::Statistics;
use crate::train::density::view_weight::view_weights;
use crate::train::error::{Cause, DroppedStep, TrainError};
use crate::train::limits::{Finished, LimitProbe};
use crate::train::modules::RunView;
use crate::train::optimiser::Optimiser;
use crate::train::read_ahead::ReadAhead;
use crate::train::views::{TrainingViews, target};
use crate::train::worth::Probe;
use pocketsplat_capture::dataset::{Capture, Image, View};
use pocketsplat_core::context::Context;
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::rate::noise::Stream;
use pocketsplat_kernels::scene::init::initial_scene;
use pocketsplat_kernels::scene::{Anchors, Heads, Scene};
use pocketsplat_kernels::step::coding::Coding;
use pocketsplat_kernels::step::{
    Loss, Phase, SharedDevice, StepInfo, StepReport, TargetView, Workspace, image_of_planes,
};

/// Length of the published runs, iterations.
const PUBLISHED_ITERATIONS: f64 = 30_000.0;

/// The state of a run: everything the next iteration depends on.
#[derive(Clone, Debug)]
pub struct Trainer<'a> {
    pub(in crate::train) config: TrainConfig,
    pub(in crate::train) capture: &'a Capture,
    pub(in crate::train) signature: CaptureSignature,
    pub(in crate::train) views: TrainingViews<'a>,
    pub(in crate::train) background: [f32; 3],
    /// Iterations done.
    pub iteration: u32,
    /// The scene as it stands; on a device, as it stood when [`Self::fetch`] was called last.
    pub scene: Scene<f32>,
    /// Wall-clock seconds spent in iterations.
    pub seconds: f64,
    /// Seconds of processor time spent in iterations, of all threads: what does not depend on what else the machine does.
    pub processor_seconds: f64,
    /// λ: weight of a value's bits in the loss, as configured until [a scene that has to fit](crate::train::limits) asks for another.
    pub(in crate::train) lambda: f64,
    pub(in crate::train) limits: Option<LimitProbe<'a>>,
    pub(in crate::train) watchdog: Watchdog,
    pub(in crate::train) optimiser: Optimiser<f32>,
    pub(in crate::train) statistics: Statistics,
    pub(in crate::train) rng: ChaCha8Rng,
    /// Views left of the current pass over the capture, taken from the end.
    pub(in crate::train) queue: Vec<u32>,
    pub(in crate::train) workspace: Workspace<f32>,
    pub(super) residence: Residence,
    pub(in crate::train) photographs: ReadAhead,
}

impl<'a> Trainer<'a> {
    /// Sets up a run.
    ///
    /// # Errors
    /// [`TrainError`] when a setting is out of range or the capture has no view or point.
    pub fn new(capture: &'a Capture, config: TrainConfig) -> Result<Self, TrainError> {
        if capture.points.is_empty() {
            return Err(TrainError::NoPoints);
        }
        config.check_voxel_size(capture)?;
        let mut trainer = Self::without_scene(capture, config)?;
        let shape = trainer.config.shape;
        trainer.scene = initial_scene(shape, trainer.scene.voxel_size, &capture.points, &mut trainer.rng);
        trainer.optimiser = Optimiser::new(&trainer.scene);
        trainer.statistics = Statistics::new(trainer.scene.anchors.len(), shape.n_offsets);
        Ok(trainer)
    }

    /// Everything but anchors and what belongs to them.
    pub(super) fn without_scene(capture: &'a Capture, config: TrainConfig) -> Result<Self, TrainError> {
        config.validate()?;
        if capture.train.is_empty() {
            return Err(TrainError::NoViews);
        }
        let config = config.resolved_for(capture);
        let heads = Heads::filled(&config.shape, 0.0);
        let voxel_size = config.voxel_size_for(capture);
        let scene = Scene { shape: config.shape, voxel_size, anchors: Anchors::default(), heads, context: None };
        Ok(Self {
            signature: CaptureSignature::of(capture),
            views: TrainingViews::new(&capture.train, |place| config.holds_out(place, capture.train.len())),
            background: capture.background,
            iteration: 0,
            seconds: 0.0,
            processor_seconds: 0.0,
            lambda: config.hac.lambda,
            limits: None,
            watchdog: Watchdog::default(),
            optimiser: Optimiser::new(&scene),
            statistics: Statistics::default(),
            workspace: Workspace::new(&config.shape),
            residence: Residence::Host,
            photographs: ReadAhead::default(),
            queue: Vec::new(),
            rng: ChaCha8Rng::seed_from_u64(config.seed),
            config,
            capture,
            scene,
        })
    }

    /// The configuration, resolved for the capture.
    pub fn config(&self) -> &TrainConfig {
        &self.config
    }

    /// The cameras of the training views, held out or not.
    pub fn cameras(&self) -> &[Pinhole<f32>] {
        &self.views.cameras
    }

    /// The training views that are held out: nothing of the scene follows from them, so it can be measured with them.
    pub fn validation_views(&self) -> impl Iterator<Item = &'a View> + use<'a> {
        let (config, views) = (self.config, &self.capture.train);
        views.iter().enumerate().filter(move |(i, _)| config.holds_out(*i, views.len())).map(|(_, view)| view)
    }

    /// Whether all iterations are done.
    pub fn is_done(&self) -> bool {
        self.iteration >= self.config.iterations
    }

    /// Steps that were not applied so far.
    pub fn n_dropped(&self) -> u32 {
        self.watchdog.n_dropped
    }

    /// What this run is computed with.
    pub fn kernels(&self) -> Kernels {
        let kernels = Kernels::of_this_machine(self.workspace.level());
        match self.workspace.device_name() {
            None => kernels,
            Some(device) => Kernels { description: format!("{} with {device}", kernels.description), ..kernels },
        }
    }

    /// Has steps computed by `device`, or on the CPU again; between runs, or after [`Self::fetch`].
    ///
    /// A device holds the scene of one run at a time.
    pub fn set_device(&mut self, device: Option<SharedDevice<f32>>) {
        self.workspace.set_device(device);
    }

    /// Runs to the last iteration.
    ///
    /// # Errors
    /// [`TrainError::Diverged`], see [`Self::advance`].
    pub fn run(&mut self, observer: &mut impl Observer) -> Result<(), TrainError> {
        while !self.is_done() {
            self.observed_advance(observer)?;
        }
        Ok(())
    }

    /// [`Self::advance`], and tells `observer`.
    pub(super) fn observed_advance(&mut self, observer: &mut impl Observer) -> Result<Outcome, TrainError> {
        let outcome = self.advance()?;
        if let Some(dropped) = &outcome.dropped {
            observer.dropped(dropped);
        }
        if let Some(fit) = &outcome.fit {
            observer.fitted(fit);
        }
        observer.step(self.iteration, &outcome.report, &self.scene);
        Ok(outcome)
    }

    /// One iteration: a view drawn without replacement, a step, the optimiser, statistics, growth and pruning.
    ///
    /// A step with a loss or gradient that is not finite does nothing of the latter four. Events of modules come all the same.
    ///
    /// # Errors
    /// [`TrainError::Diverged`] when more than [`watchdog::MAX_DROPPED_IN_A_ROW`] steps in a row did nothing, and
    /// [`TrainError::Photograph`]; the scene is as it was before them.
    pub fn advance(&mut self) -> Result<Outcome, TrainError> {
        let started = (Instant::now(), ProcessTime::now());
        let outcome = self.iterate();
        let step = started.0.elapsed();
        self.photographs.worked(step);
        self.seconds += step.as_secs_f64();
        self.processor_seconds += started.1.elapsed().as_secs_f64();
        outcome
    }

    fn iterate(&mut self) -> Result<Outcome, TrainError> {
        self.iteration += 1;
        let phase = self.config.phase(self.iteration);
        self.begin_context()?;
        if self.queue.is_empty() {
            self.queue.clone_from(&self.views.trained);
            self.queue.shuffle(&mut self.rng);
        }
        let photograph = self.photographs.photograph(self.views.all, self.queue.iter().rev().copied())?;
        let index = self.queue.pop().expect("refilled above") as usize;
        let camera = self.views.cameras[index];
        let target = target(&photograph, &camera, self.background).numbered(index);
        let (modules, at) = (self.config.modules, self.step_info());
        let pruned_share = modules.each().iter().map(|module| module.pruned_share(&at)).fold(0.0, f32::max);
        let terms = modules.terms();
        let loss = Loss { weights: self.config.loss, modules: Some((&terms, &at)), pruned_share };
        let coding = self.coding(None);
        let on_device = self.steps_on_device(&loss, &coding);
        let stepped = match phase {
            _ if on_device => self.step_on_device(&target, &loss, &coding),
            Phase::IntegerModel => self.step_on_integers(&target, &loss),
            Phase::Raw | Phase::Noise | Phase::Context => self.step_here(&target, &loss, &coding),
        };
        let (report, cause) = stepped?;
        let name = || self.capture.train[index].name.clone();
        let dropped = cause.map(|cause| DroppedStep { iteration: self.iteration, view: name(), cause });
        match dropped {
            Some(last) if self.watchdog.dropped() => {
                return Err(TrainError::Diverged { n: self.watchdog.n_in_a_row, last });
            }
            Some(_) => {}
            None => {
                self.watchdog.passed();
                self.follow_gradients(on_device)?;
                self.densify(on_device)?;
            }
        }
        // Events come once, so a dropped step does not put them off.
        if self.ends_growth() || self.is_done() || modules.each().iter().any(|module| module.is_due(&at)) {
            self.take_back()?;
        }
        self.keep_the_best();
        self.rank_for_levels();
        let mut fit = None;
        for module in modules.each() {
            if let Some(change) = module.event(&at, &self.view())? {
                fit = self.change_anchors(change).or(fit);
            }
        }
        Ok(Outcome { report, dropped, fit })
    }

    /// Moves the parameters along the gradients of the step.
    fn follow_gradients(&mut self, on_device: bool) -> Result<(), TrainError> {
        // The published loop leaves the parameters of its last iteration as they are.
        if self.iteration < self.config.iterations {
            let progress = f64::from(self.iteration) / f64::from(self.config.iterations);
            if on_device {
                self.move_on_device(progress)?;
            } else {
                let rates = self.rates();
                self.optimiser.apply(&mut self.scene, &self.workspace, &rates, progress, self.capture.extent);
            }
            if self.config.learns_background {
                let rate = self.config.rates.background.at(progress);
                self.optimiser.apply_to_background(&mut self.background, &self.workspace, rate);
            }
        }
        Ok(())
    }

    /// A step of the scene as it stands here, and what is wrong with it.
    fn step_here(
        &mut self,
        target: &TargetView<'_, f32>,
        loss: &Loss<'_, f32>,
        coding: &Coding<'_, f32>,
    ) -> Result<(StepReport<f32>, Option<Cause>), TrainError> {
        self.take_back()?;
        let report = self.workspace.try_step(&self.scene, target, loss, coding)?;
        let cause = watchdog::inspect(&self.scene, target, self.background, &self.workspace, &report);
        Ok((report, cause))
    }

    /// The same on the integers of the context model.
    ///
    /// Drawn with the heads as they are written; the gradients move the weights behind them (straight through).
    fn step_on_integers(
        &mut self,
        target: &TargetView<'_, f32>,
        loss: &Loss<'_, f32>,
    ) -> Result<(StepReport<f32>, Option<Cause>), TrainError> {
        self.take_back()?;
        let integers = Integers::of(&self.scene)?;
        let context = integers.context(&self.scene)?;
        let coding = self.coding(Some((&context, &integers)));
        let behind = mem::replace(&mut self.scene.heads, integers.heads.clone());
        let stepped = self.step_here(target, loss, &coding);
        self.scene.heads = behind;
        stepped
    }

    /// What modules are told of this iteration.
    fn step_info(&self) -> StepInfo {
        let phase = self.config.phase(self.iteration);
        StepInfo {
            iteration: self.iteration,
            iterations: self.config.iterations,
            phase,
            scaled: !self.config.backbone.is_coded() || phase != Phase::Raw,
            stream: Stream::of_run(self.config.seed).branch(self.iteration),
        }
    }

    /// What the steps of this iteration do to the values of anchors.
    fn coding<'c>(&self, exact: Option<(&'c Context<'c>, &'c Integers)>) -> Coding<'c, f32> {
        let TrainConfig { backbone, hac, .. } = &self.config;
        let StepInfo { phase, stream, .. } = self.step_info();
        coding(phase, *backbone, hac, self.lambda, stream, exact)
    }

    /// Makes the context model where this iteration is the first to need it.
    ///
    /// # Errors
    /// [`TrainError`] when the scene is on the GPU and reading it back fails.
    fn begin_context(&mut self) -> Result<(), TrainError> {
        let phase = self.config.phase(self.iteration);
        if self.scene.context.is_none() && matches!(phase, Phase::Context | Phase::IntegerModel) {
            self.take_back()?;
            let TrainConfig { backbone, hac, .. } = &self.config;
            let n = self.n_to_size_context_for();
            let model = start::begin_context(&self.scene, *backbone, n, hac.base_steps(), &mut self.rng);
            self.scene.context = Some(model);
            self.optimiser.begin_context(&self.scene);
            self.weigh_views();
        }
        Ok(())
    }

    /// Anchors to size the context model for: all, or as many as rate–distortion pruning is expected to leave.
    fn n_to_size_context_for(&self) -> usize {
        let n = self.scene.anchors.len();
        if self.config.modules.weigh_bits() { start::n_to_size_for(n, self.lambda) } else { n }
    }

    /// Counts the training views that may show each anchor, from the first need of a rate on.
    pub(in crate::train) fn weigh_views(&mut self) {
        if self.scene.context.is_some() {
            self.scene.anchors.view_weights = view_weights(&self.scene, &self.views.trained_cameras());
        }
    }

    /// The run as modules see it.
    pub(in crate::train) fn view(&self) -> RunView<'_> {
        let probe = Probe {
            scene: &self.scene,
            views: &self.views,
            photographs: &self.photographs,
            background: self.background,
            loss: self.config.loss,
            lambda: self.lambda,
            seed: self.config.seed,
            iteration: self.iteration,
        };
        RunView { probe, limits: self.limits }
    }

    /// The same; rate–distortion pruning then leaves as much as `limits` says fits, and weighs bits accordingly.
    #[must_use]
    pub fn fitting(self, limits: Option<LimitProbe<'a>>) -> Self {
        Self { limits, ..self }
    }

    /// The scene as it stands, for the writer of bundles; see [`Finished::of`].
    ///
    /// # Errors
    /// As [`Finished::of`].
    pub fn finish(&self) -> Result<Finished, TrainError> {
        Finished::of(self.scene.clone(), &self.views.trained_cameras(), self.background)
    }

    /// The share of the steps' time that was spent on waiting for photographs, since this process began or took up the run;
    /// `None` where they lie in memory.
    pub fn waited_share(&self) -> Option<f64> {
        self.photographs.waited_share()
    }

    /// The learning rates of this iteration.
    ///
    /// Masks move only where bits count, and no longer once the integer model decides: what is left then learns to do
    /// without the rest. A mask has a fixed way to go, from its start to the threshold; so that it comes as
    /// far in a shorter run, its rate is that of [`PUBLISHED_ITERATIONS`] times their ratio, once there is a rate term.
    pub(super) fn rates(&self) -> Rates {
        let factor = match self.config.phase(self.iteration) {
            _ if !self.config.backbone.is_coded() || !self.config.modules.learns_masks() => 0.0,
            Phase::Raw | Phase::Noise => 1.0,
            Phase::Context => PUBLISHED_ITERATIONS / f64::from(self.config.iterations),
            Phase::IntegerModel => 0.0,
        };
        Rates { mask: self.config.rates.mask.times(factor), ..self.config.rates }
    }

    /// What it trains on.
    pub fn capture(&self) -> &'a Capture {
        self.capture
    }

    /// The current scene's image of a view, 8 bit.
    ///
    /// # Errors
    /// As [`Self::fetch`].
    pub fn draw(&mut self, view: &View) -> Result<Image, TrainError> {
        self.fetch()?;
        let camera = Pinhole::new(&view.camera);
        let planes = self.workspace.image(&self.scene, &camera, self.background);
        Ok(image_of_planes(&planes, camera.size_px))
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
            (trainer.n_to_size_context_for(), trainer.scene.anchors.len())
        };
        let (n, n_anchors) = sized(Modules { rdo: Some(Rdo::default()), ..Modules::default() });
        assert_eq!(n, n_anchors / 2);
        let (n, n_anchors) = sized(Modules::default());
        assert_eq!(n, n_anchors);
    }
}
