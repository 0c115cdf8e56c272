//! A run of any method: one view after the other, counted, timed and watched.

use std::fmt::Debug;
use std::sync::Arc;
use std::time::Instant;

use cpu_time::ProcessTime;
use pocketsplat_capture::dataset::{Capture, Photograph};
use rand::seq::SliceRandom;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::checkpoint::{CaptureSignature, CheckpointFault, Kernels};
use super::state::{Machine, RunState, Setup};
use super::watchdog::Watchdog;
use crate::train::error::{Cause, DroppedStep, TrainError};
use crate::train::read_ahead::ReadAhead;
use crate::train::streams::{Purpose, random};
use crate::train::views::TrainingViews;

/// What a run trains, and how: anchors, or explicit Gaussians.
pub trait Method: Clone + Debug + Sized {
    /// What a user may set.
    type Config: Clone + Debug + Serialize + DeserializeOwned;
    /// The scene and what belongs to it.
    type Learned: Clone + Debug + Serialize + DeserializeOwned;
    /// What computes steps.
    type Device: Clone + Debug;
    /// What an iteration gives back.
    type Outcome;

    /// The first bytes of its checkpoints.
    const MAGIC: [u8; 8];

    /// Iterations in all, and what everything random follows from.
    fn length_and_seed(config: &Self::Config) -> (u32, u64);

    /// The configuration with nothing left to the capture.
    ///
    /// # Errors
    /// A setting that no run can use.
    fn resolved(capture: &Capture, config: Self::Config) -> Result<Self::Config, TrainError>;

    /// Whether training view `place` of `n` is held out.
    fn holds_out(_config: &Self::Config, _place: usize, _n: usize) -> bool {
        false
    }

    /// A scene of nothing, and what would compute its steps.
    fn nothing(capture: &Capture, config: &Self::Config) -> (Self::Learned, Self::Device);

    /// Makes the scene that a run starts with.
    ///
    /// # Errors
    /// What the capture lacks for one.
    fn begin(run: &mut Run<'_, Self>) -> Result<(), TrainError>;

    /// Completes what a checkpoint has said with what follows from the configuration, and checks that they agree.
    ///
    /// # Errors
    /// The first number that contradicts another.
    fn restored(run: &mut Run<'_, Self>) -> Result<(), CheckpointFault>;

    /// One iteration.
    ///
    /// # Errors
    /// See [`Run::advance`].
    fn iterate(run: &mut Run<'_, Self>) -> Result<Self::Outcome, TrainError>;

    /// Of the scene: its anchors, and the Gaussians that it may draw.
    fn size(learned: &Self::Learned) -> [usize; 2];

    /// What the run is computed with.
    fn kernels(device: &Self::Device) -> Kernels;

    /// Has everything at hand that [`Self::size`] and checkpoints tell of, where it is on a device.
    ///
    /// # Errors
    /// What keeps it there.
    fn fetch(_run: &mut Run<'_, Self>) -> Result<(), TrainError> {
        Ok(())
    }

    /// Whether nothing is newer on a device.
    fn is_here(_device: &Self::Device) -> bool {
        true
    }
}

/// A run.
#[derive(Clone, Debug)]
pub struct Run<'a, M: Method> {
    pub(crate) setup: Setup<'a, M::Config>,
    pub(crate) state: RunState<M::Learned>,
    pub(crate) machine: Machine<M::Device>,
}

impl<'a, M: Method> Run<'a, M> {
    /// Sets up a run.
    ///
    /// # Errors
    /// [`TrainError`] when a setting is out of range or the capture has no view or point.
    pub fn new(capture: &'a Capture, config: M::Config) -> Result<Self, TrainError> {
        if capture.points.is_empty() {
            return Err(TrainError::NoPoints);
        }
        let mut run = Self::without_scene(capture, config)?;
        M::begin(&mut run)?;
        Ok(run)
    }

    /// Everything but the scene and what belongs to it.
    pub(super) fn without_scene(capture: &'a Capture, config: M::Config) -> Result<Self, TrainError> {
        let config = M::resolved(capture, config)?;
        if capture.train.is_empty() {
            return Err(TrainError::NoViews);
        }
        let (learned, device) = M::nothing(capture, &config);
        let n_views = capture.train.len();
        Ok(Self {
            state: RunState {
                iteration: 0,
                watchdog: Watchdog::default(),
                seconds: 0.0,
                processor_seconds: 0.0,
                queue: Vec::new(),
                learned,
            },
            machine: Machine { device, photographs: ReadAhead::default() },
            setup: Setup {
                signature: CaptureSignature::of(capture),
                views: TrainingViews::new(&capture.train, |place| M::holds_out(&config, place, n_views)),
                limits: None,
                config,
                capture,
            },
        })
    }

    /// The configuration, resolved for the capture.
    pub fn config(&self) -> &M::Config {
        &self.setup.config
    }

    /// What it trains on.
    pub fn capture(&self) -> &'a Capture {
        self.setup.capture
    }

    /// Iterations done.
    pub fn iteration(&self) -> u32 {
        self.state.iteration
    }

    /// Iterations in all.
    pub fn iterations(&self) -> u32 {
        M::length_and_seed(&self.setup.config).0
    }

    /// Whether all iterations are done.
    pub fn is_done(&self) -> bool {
        self.iteration() >= self.iterations()
    }

    /// Wall-clock seconds spent in iterations.
    pub fn seconds(&self) -> f64 {
        self.state.seconds
    }

    /// Seconds of processor time spent in iterations, of all threads.
    pub fn processor_seconds(&self) -> f64 {
        self.state.processor_seconds
    }

    /// Steps that were not applied so far.
    pub fn n_dropped(&self) -> u32 {
        self.state.watchdog.n_dropped
    }

    /// What this run is computed with.
    pub fn kernels(&self) -> Kernels {
        M::kernels(&self.machine.device)
    }

    /// The share of the steps' time that was spent on waiting for photographs, since this process began or took up the run;
    /// `None` where they lie in memory.
    pub fn waited_share(&self) -> Option<f64> {
        self.machine.photographs.waited_share()
    }

    /// One iteration: a view drawn without replacement, a step, the optimiser, growth and pruning.
    ///
    /// A step with a loss or gradient that is not finite moves nothing.
    ///
    /// # Errors
    /// [`TrainError::Diverged`] when more than [`MAX_DROPPED_IN_A_ROW`](super::watchdog::MAX_DROPPED_IN_A_ROW) steps in a row did
    /// nothing, and [`TrainError::Photograph`]; the scene is as it was before them.
    pub fn advance(&mut self) -> Result<M::Outcome, TrainError> {
        let started = (Instant::now(), ProcessTime::now());
        self.state.iteration += 1;
        let outcome = M::iterate(self);
        let step = started.0.elapsed();
        self.machine.photographs.worked(step);
        self.state.seconds += step.as_secs_f64();
        self.state.processor_seconds += started.1.elapsed().as_secs_f64();
        outcome
    }

    /// Draws the next view: its place, and its photograph.
    pub(crate) fn next_view(&mut self) -> Result<(usize, Arc<Photograph>), TrainError> {
        let Self { setup, state, machine } = self;
        if state.queue.is_empty() {
            state.queue.clone_from(&setup.views.trained);
            let seed = M::length_and_seed(&setup.config).1;
            state.queue.shuffle(&mut random(seed, Purpose::Views, state.iteration));
        }
        let order = state.queue.iter().rev().copied();
        let photograph = machine.photographs.photograph(setup.views.all, order)?;
        Ok((state.queue.pop().expect("refilled above") as usize, photograph))
    }

    /// Counts the step of view `place`, which is dropped where there is a cause.
    pub(crate) fn judge(&mut self, place: usize, cause: Option<Cause>) -> Result<Option<DroppedStep>, TrainError> {
        let Some(cause) = cause else {
            self.state.watchdog.passed();
            return Ok(None);
        };
        let view = self.setup.views.all[place].name.clone();
        let last = DroppedStep { iteration: self.state.iteration, view, cause };
        if self.state.watchdog.dropped() {
            return Err(TrainError::Diverged { n: self.state.watchdog.n_in_a_row, last });
        }
        Ok(Some(last))
    }
}
