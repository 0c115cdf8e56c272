//! Training of explicit Gaussians: views one by one, the optimiser, density control.

use std::time::Instant;

use cpu_time::ProcessTime;
use pocketsplat_capture::dataset::Capture;
use pocketsplat_gaussians::{Degree, Gaussians};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::Cloud;
use super::config::CloudConfig;
use super::density::{self, DensityStatistics};
use super::optimiser::CloudOptimiser;
use super::start::initial_cloud;
use super::step::{CloudGradients, step};
use crate::train::error::{Cause, DroppedStep, TrainError};
use crate::train::read_ahead::ReadAhead;
use crate::train::run::checkpoint::CaptureSignature;
use crate::train::run::watchdog::{self, Watchdog};
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::simd::Level;
use pocketsplat_kernels::step::{TargetView, planes};

/// The state of a run: everything the next iteration depends on.
#[derive(Clone, Debug)]
pub struct CloudTrainer<'a> {
    pub(super) config: CloudConfig,
    capture: &'a Capture,
    pub(super) signature: CaptureSignature,
    cameras: Vec<Pinhole<f32>>,
    pub(super) level: Level,
    /// Iterations done.
    pub iteration: u32,
    /// The Gaussians as they stand, normalised frame.
    pub cloud: Cloud<f32>,
    /// Wall-clock seconds spent in iterations.
    pub seconds: f64,
    /// Seconds of processor time spent in iterations, of all threads.
    pub processor_seconds: f64,
    pub(super) watchdog: Watchdog,
    pub(super) optimiser: CloudOptimiser,
    pub(super) statistics: DensityStatistics,
    pub(super) rng: ChaCha8Rng,
    /// Views left of the current pass over the capture, taken from the end.
    pub(super) queue: Vec<u32>,
    photographs: ReadAhead,
}

/// What an iteration gives back.
#[derive(Clone, Debug)]
pub struct CloudOutcome {
    /// The loss.
    pub loss: f64,
    /// Mean squared difference of image and photograph over the pixels that count.
    pub squared_error: f64,
    /// Why the step was not applied, if so.
    pub dropped: Option<DroppedStep>,
}

impl<'a> CloudTrainer<'a> {
    /// Sets up a run.
    ///
    /// # Errors
    /// [`TrainError`] when a setting is out of range or the capture has no view or point.
    pub fn new(capture: &'a Capture, config: CloudConfig) -> Result<Self, TrainError> {
        if capture.points.is_empty() {
            return Err(TrainError::NoPoints);
        }
        let mut trainer = Self::without_cloud(capture, config)?;
        trainer.cloud = initial_cloud(&capture.points);
        trainer.optimiser = CloudOptimiser::new(trainer.cloud.len());
        trainer.statistics = DensityStatistics::new(trainer.cloud.len());
        Ok(trainer)
    }

    /// Everything but the Gaussians and what belongs to them.
    pub(super) fn without_cloud(capture: &'a Capture, config: CloudConfig) -> Result<Self, TrainError> {
        config.validate()?;
        if capture.train.is_empty() {
            return Err(TrainError::NoViews);
        }
        Ok(Self {
            signature: CaptureSignature::of(capture),
            cameras: capture.train.iter().map(|view| Pinhole::new(&view.camera)).collect(),
            level: Level::detect(),
            iteration: 0,
            cloud: Cloud::empty(Degree::Three),
            seconds: 0.0,
            processor_seconds: 0.0,
            watchdog: Watchdog::default(),
            optimiser: CloudOptimiser::default(),
            statistics: DensityStatistics::default(),
            rng: ChaCha8Rng::seed_from_u64(config.seed),
            queue: Vec::new(),
            photographs: ReadAhead::default(),
            config,
            capture,
        })
    }

    /// The configuration.
    pub fn config(&self) -> &CloudConfig {
        &self.config
    }

    /// Whether all iterations are done.
    pub fn is_done(&self) -> bool {
        self.iteration >= self.config.iterations
    }

    /// Steps that were not applied so far.
    pub fn n_dropped(&self) -> u32 {
        self.watchdog.n_dropped
    }

    /// The share of the steps' time that was spent on waiting for photographs, since this process began or took up the run;
    /// `None` where they lie in memory.
    pub fn waited_share(&self) -> Option<f64> {
        self.photographs.waited_share()
    }

    /// Number of training views.
    pub(super) fn n_views(&self) -> usize {
        self.cameras.len()
    }

    /// The Gaussians, normalised frame.
    pub fn gaussians(&self) -> Gaussians {
        self.cloud.clone().into()
    }

    /// One iteration: a view drawn without replacement, a step, the optimiser, density control.
    ///
    /// A step with a loss or gradient that is not finite does nothing of the latter two.
    ///
    /// # Errors
    /// [`TrainError::Diverged`] when more than [`watchdog::MAX_DROPPED_IN_A_ROW`] steps in a row did nothing, and
    /// [`TrainError::Photograph`]; the Gaussians are as they were before them.
    pub fn advance(&mut self) -> Result<CloudOutcome, TrainError> {
        let started = (Instant::now(), ProcessTime::now());
        let outcome = self.iterate();
        let step = started.0.elapsed();
        self.photographs.worked(step);
        self.seconds += step.as_secs_f64();
        self.processor_seconds += started.1.elapsed().as_secs_f64();
        outcome
    }

    fn iterate(&mut self) -> Result<CloudOutcome, TrainError> {
        self.iteration += 1;
        self.cloud.degree = self.degree();
        if self.queue.is_empty() {
            self.queue = (0u32..).take(self.n_views()).collect();
            self.queue.shuffle(&mut self.rng);
        }
        let photograph = self.photographs.photograph(&self.capture.train, self.queue.iter().rev().copied())?;
        let index = self.queue.pop().expect("refilled above") as usize;
        let mask = photograph.mask.as_ref().map(|mask| mask.valid.as_slice());
        let target = TargetView::new(&self.cameras[index], planes(&photograph.image), mask, self.capture.background);
        let gradients = step(self.level, &self.cloud, &target, self.config.dssim);
        let (loss, squared_error) = (f64::from(gradients.loss), gradients.squared_error);
        if let Some(cause) = fault(&gradients) {
            let dropped =
                DroppedStep { iteration: self.iteration, view: self.capture.train[index].name.clone(), cause };
            return if self.watchdog.dropped() {
                Err(TrainError::Diverged { n: self.watchdog.n_in_a_row, last: dropped })
            } else {
                Ok(CloudOutcome { loss, squared_error, dropped: Some(dropped) })
            };
        }
        self.watchdog.passed();
        let progress = f64::from(self.iteration) / f64::from(self.config.iterations);
        let at = [progress, self.capture.extent];
        self.optimiser.apply(self.level, &mut self.cloud, &gradients, &self.config.rates, at);
        self.control_density(&gradients);
        Ok(CloudOutcome { loss, squared_error, dropped: None })
    }

    /// The degree that this iteration draws.
    fn degree(&self) -> Degree {
        let every = self.config.iteration_at(self.config.degree_every).max(1);
        let reached = (self.iteration / every) as usize;
        Degree::ALL[reached.min(Degree::ALL.len() - 1)]
    }

    fn control_density(&mut self, gradients: &CloudGradients<f32>) {
        let settings = self.config.density;
        if self.iteration >= self.config.iteration_at(settings.until) {
            return;
        }
        self.statistics.add(gradients);
        let every = self.config.iteration_at(settings.reset_every).max(1);
        let Self { cloud, optimiser, statistics, rng, .. } = self;
        if self.iteration.is_multiple_of(settings.interval) && self.iteration > self.config.iteration_at(settings.from)
        {
            let prunes_large = self.iteration > every;
            density::control(cloud, optimiser, statistics, &settings, self.capture.extent, prunes_large, rng);
        }
        if self.iteration.is_multiple_of(every) {
            density::reset_opacities(cloud, optimiser, &settings);
        }
    }
}

/// Why gradients may not be applied.
fn fault(gradients: &CloudGradients<f32>) -> Option<Cause> {
    let CloudGradients { loss, stored, harmonics, screen, .. } = gradients;
    let sound = |values: &[f32]| watchdog::sound(values);
    let all_sound = stored.iter().all(|d| {
        sound(&d.centre) & sound(&d.log_scale) & sound(&d.rotation) & sound(std::slice::from_ref(&d.opacity_logit))
    }) && sound(harmonics.as_flattened().as_flattened())
        && sound(screen);
    if !loss.is_finite() {
        return Some(Cause { array: "the loss", anchor: None, value: *loss });
    }
    (!all_sound).then_some(Cause { array: "a gradient", anchor: None, value: f32::NAN })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::train::test_capture::tiny_capture;

    /// With all that density control does within a few steps.
    pub(crate) fn tiny_cloud_config(iterations: u32) -> CloudConfig {
        let mut config = CloudConfig { iterations, ..CloudConfig::default() };
        config.density.interval = 5;
        config.density.reset_every = 0.3;
        config.density.gradient_threshold = 1e-4;
        config
    }

    fn trained(config: CloudConfig, threads: usize) -> (Cloud<f32>, Vec<f64>) {
        let capture = tiny_capture();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut trainer = CloudTrainer::new(&capture, config).unwrap();
            let mut errors = Vec::new();
            while !trainer.is_done() {
                errors.push(trainer.advance().unwrap().squared_error);
            }
            (trainer.cloud, errors)
        })
    }

    #[test]
    fn a_run_learns_and_does_not_depend_on_the_number_of_threads() {
        let (cloud, errors) = trained(tiny_cloud_config(150), 1);
        let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
        assert!(
            mean(&errors[140..]) < 0.5 * mean(&errors[..10]),
            "{} to {}",
            mean(&errors[..10]),
            mean(&errors[140..])
        );
        assert!(cloud.len() > 350, "{} Gaussians of 300", cloud.len());
        assert_eq!(cloud.degree, Degree::Three);
        let (again, _) = trained(tiny_cloud_config(150), 3);
        assert!(again == cloud, "the same bits");
    }

    #[test]
    fn degrees_rise_by_shares_of_the_run() {
        let capture = tiny_capture();
        let mut trainer =
            CloudTrainer::new(&capture, CloudConfig { iterations: 300, ..CloudConfig::default() }).unwrap();
        let mut degrees = Vec::new();
        for iteration in [1, 9, 10, 20, 29, 30, 300] {
            trainer.iteration = iteration;
            degrees.push(trainer.degree().number());
        }
        assert_eq!(degrees, [0, 0, 1, 2, 2, 3, 3]);
    }
}
