//! Training: one step, the optimiser, growth and pruning, and the loop around them.

pub mod config;
pub mod densify;
pub mod optimiser;
pub mod statistics;
pub mod step;

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

pub use config::TrainConfig;

use crate::dataset::{Capture, Image, View};
use crate::ops::Pinhole;
use crate::scene::Scene;
use crate::scene::init::initial_scene;
use optimiser::Optimiser;
use statistics::Statistics;
use step::{StepReport, Target, Workspace, clear_masked};

/// Hears of every step of a run.
pub trait Observer {
    /// After iteration `iteration` (from 1).
    fn step(&mut self, iteration: u32, report: &StepReport<f32>, scene: &Scene<f32>);
}

/// Why a run can not start.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// A setting is out of range.
    #[error("{0}")]
    Config(String),
    /// No view to train on.
    #[error("the capture has no training view; check that its training split names images that exist")]
    NoViews,
    /// No point to start from.
    #[error("the capture has no point to start from; check its bounds")]
    NoPoints,
}

/// The state of a run: everything the next iteration depends on.
#[derive(Clone, Debug)]
pub struct Trainer<'a> {
    config: TrainConfig,
    capture: &'a Capture,
    cameras: Vec<Pinhole<f32>>,
    background: [f32; 3],
    /// Iterations done.
    pub iteration: u32,
    /// The scene as it stands.
    pub scene: Scene<f32>,
    optimiser: Optimiser<f32>,
    statistics: Statistics,
    rng: ChaCha8Rng,
    /// Views left of the current pass over the capture, taken from the end.
    queue: Vec<usize>,
    workspace: Workspace<f32>,
}

/// Planes `[3, height, width]` of an image, 0 to 1.
pub fn planes(image: &Image) -> Vec<f32> {
    let n = (image.width_px * image.height_px) as usize;
    let mut planes = vec![0.0; 3 * n];
    for (channel, plane) in planes.chunks_exact_mut(n).enumerate() {
        for (out, rgb) in plane.iter_mut().zip(image.rgb.chunks_exact(3)) {
            *out = f32::from(rgb[channel]) / 255.0;
        }
    }
    planes
}

impl<'a> Trainer<'a> {
    /// Sets up a run.
    ///
    /// # Errors
    /// [`TrainError`] when a setting is out of range or the capture has no view or point.
    pub fn new(capture: &'a Capture, config: TrainConfig) -> Result<Self, TrainError> {
        config.validate().map_err(TrainError::Config)?;
        if capture.train.is_empty() {
            return Err(TrainError::NoViews);
        }
        if capture.points.is_empty() {
            return Err(TrainError::NoPoints);
        }
        let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
        let scene = initial_scene(config.shape, config.voxel_size, &capture.points, &mut rng);
        Ok(Self {
            cameras: capture.train.iter().map(|v| Pinhole::new(&v.camera)).collect(),
            background: capture.background,
            iteration: 0,
            optimiser: Optimiser::new(&scene),
            statistics: Statistics::new(scene.anchors.len(), config.shape.n_offsets),
            workspace: Workspace::new(&config.shape),
            queue: Vec::new(),
            config,
            capture,
            scene,
            rng,
        })
    }

    /// Runs to the last iteration.
    pub fn run(&mut self, observer: &mut impl Observer) {
        while self.iteration < self.config.iterations {
            let report = self.advance();
            observer.step(self.iteration, &report, &self.scene);
        }
    }

    /// One iteration: a view drawn without replacement, a step, statistics, growth and pruning, the optimiser.
    pub fn advance(&mut self) -> StepReport<f32> {
        self.iteration += 1;
        if self.queue.is_empty() {
            self.queue = (0..self.cameras.len()).collect();
            self.queue.shuffle(&mut self.rng);
        }
        let view = self.queue.pop().expect("refilled above");
        let View { image, mask, .. } = &self.capture.train[view];
        let mask = mask.as_ref().map(|mask| mask.valid.as_slice());
        let mut truth = planes(image);
        clear_masked(&mut truth, mask);
        let target = Target { camera: &self.cameras[view], truth: &truth, mask, background: self.background };
        let report = self.workspace.step(&self.scene, &target, &self.config.loss);

        let settings = self.config.densification;
        let until = self.config.iteration_at(settings.until);
        // The published loop leaves the parameters of its last iteration as they are.
        if self.iteration < self.config.iterations {
            let progress = f64::from(self.iteration) / f64::from(self.config.iterations);
            self.optimiser.apply(&mut self.scene, &self.workspace, &self.config.rates, progress, self.capture.extent);
        }
        if self.iteration < until && self.iteration > self.config.iteration_at(settings.statistics_from) {
            self.statistics.add(&self.workspace, self.config.shape.n_offsets);
            let due = self.iteration.is_multiple_of(settings.interval);
            if due && self.iteration > self.config.iteration_at(settings.from) {
                let Self { scene, optimiser, statistics, rng, .. } = self;
                densify::grow(scene, optimiser, statistics, &settings, rng);
                densify::prune(scene, optimiser, statistics, &settings);
            }
        }
        report
    }

    /// The current scene's image of a view, 8 bit.
    pub fn draw(&mut self, view: &View) -> Image {
        let camera = Pinhole::new(&view.camera);
        let planes = self.workspace.image(&self.scene, &camera, self.background);
        let n = planes.len() / 3;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0..=1")]
        let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let rgb = (0..n).flat_map(|i| [byte(planes[i]), byte(planes[n + i]), byte(planes[2 * n + i])]).collect();
        Image { width_px: view.camera.width_px, height_px: view.camera.height_px, rgb }
    }
}
