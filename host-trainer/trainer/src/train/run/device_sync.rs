//! Steps of a scene that stays on a device: what is there, what is here, and when it comes back.

use std::sync::PoisonError;

use super::learned::Learned;
use super::residence::Residence;
use super::trainer::Trainer;
use super::watchdog;
use crate::train::density::Statistics;
use crate::train::error::{Cause, TrainError};
use crate::train::optimiser::Optimiser;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::coding::Coding;
use pocketsplat_kernels::step::{
    ContextMoments, ContextMomentsMut, DeviceFault, LoadNumber, Loss, Phase, Resident, StepReport, TargetView, Trained,
    TrainedMut, Workspace,
};

impl Trainer<'_> {
    /// Whether a device has this step as a whole; the gradients of poses are found here.
    pub(super) fn steps_on_device(&self, loss: &Loss<'_, f32>, coding: &Coding<'_, f32>) -> bool {
        let can_step = |device: &mut dyn Resident<f32>| device.can_step(&self.state.learned.scene, loss, coding);
        !self.setup.config.refine_poses && self.on_device(can_step).unwrap_or(false)
    }

    /// What `f` says of the device, where there is one.
    fn on_device<T>(&self, f: impl FnOnce(&mut dyn Resident<f32>) -> T) -> Option<T> {
        let device = self.machine.device.workspace.device()?;
        Some(f(device.lock().unwrap_or_else(PoisonError::into_inner).resident()))
    }

    /// What `f` says of it while it holds this run's scene.
    fn on_own<T>(
        &self,
        f: impl FnOnce(&mut dyn Resident<f32>) -> Result<T, DeviceFault>,
    ) -> Result<(T, LoadNumber), TrainError> {
        let own = self.machine.device.residence.load().expect("it was brought there");
        let asked = |device: &mut dyn Resident<f32>| {
            let is_own = device.held() == Some(own);
            if is_own { Ok((f(device)?, own)) } else { Err(TrainError::SceneReplaced) }
        };
        self.on_device(asked).expect("there is one")
    }

    /// A step there; and what is wrong with it, so that it must not be applied.
    ///
    /// A scene that stands here is brought first.
    pub(super) fn step_on_device(
        &mut self,
        target: &TargetView<'_, f32>,
        loss: &Loss<'_, f32>,
        coding: &Coding<'_, f32>,
    ) -> Result<(StepReport<f32>, Option<Cause>), TrainError> {
        let step = |device: &mut dyn Resident<f32>| {
            let own = self.machine.device.residence.load();
            if own.is_none() || device.held() != own {
                if !self.machine.device.residence.is_here() {
                    return Err(TrainError::SceneReplaced);
                }
                let Learned { scene, optimiser, statistics, .. } = &self.state.learned;
                device.load(&trained(scene, optimiser, statistics))?;
            }
            let found = device.step(target, loss, coding, watchdog::LARGEST_GRADIENT)?;
            Ok((found, device.held().expect("it was loaded")))
        };
        let (found, load) = self.on_device(step).expect("there is one")?;
        if self.machine.device.residence.is_here() {
            self.machine.device.residence = Residence::Both(load);
        }
        self.machine.device.workspace.d_background = found.d_background;
        let is_sound = found.is_sound && found.report.loss.is_finite() && watchdog::sound(&found.d_background);
        let cause = if is_sound { None } else { Some(self.cause(target, loss, coding)?) };
        Ok((found.report, cause))
    }

    /// What went wrong with a step on the device, by the same step here.
    fn cause(
        &mut self,
        target: &TargetView<'_, f32>,
        loss: &Loss<'_, f32>,
        coding: &Coding<'_, f32>,
    ) -> Result<Cause, TrainError> {
        let unknown = Cause { array: "a gradient on the device", anchor: None, value: f32::NAN };
        self.fetch()?;
        if matches!(coding, Coding::Integers { .. }) {
            return Ok(unknown);
        }
        let Learned { scene, background, .. } = &self.state.learned;
        let mut workspace = Workspace::new(&scene.shape);
        let report = workspace.step(scene, target, loss, coding);
        let found = watchdog::inspect(scene, target, *background, &workspace, &report);
        Ok(found.unwrap_or(unknown))
    }

    /// Moves the parameters by the last step's gradients.
    pub(super) fn move_on_device(&mut self, progress: f64) -> Result<(), TrainError> {
        let rates = self.rates();
        let mut steps = self.state.learned.optimiser.next(&rates, progress, self.setup.capture.extent);
        if matches!(self.setup.config.phase(self.state.iteration), Phase::Context | Phase::IntegerModel) {
            steps.context = self.state.learned.optimiser.next_of_context(&rates, progress);
        }
        let ((), load) = self.on_own(|device| device.move_by(&steps))?;
        self.machine.device.residence = Residence::Device(load);
        Ok(())
    }

    /// Adds the last step to the statistics.
    pub(super) fn count_on_device(&mut self) -> Result<(), TrainError> {
        let ((), load) = self.on_own(|device| device.add_statistics())?;
        self.machine.device.residence = Residence::Device(load);
        Ok(())
    }

    /// Copies what is newer on a device; the scene, the moments and the statistics here are then those of this iteration.
    ///
    /// # Errors
    /// [`TrainError::Device`], [`TrainError::SceneReplaced`]: everything here is as it was.
    pub fn fetch(&mut self) -> Result<(), TrainError> {
        if self.machine.device.residence.is_here() {
            return Ok(());
        }
        let mut learned = self.state.learned.clone();
        let Learned { scene, optimiser, statistics, .. } = &mut learned;
        let trained = trained_mut(scene, optimiser, statistics);
        let ((), load) = self.on_own(|device| device.store(trained))?;
        self.state.learned = learned;
        self.machine.device.residence = Residence::Both(load);
        Ok(())
    }

    /// The same, where something here is about to change: the device will be brought everything anew.
    pub(super) fn take_back(&mut self) -> Result<(), TrainError> {
        self.fetch()?;
        self.machine.device.residence = Residence::Host;
        Ok(())
    }
}

/// What a device takes over.
pub fn trained<'a>(
    scene: &'a Scene<f32>,
    optimiser: &'a Optimiser<f32>,
    statistics: &'a Statistics,
) -> Trained<'a, f32> {
    Trained {
        scene,
        moments: [&optimiser.features, &optimiser.log_scales, &optimiser.offsets, &optimiser.mask_logits],
        heads: &optimiser.heads,
        context: optimiser.context.as_ref().map(|moments| ContextMoments {
            rows: &moments.rows,
            networks: moments.networks.each_ref().map(Vec::as_slice),
        }),
        sums: [&statistics.opacity_sum, &statistics.gradient_sum],
        counts: [&statistics.n_views, &statistics.n_drawn],
    }
}

/// What it writes to when it gives that back.
pub fn trained_mut<'a>(
    scene: &'a mut Scene<f32>,
    optimiser: &'a mut Optimiser<f32>,
    statistics: &'a mut Statistics,
) -> TrainedMut<'a, f32> {
    let Optimiser { features, log_scales, offsets, mask_logits, heads, context, .. } = optimiser;
    TrainedMut {
        scene,
        moments: [features, log_scales, offsets, mask_logits],
        heads,
        context: context.as_mut().map(|moments| ContextMomentsMut {
            rows: &mut moments.rows,
            networks: moments.networks.each_mut().map(Vec::as_mut_slice),
        }),
        sums: [&mut statistics.opacity_sum, &mut statistics.gradient_sum],
        counts: [&mut statistics.n_views, &mut statistics.n_drawn],
    }
}
