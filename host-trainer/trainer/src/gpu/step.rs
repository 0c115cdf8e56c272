//! A step of a scene that stays on the GPU: the list of `step/mod.rs`.

use std::time::Instant;

use super::anchors::GpuAnchors;
use super::coding::{GpuCoding, N_RATE_TOTALS};
use super::context::DeviceContext;
use super::image::GpuImage;
use super::ops::adam::Adam;
use super::ops::sound::Sound;
use super::ops::statistics::{Slots, Statistics};
use super::scene::DeviceScene;
use super::{Bind, Buffer, Commands, Gpu, GpuError};
use crate::scene::Scene;
use crate::step::coding::{Coding, RateTerms};
use crate::step::{
    DeviceFault, DeviceTerms, GroupSteps, ImageStages, Load, Loss, Resident, ResidentStep, StageSeconds, StepDevice,
    StepReport, TargetView, Trained, TrainedMut,
};

mod terms;

use terms::{GpuTerms, HIGH_FREQUENCIES, RATE, terms_of};

/// Places of the counters: gradients that are not sound, and splats.
const UNSOUND: usize = 0;
const SPLATS: usize = 1;

/// A GPU that training runs on: images of splats from the CPU, or whole steps of a scene that it holds.
#[derive(Debug)]
pub struct GpuStep {
    gpu: Gpu,
    images: GpuImage,
    anchors: GpuAnchors,
    coding: GpuCoding,
    terms: GpuTerms,
    sound: Sound,
    statistics: Statistics,
    adam: Adam,
    counters: Buffer<u32>,
    size_px: [usize; 2],
    scene: Option<DeviceScene>,
    n_loads: u64,
}

/// Reads the seconds since the last reading, once the device has come so far.
struct Laps<'g>(&'g Gpu, Instant);

impl Laps<'_> {
    fn lap(&mut self) -> Result<f64, GpuError> {
        self.0.wait()?;
        let now = Instant::now();
        Ok(now.duration_since(std::mem::replace(&mut self.1, now)).as_secs_f64())
    }
}

impl GpuStep {
    /// Compiles all kernels.
    ///
    /// # Errors
    /// [`GpuError`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let made = Self {
            images: GpuImage::new(gpu)?,
            anchors: GpuAnchors::new(gpu)?,
            coding: GpuCoding::new(gpu)?,
            terms: GpuTerms::new(gpu)?,
            sound: Sound::new(gpu),
            statistics: Statistics::new(gpu),
            adam: Adam::new(gpu),
            counters: Buffer::zeros(gpu, "counters", 2)?,
            size_px: [0; 2],
            scene: None,
            n_loads: 0,
            gpu: gpu.clone(),
        };
        gpu.check()?;
        Ok(made)
    }

    fn step_with(
        &mut self,
        target: &TargetView<'_, f32>,
        loss: &Loss<'_, f32>,
        coding: &Coding<'_, f32>,
        limit: f32,
    ) -> Result<ResidentStep<f32>, GpuError> {
        let Self { gpu, images, anchors, scene, .. } = self;
        let (gpu, scene) = (gpu.clone(), scene.as_ref().expect("loaded before"));
        let mut laps = Laps(&gpu, Instant::now());
        let mut stages = StageSeconds::default();
        let camera = target.camera;
        self.size_px = camera.size_px;
        let n = anchors.look(&gpu, scene, camera, loss.pruned_share)?;
        let n_slots = n * scene.shape.n_offsets;
        images.splats.fit(&gpu, n_slots)?;
        images.footprints.fit(&gpu, n_slots)?;

        let (visible, values) = (anchors.visible(), &anchors.values);
        match coding {
            Coding::Raw => {}
            Coding::Noise { stream, steps } => {
                let mut commands = Commands::new(&gpu);
                self.coding.noise(&gpu, &mut commands, scene, visible, values, (*stream, *steps))?;
                commands.submit()?;
            }
            Coding::Context { stream, rate, .. } => {
                self.coding.forward(&gpu, scene, visible, values, *stream, rate)?;
            }
        }
        stages.context = laps.lap()?;
        let mut commands = Commands::new(&gpu);
        anchors.forward(&gpu, &mut commands, scene, camera, &images.splats, &images.footprints)?;
        commands.submit()?;
        stages.anchors = laps.lap()?;
        let n_pairs = images.build(camera.size_px)?;
        stages.tiles = laps.lap()?;
        let mut commands = Commands::new(&gpu);
        images.rasterise(&mut commands, target.background)?;
        commands.submit()?;
        stages.rasterise = laps.lap()?;

        let terms = terms_of(loss, &scene.shape).expect("asked before");
        let mut commands = Commands::new(&gpu);
        images.differ(&mut commands, target, &loss.weights)?;
        if terms.high_pass > 0.0 {
            images.differ_in_detail(&mut commands, target, terms.high_pass, HIGH_FREQUENCIES)?;
        }
        images.mask_gradient(&mut commands, target);
        commands.submit()?;
        stages.loss = laps.lap()?;
        let mut commands = Commands::new(&gpu);
        images.rasterise_backward(&mut commands)?;
        commands.submit()?;
        stages.rasterise_backward = laps.lap()?;
        let mut commands = Commands::new(&gpu);
        self.anchors_backward(&gpu, &mut commands, target, loss, &terms)?;
        commands.submit()?;
        stages.anchors_backward = laps.lap()?;
        let mut commands = Commands::new(&gpu);
        if let Coding::Context { rate, .. } = coding {
            self.coding_backward(&gpu, &mut commands, rate)?;
        }
        let scene = self.scene.as_ref().expect("loaded before");
        self.terms.add_normality(&gpu, &mut commands, &terms, scene, &self.anchors)?;
        self.count(&mut commands, limit);
        commands.submit()?;
        stages.context_backward = laps.lap()?;
        self.report(target, loss, &terms, coding, n_pairs, stages)
    }

    /// From the gradients of the splats to those of the values of the view's anchors and of the heads.
    fn anchors_backward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        target: &TargetView<'_, f32>,
        loss: &Loss<'_, f32>,
        terms: &DeviceTerms,
    ) -> Result<(), GpuError> {
        let Self { images, anchors, .. } = self;
        let (scene, totals) = (self.scene.as_ref().expect("loaded before"), &images.totals);
        commands.clear(&anchors.d_gaussians);
        self.terms.add_opacity_target(gpu, commands, terms, anchors, totals)?;
        anchors.splats_backward(commands, scene, target.camera, &images.footprints, &images.d_splats);
        self.terms.add_volumes(gpu, commands, loss, anchors, totals)?;
        anchors.backward(gpu, commands, scene)
    }

    /// The rate's gradients, and those of the context model.
    fn coding_backward(&mut self, gpu: &Gpu, commands: &mut Commands<'_>, terms: &RateTerms) -> Result<(), GpuError> {
        let Self { images, anchors, coding, .. } = self;
        let scene = self.scene.as_ref().expect("loaded before");
        let (values, gradients, totals) = (&anchors.values, &anchors.gradients, (&images.totals, RATE));
        coding.backward(gpu, commands, scene, anchors.row_of_anchor(), values, gradients, terms, totals)
    }

    /// Counts gradients that are not sound, and splats.
    fn count(&self, commands: &mut Commands<'_>, limit: f32) {
        let scene = self.scene.as_ref().expect("loaded before");
        commands.clear(&self.counters);
        let of_context = scene.context.iter().flat_map(DeviceContext::gradients);
        let arrays = self.anchors.gradients.iter().chain(scene.heads.iter().map(|head| &head.gradient));
        let arrays = arrays.chain(of_context);
        let d_splats = (&self.images.d_splats as &dyn Bind, 9 * self.images.d_splats.len());
        for (values, n_values) in arrays.map(|array| (array as &dyn Bind, array.len())).chain([d_splats]) {
            self.sound.count(commands, values, n_values, limit, &self.counters, UNSOUND);
        }
        self.statistics.count(commands, &self.images.footprints, &self.counters, SPLATS);
    }

    /// Reads what the step found; waits.
    fn report(
        &self,
        target: &TargetView<'_, f32>,
        loss: &Loss<'_, f32>,
        terms: &DeviceTerms,
        coding: &Coding<'_, f32>,
        n_pairs: usize,
        stages: StageSeconds,
    ) -> Result<ResidentStep<f32>, GpuError> {
        let totals = self.images.totals.read(&self.gpu)?;
        let counters = self.counters.read(&self.gpu)?;
        let compared = self.images.loss_of(&totals);
        let (others, n_gaussians) = self.terms.sum(&self.gpu, loss, terms, (&self.images, &self.anchors), &totals)?;
        let lambda = loss.weights.dssim as f32;
        let mut total = (1.0 - lambda) * compared.l1 + lambda * (1.0 - compared.similarity) + others;
        let mut rate = None;
        if let Coding::Context { .. } = coding {
            let scene = self.scene.as_ref().expect("loaded before");
            let found = self.coding.rate(&self.gpu, scene, &totals[RATE..RATE + N_RATE_TOTALS])?;
            total += found.term;
            rate = Some(found.report);
        }
        let report = StepReport {
            loss: total,
            squared_error: compared.squared_sum / (3 * target.n_counted()) as f64,
            n_gaussians,
            n_splats: counters[SPLATS] as usize,
            n_pairs,
            rate,
            stages,
        };
        let d_background = GpuImage::d_background_of(&totals);
        Ok(ResidentStep { report, d_background, is_sound: counters[UNSOUND] == 0 })
    }

    fn move_all(&self, steps: &GroupSteps<f32>) -> Result<(), GpuError> {
        let scene = self.scene.as_ref().expect("loaded before");
        let mut commands = Commands::new(&self.gpu);
        let row_of_anchor = self.anchors.row_of_anchor();
        scene.move_by(&self.adam, &mut commands, steps, row_of_anchor, &self.anchors.gradients);
        commands.submit()
    }

    fn add_view(&self) -> Result<(), GpuError> {
        let scene = self.scene.as_ref().expect("loaded before");
        let slots = Slots {
            anchors: self.anchors.visible(),
            gaussians: &self.anchors.gaussians,
            footprints: &self.images.footprints,
            d_splats: &self.images.d_splats,
        };
        let mut commands = Commands::new(&self.gpu);
        self.statistics.add(&mut commands, self.size_px, slots, scene.sums());
        commands.submit()
    }
}

impl StepDevice<f32> for GpuStep {
    fn name(&self) -> String {
        self.gpu.name.clone()
    }

    fn images(&mut self) -> &mut dyn ImageStages<f32> {
        &mut self.images
    }

    fn resident(&mut self) -> &mut dyn Resident<f32> {
        self
    }
}

impl Resident<f32> for GpuStep {
    fn held(&self) -> Option<Load> {
        self.scene.is_some().then_some(Load(self.n_loads))
    }

    fn can_step(&self, scene: &Scene<f32>, loss: &Loss<'_, f32>, coding: &Coding<'_, f32>) -> bool {
        let is_known = match coding {
            Coding::Raw | Coding::Noise { .. } => true,
            Coding::Context { exact, .. } => exact.is_none() && scene.context.is_some(),
        };
        is_known && terms_of(loss, &scene.shape).is_some()
    }

    fn load(&mut self, trained: &Trained<'_, f32>) -> Result<(), DeviceFault> {
        // The old arrays go first, so that both need not find room.
        self.scene = None;
        self.coding.forget();
        self.n_loads += 1;
        self.scene = Some(DeviceScene::upload(&self.gpu, trained).map_err(DeviceFault::new)?);
        Ok(())
    }

    fn step(
        &mut self,
        target: &TargetView<'_, f32>,
        loss: &Loss<'_, f32>,
        coding: &Coding<'_, f32>,
        limit: f32,
    ) -> Result<ResidentStep<f32>, DeviceFault> {
        self.step_with(target, loss, coding, limit).map_err(DeviceFault::new)
    }

    fn move_by(&mut self, steps: &GroupSteps<f32>) -> Result<(), DeviceFault> {
        self.move_all(steps).map_err(DeviceFault::new)
    }

    fn add_statistics(&mut self) -> Result<(), DeviceFault> {
        self.add_view().map_err(DeviceFault::new)
    }

    fn store(&self, trained: TrainedMut<'_, f32>) -> Result<(), DeviceFault> {
        let scene = self.scene.as_ref().expect("loaded before");
        scene.store(&self.gpu, trained).map_err(DeviceFault::new)
    }
}

#[cfg(test)]
mod tests;
