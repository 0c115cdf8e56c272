//! A run on anchors: one iteration after the other.

use super::checkpoint::{CheckpointFault, Kernels};
use super::learned::Learned;
use super::method::{Method, Run};
use super::observer::{Observer, Outcome};
use super::residence::Residence;
use super::state::Setup;
use crate::train::TrainConfig;
use crate::train::density::Statistics;
use crate::train::error::TrainError;
use crate::train::exposures::{ExposureRun, Exposures};
use crate::train::limits::{Finished, LimitProbe};
use crate::train::modules::RunView;
use crate::train::optimiser::Optimiser;
use crate::train::poses::Poses;
use crate::train::streams::{Purpose, random};
use crate::train::views::{halved, target};
use crate::train::worth::Probe;
use pocketsplat_capture::dataset::{Capture, Image, View};
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::scene::init::initial_scene;
use pocketsplat_kernels::scene::{Anchors, Heads, Scene};
use pocketsplat_kernels::step::{Loss, Phase, SharedDevice, Workspace, image_of_planes};

/// Training on anchors.
#[derive(Clone, Copy, Debug)]
pub struct Neural;

/// A run on anchors.
pub type Trainer<'a> = Run<'a, Neural>;

/// Where steps are computed, and where the newest parameters are.
#[derive(Clone, Debug)]
pub struct StepMachine {
    pub(in crate::train) workspace: Workspace<f32>,
    pub(super) residence: Residence,
}

impl Method for Neural {
    type Config = TrainConfig;
    type Learned = Learned;
    type Device = StepMachine;
    type Outcome = Outcome;

    // Like PNG's: a byte that is no text, and line ends that a transfer as text would change.
    const MAGIC: [u8; 8] = *b"\x8bPSRUN\r\n";

    fn length_and_seed(config: &TrainConfig) -> (u32, u64) {
        (config.iterations, config.seed)
    }

    fn resolved(capture: &Capture, config: TrainConfig) -> Result<TrainConfig, TrainError> {
        config.validate()?;
        Ok(config.resolved_for(capture))
    }

    fn holds_out(config: &TrainConfig, place: usize, n: usize) -> bool {
        config.holds_out(place, n)
    }

    fn nothing(capture: &Capture, config: &TrainConfig) -> (Learned, StepMachine) {
        let (shape, heads) = (config.shape, Heads::filled(&config.shape, 0.0));
        let voxel_size = config.voxel_size_for(capture);
        let scene = Scene { shape, voxel_size, anchors: Anchors::default(), heads, context: None };
        let learned = Learned {
            optimiser: Optimiser::new(&scene),
            statistics: Statistics::default(),
            background: capture.background,
            exposures: Exposures::of_views(capture.train.len()),
            poses: Poses::of_views(capture.train.len()),
            lambda: config.hac.lambda,
            scene,
        };
        (learned, StepMachine { workspace: Workspace::new(&shape), residence: Residence::Host })
    }

    fn begin(run: &mut Trainer<'_>) -> Result<(), TrainError> {
        let (Setup { config, capture, .. }, state) = (&run.setup, &mut run.state);
        config.check_voxel_size(capture)?;
        let Learned { scene, optimiser, statistics, .. } = &mut state.learned;
        *scene =
            initial_scene(config.shape, scene.voxel_size, &capture.points, &mut random(config.seed, Purpose::Start, 0));
        *optimiser = Optimiser::new(scene);
        *statistics = Statistics::new(scene.anchors.len(), config.shape.n_offsets);
        Ok(())
    }

    fn restored(run: &mut Trainer<'_>) -> Result<(), CheckpointFault> {
        let Setup { config, capture, .. } = &run.setup;
        run.state.learned.complete(config, config.voxel_size_for(capture), capture.train.len())?;
        for (place, twist) in run.state.learned.poses.twists().enumerate() {
            run.setup.views.move_camera(place, twist);
        }
        Ok(())
    }

    fn iterate(run: &mut Trainer<'_>) -> Result<Outcome, TrainError> {
        run.iterate()
    }

    fn size(learned: &Learned) -> [usize; 2] {
        let anchors = &learned.scene.anchors;
        [anchors.len(), (0..anchors.mask_logits.len()).filter(|offset| anchors.is_drawn(*offset)).count()]
    }

    fn kernels(device: &StepMachine) -> Kernels {
        let kernels = Kernels::of_this_machine(device.workspace.level());
        match device.workspace.device_name() {
            None => kernels,
            Some(device) => Kernels { description: format!("{} with {device}", kernels.description), ..kernels },
        }
    }

    fn fetch(run: &mut Trainer<'_>) -> Result<(), TrainError> {
        run.fetch()
    }

    fn is_here(device: &StepMachine) -> bool {
        device.residence.is_here()
    }
}

impl<'a> Trainer<'a> {
    /// The scene as it stands; on a device, as it stood when [`Self::fetch`] was called last.
    pub fn scene(&self) -> &Scene<f32> {
        &self.state.learned.scene
    }

    /// The cameras of the training views, held out or not, where poses are refined as they stand now.
    pub fn cameras(&self) -> &[Pinhole<f32>] {
        &self.setup.views.cameras
    }

    /// The training views that are held out: no step sees them, so the scene can be measured with them. Starting points that are matched between
    /// photographs, pilots of effects and the choice of a coder take them like any other.
    pub fn validation_views(&self) -> impl Iterator<Item = &'a View> + use<'a> {
        let (config, views) = (self.setup.config, &self.setup.capture.train);
        views.iter().enumerate().filter(move |(i, _)| config.holds_out(*i, views.len())).map(|(_, view)| view)
    }

    /// Has steps computed by `device`, or on the CPU again; between runs, or after [`Self::fetch`].
    ///
    /// A device holds the scene of one run and the photographs of one capture at a time.
    pub fn set_device(&mut self, device: Option<SharedDevice<f32>>) {
        self.machine.device.workspace.set_device(device);
    }

    /// The exposures of all training views, stops of red, green and blue, where they are in force.
    pub fn exposure_stops(&self) -> Option<Vec<[f64; 3]>> {
        self.state.learned.exposures.stops()
    }

    /// How far the cameras of the views that are trained on were turned, degrees, and moved, normalised units, where poses are refined.
    pub fn pose_changes(&self) -> Option<Vec<(&'a View, [f64; 2])>> {
        let changes = || self.state.learned.poses.changes(&self.setup.views);
        self.setup.config.refine_poses.then(changes)
    }

    /// The capture with the cameras of its training views where the run moved them, where poses are refined.
    pub fn refined_capture(&self) -> Option<Capture> {
        let refined = || Capture { train: self.setup.views.moved(), ..self.setup.capture.clone() };
        self.setup.config.refine_poses.then(refined)
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
        if let Some(decided) = &outcome.decided {
            observer.exposed(decided);
        }
        observer.step(self.state.iteration, &outcome.report, &self.state.learned.scene);
        Ok(outcome)
    }

    fn iterate(&mut self) -> Result<Outcome, TrainError> {
        self.begin_context()?;
        let (place, photograph) = self.next_view()?;
        let camera = self.setup.views.cameras[place];
        let half = self.setup.config.is_half_size(self.state.iteration).then(|| halved(&photograph, &camera));
        let (shown, shown_from) =
            half.as_ref().map_or((&*photograph, camera), |(photograph, camera)| (photograph, *camera));
        // A device knows a photograph again by its number, at either size.
        let number = place + if half.is_some() { self.setup.views.all.len() } else { 0 };
        let exposure = self.state.learned.exposures.of_step(place, self.setup.config.exposure);
        let target = target(shown, &shown_from, self.state.learned.background).numbered(number).exposed(exposure);
        let (modules, at) = (self.setup.config.modules, self.step_info());
        let pruned_share = modules.each().iter().map(|module| module.pruned_share(&at)).fold(0.0, f32::max);
        let terms = modules.terms();
        let loss = Loss { weights: self.setup.config.loss, modules: Some((&terms, &at)), pruned_share };
        let coding = self.coding(None);
        let on_device = self.steps_on_device(&loss, &coding);
        let stepped = match at.phase {
            _ if on_device => self.step_on_device(&target, &loss, &coding),
            Phase::IntegerModel => self.step_on_integers(&target, &loss),
            Phase::Raw | Phase::Noise | Phase::Context => self.step_here(&target, &loss, &coding),
        };
        let (report, cause) = stepped?;
        let dropped = self.judge(place, cause)?;
        let mut decided = None;
        if dropped.is_none() {
            if let Some(found) = &report.exposure {
                let TrainConfig { exposure: choice, iterations, .. } = self.setup.config;
                let run = ExposureRun { choice, iterations, n_trained: self.setup.views.trained.len() };
                decided = self.state.learned.exposures.saw(place, found, self.state.iteration, &run);
            }
            if self.setup.config.refine_poses {
                self.refine_pose(place, &shown_from);
            }
            self.follow_gradients(on_device)?;
            self.densify(on_device)?;
        }
        // Events come once, so a dropped step does not put them off.
        if self.ends_growth() || self.is_done() || modules.each().iter().any(|module| module.is_due(&at)) {
            self.take_back()?;
        }
        self.keep_the_best();
        self.rank_for_levels()?;
        let mut fit = None;
        for module in modules.each() {
            if let Some(change) = module.event(&at, &self.view())? {
                fit = self.change_anchors(change).or(fit);
            }
        }
        Ok(Outcome { report, dropped, fit, decided })
    }

    /// Puts all cameras back to where the capture has them.
    pub(super) fn leave_poses(&mut self) {
        let n = self.setup.capture.train.len();
        self.state.learned.poses = Poses::of_views(n);
        (0..n).for_each(|place| self.setup.views.move_camera(place, [0.0; 6]));
    }

    /// Moves the camera of the view as its step says.
    fn refine_pose(&mut self, place: usize, camera: &Pinhole<f32>) {
        let progress = f64::from(self.state.iteration) / f64::from(self.setup.config.iterations);
        let gradient = self.machine.device.workspace.pose_gradient(camera).map(f64::from);
        let twist = self.state.learned.poses.follow(place, gradient, progress);
        self.setup.views.move_camera(place, twist);
    }

    /// The run as modules see it.
    pub(in crate::train) fn view(&self) -> RunView<'_> {
        RunView { probe: self.probe(&self.state.learned.scene), limits: self.setup.limits }
    }

    /// A scene of the run, as far as its views are probed.
    pub(super) fn probe<'s>(&'s self, scene: &'s Scene<f32>) -> Probe<'s> {
        Probe {
            scene,
            views: &self.setup.views,
            exposures: &self.state.learned.exposures,
            photographs: &self.machine.photographs,
            background: self.state.learned.background,
            loss: self.setup.config.loss,
            lambda: self.state.learned.lambda,
            seed: self.setup.config.seed,
            iteration: self.state.iteration,
        }
    }

    /// The same; rate–distortion pruning then leaves as much as `limits` says fits, and weighs bits accordingly. Without a limit of
    /// bytes they weigh what the configuration says, whatever a limit made of it before a fork.
    #[must_use]
    pub fn fitting(mut self, limits: Option<LimitProbe<'a>>) -> Self {
        if !limits.is_some_and(|limits| limits.limits_bytes) {
            self.state.learned.lambda = self.setup.config.hac.lambda;
        }
        self.setup.limits = limits;
        self
    }

    /// The scene as it stands, for the writer of bundles; see [`Finished::of`]. What nobody ranked is ranked by what it is worth.
    ///
    /// # Errors
    /// As [`Finished::of`]; [`TrainError::Photograph`].
    pub fn finish(&self) -> Result<Finished, TrainError> {
        let Learned { scene, background, .. } = &self.state.learned;
        let mut finished = Finished::of(scene.clone(), &self.setup.views.trained_cameras(), *background)?;
        if scene.anchors.prune_rank.is_empty() {
            finished.importance = self.probe(&finished.scene).importance()?;
        }
        Ok(finished)
    }

    /// The current scene's image of a view, 8 bit.
    ///
    /// # Errors
    /// As [`Self::fetch`].
    pub fn draw(&mut self, view: &View) -> Result<Image, TrainError> {
        self.fetch()?;
        let camera = Pinhole::new(&view.camera);
        let planes =
            self.machine.device.workspace.image(&self.state.learned.scene, &camera, self.state.learned.background);
        Ok(image_of_planes(&planes, camera.size_px))
    }
}
