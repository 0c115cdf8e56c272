//! Terms of the loss beside the image's: volumes, and what modules add.

use super::super::image::FIRST_FREE_TOTAL;
use super::super::ops::loss::normality::Normality;
use super::super::ops::loss::opacity_target::OpacityTarget;
use super::super::ops::loss::volume::Volume;
use super::super::ops::primitives::gather::Gather;
use super::super::scene::{DeviceScene, FEATURES};
use super::super::{Buffer, Commands, Gpu, GpuError};
use super::{GpuAnchors, GpuImage};
use pocketsplat_kernels::ops::loss::normality::Weights;
use pocketsplat_kernels::ops::loss::opacity_target;
use pocketsplat_kernels::scene::ModelShape;
use pocketsplat_kernels::step::{DeviceTerms, Loss};

/// Places of sums beside the image's: volume and number of Gaussians, opacities, high frequencies, the
/// rate's.
const VOLUME: usize = FIRST_FREE_TOTAL;
const OPACITIES: usize = VOLUME + 2;
pub(super) const HIGH_FREQUENCIES: usize = OPACITIES + 1;
pub(super) const RATE: usize = HIGH_FREQUENCIES + 1;

/// Their kernels.
#[derive(Debug)]
pub(super) struct GpuTerms {
    volume: Volume,
    opacity_target: OpacityTarget,
    normality: Normality,
    gather: Gather,
    raw_features: Buffer<f32>,
}

impl GpuTerms {
    /// Compiles them.
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            volume: Volume::new(gpu)?,
            opacity_target: OpacityTarget::new(gpu)?,
            normality: Normality::new(gpu)?,
            gather: Gather::new(gpu),
            raw_features: Buffer::zeros(gpu, "features of the view", 1)?,
        })
    }

    /// The term on opacities, added to the gradients of the Gaussians.
    pub(super) fn add_opacity_target(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        terms: &DeviceTerms,
        anchors: &GpuAnchors,
        totals: &Buffer<f32>,
    ) -> Result<(), GpuError> {
        let [mean, weight] = terms.opacity_target;
        if weight <= 0.0 {
            return Ok(());
        }
        let (gaussians, d_gaussians) = (&anchors.gaussians, &anchors.d_gaussians);
        let aim = mean * gaussians.len() as f64;
        self.opacity_target.forward_backward(gpu, commands, gaussians, aim, weight, d_gaussians, totals, OPACITIES)
    }

    /// The term on volumes, likewise.
    pub(super) fn add_volumes(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        loss: &Loss<'_, f32>,
        anchors: &GpuAnchors,
        totals: &Buffer<f32>,
    ) -> Result<(), GpuError> {
        let (gaussians, d_gaussians) = (&anchors.gaussians, &anchors.d_gaussians);
        self.volume.forward(gpu, commands, gaussians, totals, VOLUME)?;
        self.volume.backward(commands, gaussians, loss.weights.volume as f32, totals, VOLUME, d_gaussians);
        Ok(())
    }

    /// The term on raw features, added to their gradients.
    pub(super) fn add_normality(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        terms: &DeviceTerms,
        scene: &DeviceScene,
        anchors: &GpuAnchors,
    ) -> Result<(), GpuError> {
        let Some(weights) = normality_of(terms) else { return Ok(()) };
        let Self { normality, gather, raw_features, .. } = self;
        let width = scene.shape.feature_dim;
        raw_features.fit(gpu, anchors.visible().len() * width)?;
        gather.run(commands, &scene.anchors[FEATURES].values, width, anchors.visible(), raw_features);
        normality.forward_backward(gpu, commands, &weights, raw_features, width, &anchors.gradients[FEATURES])
    }

    /// What they add to the loss, by the sums of the step; and how many Gaussians it drew. Waits.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of Gaussians")]
    pub(super) fn sum(
        &self,
        gpu: &Gpu,
        loss: &Loss<'_, f32>,
        terms: &DeviceTerms,
        (images, anchors): (&GpuImage, &GpuAnchors),
        totals: &[f32],
    ) -> Result<(f32, usize), GpuError> {
        let n_slots = anchors.gaussians.len();
        let mut by_modules = terms.high_pass as f32 * totals[HIGH_FREQUENCIES] / images.n_values() as f32;
        let [mean, weight] = terms.opacity_target;
        let aim = (mean * n_slots as f64) as f32;
        by_modules += opacity_target::forward_backward(totals[OPACITIES], n_slots, aim, weight as f32).0;
        if let Some(weights) = normality_of(terms) {
            by_modules += self.normality.moments(gpu)?.term(&weights);
        }
        let n_gaussians = totals[VOLUME + 1];
        let volumes = loss.weights.volume as f32 * totals[VOLUME] / n_gaussians.max(1.0);
        Ok((volumes + by_modules, n_gaussians as usize))
    }
}

/// The terms of all modules, where devices know them.
pub(super) fn terms_of(loss: &Loss<'_, f32>, shape: &ModelShape) -> Option<DeviceTerms> {
    let mut terms = DeviceTerms::default();
    let Some((modules, at)) = loss.modules else { return Some(terms) };
    modules.iter().all(|module| module.on_device(at, shape, &mut terms)).then_some(terms)
}

fn normality_of(terms: &DeviceTerms) -> Option<Weights<f32>> {
    let [divergence, spread] = terms.normality.map(|weight| weight as f32);
    (divergence > 0.0 || spread > 0.0).then_some(Weights { divergence, spread })
}
