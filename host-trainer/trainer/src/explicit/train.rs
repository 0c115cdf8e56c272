//! Training of explicit Gaussians: views one by one, the optimiser, density control.

use pocketsplat_capture::dataset::Capture;
use pocketsplat_gaussians::{Degree, Gaussians};
use serde::{Deserialize, Serialize};

use super::Cloud;
use super::config::CloudConfig;
use super::density::{self, DensityStatistics};
use super::optimiser::CloudOptimiser;
use super::start::initial_cloud;
use super::step::{CloudGradients, step};
use crate::train::error::{Cause, DroppedStep, TrainError};
use crate::train::run::checkpoint::envelope::needs;
use crate::train::run::checkpoint::{CheckpointFault, Kernels};
use crate::train::run::watchdog;
use crate::train::run::{Method, Run, RunState, Setup};
use crate::train::streams::{Purpose, random};
use crate::train::views::target;
use pocketsplat_kernels::ops::image::spherical_harmonics::MOST;
use pocketsplat_kernels::ops::simd::Level;

/// Training of explicit Gaussians.
#[derive(Clone, Copy, Debug)]
pub struct Explicit;

/// A run on explicit Gaussians.
pub type CloudTrainer<'a> = Run<'a, Explicit>;

/// The Gaussians and what belongs to them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LearnedCloud {
    /// As they stand, normalised frame.
    #[serde(with = "without_degree")]
    pub cloud: Cloud<f32>,
    /// Their moments.
    pub optimiser: CloudOptimiser,
    /// What density control knows.
    pub statistics: DensityStatistics,
}

/// Gaussians whose degree every iteration sets anew.
mod without_degree {
    use pocketsplat_gaussians::Degree;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::explicit::Cloud;

    pub(super) fn serialize<S: Serializer>(cloud: &Cloud<f32>, serializer: S) -> Result<S::Ok, S::Error> {
        (&cloud.centres, &cloud.log_scales, &cloud.rotations, &cloud.opacity_logits, &cloud.harmonics)
            .serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Cloud<f32>, D::Error> {
        let (centres, log_scales, rotations, opacity_logits, harmonics) = Deserialize::deserialize(deserializer)?;
        let empty = Cloud::empty(Degree::Three);
        Ok(Cloud { centres, log_scales, rotations, opacity_logits, harmonics, ..empty })
    }
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

impl Method for Explicit {
    type Config = CloudConfig;
    type Learned = LearnedCloud;
    type Device = Level;
    type Outcome = CloudOutcome;

    // As the checkpoints of anchors have it, with a letter of its own.
    const MAGIC: [u8; 8] = *b"\x8bPSGRN\r\n";

    fn length_and_seed(config: &CloudConfig) -> (u32, u64) {
        (config.iterations, config.seed)
    }

    fn resolved(_capture: &Capture, config: CloudConfig) -> Result<CloudConfig, TrainError> {
        config.validate()?;
        Ok(config)
    }

    fn nothing(_capture: &Capture, _config: &CloudConfig) -> (LearnedCloud, Level) {
        let learned = LearnedCloud {
            cloud: Cloud::empty(Degree::Three),
            optimiser: CloudOptimiser::default(),
            statistics: DensityStatistics::default(),
        };
        (learned, Level::detect())
    }

    fn begin(run: &mut CloudTrainer<'_>) -> Result<(), TrainError> {
        let Capture { points, point_colours, .. } = run.setup.capture;
        let cloud = initial_cloud(points, point_colours);
        let (optimiser, statistics) = (CloudOptimiser::new(cloud.len()), DensityStatistics::new(cloud.len()));
        run.state.learned = LearnedCloud { cloud, optimiser, statistics };
        Ok(())
    }

    fn restored(run: &mut CloudTrainer<'_>) -> Result<(), CheckpointFault> {
        let LearnedCloud { cloud, optimiser, statistics } = &mut run.state.learned;
        let n = cloud.len();
        needs("log-scales", cloud.log_scales.len(), n)?;
        needs("rotations", cloud.rotations.len(), n)?;
        needs("opacities", cloud.opacity_logits.len(), n)?;
        needs("coefficients", cloud.harmonics.len(), n * MOST)?;
        for (moments, width) in optimiser.each_mut() {
            needs("first moments", moments.first.len(), n * width)?;
            needs("second moments", moments.second.len(), n * width)?;
        }
        let DensityStatistics { gradient_sum, n_drawn } = statistics;
        needs("gradient sums", gradient_sum.len(), n)?;
        needs("drawn counts", n_drawn.len(), n)
    }

    fn iterate(run: &mut CloudTrainer<'_>) -> Result<CloudOutcome, TrainError> {
        run.iterate()
    }

    fn size(learned: &LearnedCloud) -> [usize; 2] {
        [learned.cloud.len(); 2]
    }

    fn kernels(level: &Level) -> Kernels {
        Kernels::of_this_machine(*level)
    }
}

impl CloudTrainer<'_> {
    /// The Gaussians as they stand, in the number type of the operations.
    pub fn cloud(&self) -> &Cloud<f32> {
        &self.state.learned.cloud
    }

    /// The Gaussians, normalised frame.
    pub fn gaussians(&self) -> Gaussians {
        self.cloud().clone().into()
    }

    fn iterate(&mut self) -> Result<CloudOutcome, TrainError> {
        self.state.learned.cloud.degree = self.degree();
        let (place, photograph) = self.next_view()?;
        let Setup { config, capture, views, .. } = &self.setup;
        let target = target(&photograph, &views.cameras[place], capture.background);
        let level = self.machine.device;
        let gradients = step(level, self.cloud(), &target, config.dssim);
        let (rates, at) = (config.rates, [config.progress_at(self.state.iteration), capture.extent]);
        let dropped = self.judge(place, fault(&gradients))?;
        if dropped.is_none() {
            let LearnedCloud { cloud, optimiser, .. } = &mut self.state.learned;
            optimiser.apply(level, cloud, &gradients, &rates, at);
            self.control_density(&gradients);
        }
        Ok(CloudOutcome { loss: f64::from(gradients.loss), squared_error: gradients.squared_error, dropped })
    }

    /// The degree that this iteration draws.
    fn degree(&self) -> Degree {
        let reached = (self.state.iteration / self.setup.config.degree_every) as usize;
        Degree::ALL[reached.min(Degree::ALL.len() - 1)]
    }

    fn control_density(&mut self, gradients: &CloudGradients<f32>) {
        let Setup { config, capture, .. } = &self.setup;
        let RunState { iteration, learned: LearnedCloud { cloud, optimiser, statistics }, .. } = &mut self.state;
        let settings = config.density;
        // Nor after the last step: what comes or is lowered there is never trained.
        if *iteration >= settings.until.min(config.iterations) {
            return;
        }
        statistics.add(gradients);
        if iteration.is_multiple_of(settings.interval) && *iteration > settings.from {
            let prunes_large = *iteration > settings.reset_every;
            let mut rng = random(config.seed, Purpose::Split, *iteration);
            density::control(cloud, optimiser, statistics, &settings, capture.extent, prunes_large, &mut rng);
        }
        if iteration.is_multiple_of(settings.reset_every) {
            density::reset_opacities(cloud, optimiser, &settings);
        }
    }
}

/// Why gradients may not be applied.
pub fn fault(gradients: &CloudGradients<f32>) -> Option<Cause> {
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
mod tests {
    use super::*;
    use crate::train::run::RestoreError;
    use crate::train::test_capture::{many_views, tiny_capture};

    /// With all that density control does within a few steps.
    fn tiny_cloud_config(iterations: u32) -> CloudConfig {
        let mut config = CloudConfig::hurried(iterations);
        config.density.interval = 5;
        config.density.reset_every = 3 * iterations / 10;
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
            (trainer.state.learned.cloud, errors)
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
    fn degrees_rise_by_iterations_however_long_the_run() {
        let capture = tiny_capture();
        for iterations in [2500, 30_000] {
            let config = CloudConfig { iterations, ..CloudConfig::default() };
            let mut trainer = CloudTrainer::new(&capture, config).unwrap();
            let mut degrees = Vec::new();
            for iteration in [1, 999, 1000, 2000, 2999, 3000, 30_000] {
                trainer.state.iteration = iteration;
                degrees.push(trainer.degree().number());
            }
            assert_eq!(degrees, [0, 0, 1, 2, 2, 3, 3]);
        }
    }

    #[test]
    fn a_short_run_is_the_beginning_of_a_long_one() {
        let capture = tiny_capture();
        let after_18 = |iterations| {
            let mut config = CloudConfig { iterations, ..tiny_cloud_config(40) };
            config.density.reset_every = 12;
            let mut trainer = CloudTrainer::new(&capture, config).unwrap();
            (0..18).for_each(|_| drop(trainer.advance().unwrap()));
            trainer.state.learned.cloud
        };
        assert!(after_18(18) == after_18(400), "the same bits");
    }

    #[test]
    fn a_run_ends_with_what_was_trained() {
        let mut config = tiny_cloud_config(40);
        (config.iterations, config.density.interval, config.density.reset_every) = (12, 12, 12);
        let (cloud, _) = trained(config, 1);
        assert_eq!(cloud.len(), 300, "nothing came after the last step");
        assert!(cloud.opacity_logits.iter().any(|logit| *logit > -3.0), "nor were opacities lowered");
        config.iterations = 13;
        let (cloud, _) = trained(config, 1);
        assert!(cloud.len() > 300 && cloud.opacity_logits.iter().all(|logit| *logit < -3.0), "before it they are");
    }

    #[test]
    fn a_restored_run_ends_in_the_same_bits() {
        let capture = tiny_capture();
        let mut whole = CloudTrainer::new(&capture, tiny_cloud_config(40)).unwrap();
        let mut kept = Vec::new();
        while !whole.is_done() {
            if whole.iteration() == 23 {
                whole.save(&mut kept).unwrap();
            }
            whole.advance().unwrap();
        }
        let mut restored = CloudTrainer::restore(&capture, &kept).unwrap().run;
        while !restored.is_done() {
            restored.advance().unwrap();
        }
        assert!(
            restored.cloud() == whole.cloud() && restored.state.learned.optimiser == whole.state.learned.optimiser,
            "the same bits"
        );
    }

    #[test]
    fn damage_and_other_captures_are_refused() {
        let capture = tiny_capture();
        let trainer = CloudTrainer::new(&capture, tiny_cloud_config(40)).unwrap();
        let mut bytes = Vec::new();
        trainer.save(&mut bytes).unwrap();
        let other = many_views(6);
        assert!(matches!(CloudTrainer::restore(&other, &bytes), Err(RestoreError::Capture(_))));
        for at in [0, 9, 500, bytes.len() - 1] {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1;
            assert!(matches!(CloudTrainer::restore(&capture, &damaged), Err(RestoreError::Fault(_))), "byte {at}");
        }
        assert!(matches!(CloudTrainer::restore(&capture, &bytes[..700]), Err(RestoreError::Fault(_))));
    }
}
