//! Steps of a scene that stays on the GPU.

use super::anchors::GpuAnchors;
use super::coding::GpuCoding;
use super::image::GpuImage;
use super::ops::adam::Adam;
use super::ops::heads::written::Written;
use super::ops::image::statistics::{Slots, Statistics};
use super::ops::sound::Sound;
use super::scene::DeviceScene;
use super::{Buffer, Commands, Gpu, GpuError};
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::coding::Coding;
use pocketsplat_kernels::step::{
    DeviceFault, GroupSteps, ImageStages, LoadNumber, Loss, Resident, ResidentStep, StepDevice, TargetView, Trained,
    TrainedMut,
};

mod pass;
mod terms;

use terms::{GpuTerms, terms_of};

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
    written: Written,
    sound: Sound,
    statistics: Statistics,
    adam: Adam,
    counters: Buffer<u32>,
    size_px: [usize; 2],
    times_stages: bool,
    scene: Option<DeviceScene>,
    n_loads: u64,
}

impl GpuStep {
    /// Every gradient of the last step by name, features, log-scales, offsets and mask logits of visible anchors, heads, and what the context
    /// model has; to compare with the CPU's.
    ///
    /// # Errors
    /// [`GpuError`].
    ///
    /// # Panics
    /// Before a scene is loaded.
    pub fn gradients(&self) -> Result<Vec<(&'static str, Vec<f32>)>, GpuError> {
        let read = |buffer: &Buffer<f32>| buffer.read(&self.gpu);
        let scene = self.scene.as_ref().expect("loaded");
        let names = ["features", "log-scales", "offsets", "mask logits"];
        let mut all = Vec::new();
        for (name, buffer) in names.into_iter().zip(&self.anchors.gradients) {
            all.push((name, read(buffer)?));
        }
        let heads = scene.heads.iter().map(|head| read(&head.gradient)).collect::<Result<Vec<_>, _>>()?;
        all.push(("heads", heads.concat()));
        let names = match scene.context.as_ref().map(|context| context.networks.len()) {
            Some(1) => vec!["context network", "grid"],
            _ => vec!["network of level 0", "network of level 1", "network of level 2"],
        };
        for (name, buffer) in names.into_iter().zip(scene.context.iter().flat_map(|context| context.gradients())) {
            all.push((name, read(buffer)?));
        }
        Ok(all)
    }

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
            written: Written::new(gpu),
            sound: Sound::new(gpu),
            statistics: Statistics::new(gpu),
            adam: Adam::new(gpu),
            counters: Buffer::zeros(gpu, "counters", 2)?,
            size_px: [0; 2],
            times_stages: false,
            scene: None,
            n_loads: 0,
            gpu: gpu.clone(),
        };
        gpu.check()?;
        Ok(made)
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

    fn forget_photographs(&mut self) {
        self.images.forget_photographs();
    }
}

impl Resident<f32> for GpuStep {
    fn held(&self) -> Option<LoadNumber> {
        self.scene.is_some().then_some(LoadNumber(self.n_loads))
    }

    fn can_step(&self, scene: &Scene<f32>, loss: &Loss<'_, f32>, coding: &Coding<'_, f32>) -> bool {
        let is_known = match coding {
            Coding::Raw | Coding::Noise { .. } => true,
            Coding::Context { exact, .. } => exact.is_none() && scene.context.is_some(),
            // Anchors that follow others give them symbols then, which no kernel makes.
            Coding::Integers { .. } => scene.context.as_ref().is_some_and(|context| context.shifts.is_none()),
        };
        is_known && terms_of(loss, &scene.shape).is_some()
    }

    fn time_stages(&mut self, yes: bool) {
        self.times_stages = yes;
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
