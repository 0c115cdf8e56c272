//! One view through the whole chain, forward and backward.

mod block;
mod buffer;
mod coded;
pub mod coding;
mod context;
mod draw;
pub mod example;
mod exposure;
mod fault;
mod image;
mod loss;
pub mod parents;
mod pose;
mod probe;
mod resident;
pub mod sample;
mod stages;
mod target;

use std::mem;
use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;

use crate::ops::Pinhole;
use crate::ops::image::project::Splat;
use crate::ops::loss::volume;
use crate::ops::simd::Level;
use crate::real::Real;
use crate::scene::{Head, Heads, ModelShape, Scene};
pub use block::Block;
use coded::{Network, Weights};
pub use coding::Phase;
use coding::{Coding, RateReport};
pub use context::ContextGradients;
use draw::SplatsOfView;
pub use exposure::{Exposure, ExposureSums};
pub use fault::DeviceFault;
use image::CpuImage;
pub use image::{ImageLoss, ImageStages, ImageTerm};
pub use loss::{DeviceTerms, ImagePair, Loss, LossWeights, StepInfo, Terms};
use parents::Parents;
pub use probe::ImageError;
pub use resident::{
    ContextMoments, ContextMomentsMut, GroupSteps, LoadNumber, Resident, ResidentStep, StepDevice, Trained, TrainedMut,
};
pub use stages::StageSeconds;
use stages::StageTimer;
pub use target::clear_masked;
pub use target::{TargetView, image_of_planes, planes};

/// What a step gives back, besides the gradients it leaves in the [`Workspace`].
#[derive(Clone, Copy, Debug)]
pub struct StepReport<R> {
    /// The whole loss.
    pub loss: R,
    /// Mean squared difference of image and photograph over the pixels that count, before any rounding.
    pub squared_error: f64,
    /// Gaussians with positive opacity.
    pub n_gaussians: usize,
    /// Of these, what reached the image.
    pub n_splats: usize,
    /// (tile, splat) pairs.
    pub n_pairs: usize,
    /// What the photograph's exposure would be, where the step has one.
    pub exposure: Option<ExposureSums>,
    /// What coding with context cost.
    pub rate: Option<RateReport>,
    /// Where the time went.
    pub stages: StageSeconds,
}

/// A device that several steps use in turns.
pub type SharedDevice<R> = Arc<Mutex<dyn StepDevice<R>>>;

/// Buffers and gradients of a step. Clones share their device.
#[derive(Clone, Debug)]
pub struct Workspace<R> {
    level: Level,
    device: Option<SharedDevice<R>>,
    images: CpuImage<R>,
    blocks: Vec<Block<R>>,
    n_blocks: usize,
    /// dL/d(heads).
    pub d_heads: Heads<R>,
    /// dL/d(background).
    pub d_background: [R; 3],
    /// Which anchors follow which in the last step that asked a context of levels.
    parents: Parents<R>,
    /// dL/d(context model), where the last step asked it.
    pub d_context: Option<ContextGradients<R>>,
}

impl<R: Real> Workspace<R> {
    /// Buffers for models of this shape; the loops run under the widest instruction set of this CPU.
    pub fn new(shape: &ModelShape) -> Self {
        Self::with_level(shape, Level::detect())
    }

    /// As [`Self::new`] with the instruction set chosen.
    pub fn with_level(shape: &ModelShape, level: Level) -> Self {
        let d_heads = Heads::filled(shape, R::ZERO);
        Self {
            level,
            device: None,
            images: CpuImage::new(level),
            blocks: Vec::new(),
            n_blocks: 0,
            d_heads,
            d_background: [R::ZERO; 3],
            parents: Parents::default(),
            d_context: None,
        }
    }

    /// Has [`Self::step`] compute the stages between splats and the loss with `device`, or on the CPU again.
    pub fn set_device(&mut self, device: Option<SharedDevice<R>>) {
        if let Some(device) = &device {
            device.lock().unwrap_or_else(PoisonError::into_inner).forget_photographs();
        }
        self.device = device;
    }

    /// What else than the CPU computes.
    pub fn device(&self) -> Option<&SharedDevice<R>> {
        self.device.as_ref()
    }

    /// What else than the CPU computes, in words.
    pub fn device_name(&self) -> Option<String> {
        self.device.as_ref().map(|device| device.lock().unwrap_or_else(PoisonError::into_inner).name())
    }

    /// The instruction set that the loops run under.
    pub fn level(&self) -> Level {
        self.level
    }

    /// The blocks of visible anchors of the last step, with their gradients; anchors of a level ascend through them.
    pub fn blocks(&self) -> &[Block<R>] {
        &self.blocks[..self.n_blocks]
    }

    /// Loss and gradients of one view.
    ///
    /// The means of L1 and SSIM are over all pixels, those that do not count being equal in both images, so that a view weighs as much
    /// as it shows of the scene; [`StepReport::squared_error`], which makes the PSNR, is over those that count.
    ///
    /// L = (1 − λ)·L1 + λ·(1 − SSIM) + w·mean(s_x·s_y·s_z) (Lu et al. 2024, Scaffold-GS, eq. 10), the terms of modules, and
    /// those of [`RateTerms`](coding::RateTerms) where `coding` has them. Gradients of anchors are left in [`Self::blocks`], those
    /// of the heads in [`Self::d_heads`], of the background in [`Self::d_background`], of the context model in [`Self::d_context`].
    ///
    /// # Panics
    /// Where a [device](Self::set_device) fails, which [`Self::try_step`] gives back.
    pub fn step(
        &mut self,
        scene: &Scene<R>,
        target: &TargetView<'_, R>,
        loss: &Loss<'_, R>,
        coding: &Coding<'_, R>,
    ) -> StepReport<R> {
        self.try_step(scene, target, loss, coding).unwrap_or_else(|fault| panic!("{fault}"))
    }

    /// [`Self::step`], where a device may fail.
    ///
    /// # Errors
    /// [`DeviceFault`]: gradients are then as they happen to be.
    pub fn try_step(
        &mut self,
        scene: &Scene<R>,
        target: &TargetView<'_, R>,
        loss: &Loss<'_, R>,
        coding: &Coding<'_, R>,
    ) -> Result<StepReport<R>, DeviceFault> {
        match self.device.clone() {
            Some(device) => {
                let mut device = device.lock().unwrap_or_else(PoisonError::into_inner);
                self.step_with(device.images(), scene, target, loss, coding)
            }
            None => {
                let mut images = mem::replace(&mut self.images, CpuImage::new(self.level));
                let report = self.step_with(&mut images, scene, target, loss, coding);
                self.images = images;
                report
            }
        }
    }

    fn step_with(
        &mut self,
        images: &mut dyn ImageStages<R>,
        scene: &Scene<R>,
        target: &TargetView<'_, R>,
        loss: &Loss<'_, R>,
        coding: &Coding<'_, R>,
    ) -> Result<StepReport<R>, DeviceFault> {
        let weights = &loss.weights;
        let steps_heads = context::steps_heads(scene, coding);
        let network = context::network(scene, coding, steps_heads.as_deref());
        let SplatsOfView { mut stages, splats, footprints } =
            self.splats_of(scene, target.camera, coding, network, loss.pruned_share);
        let n_splats = splats.len();
        let mut timer = StageTimer::start();
        let n_pairs = images.bin(splats, footprints, target.camera.size_px)?;
        stages.tiles = timer.lap();
        images.draw(target.background)?;
        stages.rasterise = timer.lap();

        let compared = images.compare(target, weights)?;
        let mut by_modules = R::ZERO;
        if let Some((modules, at)) = loss.modules {
            for module in modules {
                if module.is_on_image() {
                    by_modules += images.add_term(target, &mut |pair, d_image| module.on_image(at, pair, d_image))?;
                }
                by_modules += module.on_gaussians(at, scene, &mut self.blocks[..self.n_blocks]);
            }
        }
        images.end_gradient(target)?;
        let n_gaussians = self.blocks().iter().map(|b| b.gaussians.len()).sum();
        let volume_weight = R::real(weights.volume);
        let volumes: R = self.blocks().iter().map(|b| volume::forward(&b.gaussians, volume_weight, n_gaussians)).sum();
        let lambda = R::real(weights.dssim);
        let mut total =
            (R::ONE - lambda) * compared.l1 + lambda * (R::ONE - compared.similarity) + volumes + by_modules;

        stages.loss = timer.lap();
        let (d_splats, d_background) = images.backward()?;
        self.d_background = d_background;
        stages.rasterise_backward = timer.lap();
        self.splats_backward(&scene.shape, target.camera, &d_splats);
        let (level, blocks) = (self.level, self.blocks[..self.n_blocks].par_iter_mut());
        blocks.for_each(|block| block.backward(level, scene, volume_weight, n_gaussians));
        self.sum_head_gradients();
        stages.anchors_backward = timer.lap();
        let rate = match (coding, network) {
            (Coding::Context { rate, .. }, Some(network)) => {
                let (term, report) = self.rate(scene, network, rate);
                total += term;
                Some(report)
            }
            _ => {
                self.d_context = None;
                None
            }
        };
        stages.context_backward = timer.lap();
        if let Some((modules, at)) = loss.modules {
            for module in modules {
                total += module.on_anchors(at, scene, &mut self.blocks[..self.n_blocks]);
            }
        }
        Ok(StepReport {
            loss: total,
            squared_error: compared.squared_sum / (3 * target.n_counted()) as f64,
            n_gaussians,
            n_splats,
            n_pairs,
            exposure: compared.exposure,
            rate,
            stages,
        })
    }

    /// Takes the gradients of all splats back to the Gaussians of their blocks.
    fn splats_backward(&mut self, shape: &ModelShape, camera: &Pinhole<R>, d_splats: &[Splat<R>]) {
        let mut rest = d_splats;
        let mut shares = Vec::with_capacity(self.n_blocks);
        for block in self.blocks() {
            let (share, after) = rest.split_at(block.drawn.len());
            shares.push(share);
            rest = after;
        }
        let blocks = self.blocks[..self.n_blocks].par_iter_mut().zip(shares);
        blocks.for_each(|(block, d_splats)| block.splats_backward(shape, camera, d_splats));
    }

    /// Adds the blocks' gradients of the heads in block order.
    fn sum_head_gradients(&mut self) {
        for group in self.d_heads.each_mut().flat_map(Head::groups_mut) {
            group.fill(R::ZERO);
        }
        for block in &self.blocks[..self.n_blocks] {
            let parts = block.d_heads.each().flat_map(Head::groups);
            for (sums, parts) in self.d_heads.each_mut().flat_map(Head::groups_mut).zip(parts) {
                for (sum, part) in sums.iter_mut().zip(parts) {
                    *sum += *part;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
