//! The steps that come after training: stages of some length each, a training view a step.

use pocketsplat_capture::dataset::View;
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::simd::Level;
use pocketsplat_trainer::explicit::Cloud;
use pocketsplat_trainer::explicit::optimiser::CloudOptimiser;
use pocketsplat_trainer::explicit::step::{CloudGradients, step};
use pocketsplat_trainer::explicit::train::fault;
use pocketsplat_trainer::train::error::Cause;
use pocketsplat_trainer::train::run::watchdog::MAX_DROPPED_IN_A_ROW;
use pocketsplat_trainer::train::views::target;
use pocketsplat_trainer::train::{DroppedStep, TrainError};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use crate::baseline::TrainedScene;

/// Iterations of the published run of 3D Gaussian Splatting, which methods count theirs beside.
const PUBLISHED_ITERATIONS: u64 = 30_000;

/// The first stage's stream of random numbers; those of training lie far below.
const FIRST_STREAM: u64 = 1 << 48;

/// The stages of a scene.
pub(crate) struct Tuning<'a> {
    pub(crate) scene: &'a TrainedScene<'a>,
    pub(crate) level: Level,
    /// Of the training views.
    pub(crate) cameras: Vec<Pinhole<f32>>,
    n_stages: u64,
    n_steps: u32,
}

/// One step of a stage.
pub(crate) struct Turn<'a> {
    pub(crate) scene: &'a TrainedScene<'a>,
    pub(crate) level: Level,
    pub(crate) view: &'a View,
    pub(crate) camera: &'a Pinhole<f32>,
    /// Share of the learning rates' path that is behind.
    progress: f64,
}

impl<'a> Tuning<'a> {
    /// * errors: a capture without training views.
    pub(crate) fn new(scene: &'a TrainedScene<'a>) -> Result<Self, TrainError> {
        if scene.capture.train.is_empty() {
            return Err(TrainError::NoViews);
        }
        let cameras = scene.capture.train.iter().map(|view| Pinhole::new(&view.camera)).collect();
        Ok(Self { scene, level: Level::detect(), cameras, n_stages: 0, n_steps: 0 })
    }

    /// The Gaussians as the optimiser takes them.
    pub(crate) fn cloud(&self) -> Cloud<f32> {
        Cloud::with_room(self.scene.gaussians)
    }

    /// The random numbers of the next stage.
    pub(crate) fn random(&mut self) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.scene.config.seed);
        rng.set_stream(FIRST_STREAM + self.n_stages);
        self.n_stages += 1;
        rng
    }

    /// Steps of a stage.
    ///
    /// * `published`: beside a run of 30,000 iterations; a shorter run has stages that are shorter by as much.
    pub(crate) fn length(&self, published: u32) -> u32 {
        let n = u64::from(published) * u64::from(self.scene.config.iterations) / PUBLISHED_ITERATIONS;
        u32::try_from(n).unwrap_or(u32::MAX)
    }

    /// The rate of values that have some way to go, as masks have: η·√(published steps / steps) in a run that is shorter, else η.
    ///
    /// In t steps of Adam a steady push moves a value by η·t, and gradients of either sign by about η·√t. The root leaves the second as it
    /// was published: with as much as would keep the first, chance turns off what is useful.
    ///
    /// * `published`: η.
    pub(crate) fn hurried(&self, published: f64) -> f64 {
        let shorter = PUBLISHED_ITERATIONS as f64 / f64::from(self.scene.config.iterations);
        published * shorter.max(1.0).sqrt()
    }

    /// A stage: `step` for one training view after the other, each once in a pass, until so many are done. Rates go on where the run
    /// and the stages before ended.
    ///
    /// * `published`: see [`Self::length`]. * `step`: moves something, or says why not.
    pub(crate) fn stage(
        &mut self,
        published: u32,
        mut step: impl FnMut(&Turn<'_>, &mut ChaCha8Rng) -> Result<Option<Cause>, TrainError>,
    ) -> Result<(), TrainError> {
        let mut rng = self.random();
        let TrainedScene { capture, config, .. } = self.scene;
        let n = self.length(published);
        let (mut queue, mut n_in_a_row) = (Vec::new(), 0);
        for _ in 0..n {
            if queue.is_empty() {
                queue.extend(0..self.cameras.len());
                queue.shuffle(&mut rng);
            }
            let place = queue.pop().unwrap_or_default();
            self.n_steps += 1;
            let iteration = config.iterations.saturating_add(self.n_steps);
            let (view, camera) = (&capture.train[place], &self.cameras[place]);
            let turn =
                Turn { scene: self.scene, level: self.level, view, camera, progress: config.progress_at(iteration) };
            let cause = step(&turn, &mut rng)?;
            n_in_a_row = if cause.is_some() { n_in_a_row + 1 } else { 0 };
            if let Some(cause) = cause.filter(|_| n_in_a_row > MAX_DROPPED_IN_A_ROW) {
                let last = DroppedStep { iteration, view: view.name.clone(), cause };
                return Err(TrainError::Diverged { n: n_in_a_row, last });
            }
        }
        Ok(())
    }
}

impl Turn<'_> {
    /// Gradients of the published loss of the view's photograph.
    pub(crate) fn gradients(&self, cloud: &Cloud<f32>) -> Result<CloudGradients<f32>, TrainError> {
        let photograph = self.view.photograph()?;
        let target = target(&photograph, self.camera, self.scene.capture.background);
        Ok(step(self.level, cloud, &target, self.scene.config.dssim))
    }

    /// Moves a cloud, or says why its gradients may not.
    pub(crate) fn apply(
        &self,
        optimiser: &mut CloudOptimiser,
        cloud: &mut Cloud<f32>,
        gradients: &CloudGradients<f32>,
    ) -> Option<Cause> {
        let cause = fault(gradients);
        if cause.is_none() {
            let at = [self.progress, self.scene.capture.extent];
            optimiser.apply(self.level, cloud, gradients, &self.scene.config.rates, at);
        }
        cause
    }
}

/// Some rows of a cloud, in the order in which they are named.
pub(crate) fn picked(cloud: &Cloud<f32>, rows: impl IntoIterator<Item = usize>) -> Cloud<f32> {
    let Cloud { degree, compensation, n_coefficients, .. } = *cloud;
    let mut some = Cloud { degree, compensation, n_coefficients, ..Cloud::default() };
    rows.into_iter().for_each(|row| some.push(&cloud.stored(row), cloud.harmonics_of(row)));
    some
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scenes::{capture_of, gaussians, short_config};

    #[test]
    fn a_stage_sees_every_view_once_in_a_pass_and_is_as_long_as_the_run_asks() {
        let gaussians = gaussians(8);
        let (capture, config) = (capture_of(&gaussians, 5), short_config());
        let scene = TrainedScene { gaussians: &gaussians, capture: &capture, config: &config };
        let mut tuning = Tuning::new(&scene).unwrap();
        let mut seen = Vec::new();
        tuning
            .stage(5000, |turn, _| {
                Ok({
                    seen.push(turn.view.name.clone());
                    None
                })
            })
            .unwrap();
        assert_eq!(seen.len(), 10, "of 60 iterations in place of 30,000");
        for pass in seen.chunks_mut(5) {
            pass.sort();
            assert_eq!(pass, ["0", "1", "2", "3", "4"]);
        }
    }

    #[test]
    fn a_stage_that_moves_nothing_ends_with_the_cause() {
        let gaussians = gaussians(8);
        let (capture, mut config) = (capture_of(&gaussians, 2), short_config());
        config.iterations = 30_000;
        let scene = TrainedScene { gaussians: &gaussians, capture: &capture, config: &config };
        let cause = Cause { array: "a gradient", anchor: None, value: f32::NAN };
        let failed = Tuning::new(&scene).unwrap().stage(5000, |_, _| Ok(Some(cause)));
        assert!(matches!(failed, Err(TrainError::Diverged { n: 101, .. })), "{failed:?}");
        let mut nothing = capture.clone();
        nothing.train.clear();
        let scene = TrainedScene { capture: &nothing, ..scene };
        assert!(matches!(Tuning::new(&scene), Err(TrainError::NoViews)));
    }
}
