//! The stages of a step between splats and the loss, on a GPU.
//!
//! Splats come from the CPU and their gradients go back to it, or both stay; photographs are uploaded once and stay, as 8 bit.

use std::collections::BTreeMap;

use super::ops::image::rasterise::Rasterise;
use super::ops::image::tiles::Tiles;
use super::ops::loss::exposure::{Exposures, N_SUMS};
use super::ops::loss::high_pass::HighPass;
use super::ops::loss::l1::L1;
use super::ops::loss::ssim::Ssim;
use super::ops::loss::target::{ClearMasked, Target};
use super::{Buffer, Commands, Gpu, GpuError};
use pocketsplat_kernels::ops::image::project::{Footprint, Splat};
use pocketsplat_kernels::ops::simd::Level;
use pocketsplat_kernels::step::{DeviceFault, ImageLoss, ImagePair, ImageStages, ImageTerm, LossWeights, TargetView};

/// Places of the sums in [`GpuImage::totals`].
const SIMILARITY: usize = 0;
const DIFFERENCES: usize = 1;
const BACKGROUND: usize = 3;
/// First place of sums that others write.
pub(super) const FIRST_FREE_TOTAL: usize = 6;
/// Those of the exposure come last.
const EXPOSURE: usize = 24;
const N_TOTALS: usize = EXPOSURE + N_SUMS;

/// Kernels and buffers of the stages.
#[derive(Debug)]
pub(super) struct GpuImage {
    gpu: Gpu,
    level: Level,
    tiles: Tiles,
    rasterise: Rasterise,
    ssim: Ssim,
    l1: L1,
    exposures: Exposures,
    high_pass: HighPass,
    clear_masked: ClearMasked,
    size_px: [usize; 2],
    /// Slots of the view, as [`ops`](super::ops) has them, or the splats that the CPU sends.
    pub(super) splats: Buffer<Splat<f32>>,
    pub(super) footprints: Buffer<Footprint<f32>>,
    pub(super) d_splats: Buffer<Splat<f32>>,
    image: Buffer<f32>,
    /// The same under the exposure of its photograph, where that has one.
    shown: Buffer<f32>,
    transmittance: Buffer<f32>,
    d_image: Buffer<f32>,
    /// Sums over the view.
    pub(super) totals: Buffer<f32>,
    /// By their number in the capture.
    photographs: BTreeMap<usize, Target>,
    /// One without a number.
    other: Option<Target>,
}

impl GpuImage {
    /// Compiles all kernels.
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let made = Self {
            level: Level::detect(),
            tiles: Tiles::new(gpu)?,
            rasterise: Rasterise::new(gpu)?,
            ssim: Ssim::new(gpu)?,
            l1: L1::new(gpu)?,
            exposures: Exposures::new(gpu)?,
            high_pass: HighPass::new(gpu)?,
            clear_masked: ClearMasked::new(gpu),
            size_px: [0; 2],
            splats: Buffer::zeros(gpu, "splats", 1)?,
            footprints: Buffer::zeros(gpu, "extents of splats", 1)?,
            d_splats: Buffer::zeros(gpu, "gradients of splats", 1)?,
            image: Buffer::zeros(gpu, "pixels of the image", 1)?,
            shown: Buffer::zeros(gpu, "pixels under an exposure", 1)?,
            transmittance: Buffer::zeros(gpu, "transmittances of the image", 1)?,
            d_image: Buffer::zeros(gpu, "gradients of the image", 1)?,
            totals: Buffer::zeros(gpu, "sums", N_TOTALS)?,
            photographs: BTreeMap::new(),
            other: None,
            gpu: gpu.clone(),
        };
        gpu.check()?;
        Ok(made)
    }

    /// Drops all photographs.
    pub(super) fn forget_photographs(&mut self) {
        (self.photographs, self.other) = (BTreeMap::new(), None);
    }

    /// Uploads a photograph that is not there yet.
    fn keep(&mut self, view: &TargetView<'_, f32>) -> Result<(), GpuError> {
        match view.index {
            Some(index) if self.photographs.contains_key(&index) => {}
            Some(index) => {
                self.photographs.insert(index, Target::of_planes(&self.gpu, view.truth(), self.size_px, view.mask)?);
            }
            None => self.other = Some(Target::of_planes(&self.gpu, view.truth(), self.size_px, view.mask)?),
        }
        Ok(())
    }

    fn kept<'t>(
        photographs: &'t BTreeMap<usize, Target>,
        other: &'t Option<Target>,
        view: &TargetView<'_, f32>,
    ) -> &'t Target {
        let found = view.index.map_or(other.as_ref(), |index| photographs.get(&index));
        found.expect("uploaded by `compare`, which comes first")
    }

    /// Lists the splats of each tile; waits. Returns the number of pairs.
    pub(super) fn build(&mut self, size_px: [usize; 2]) -> Result<usize, GpuError> {
        self.size_px = size_px;
        let Self { gpu, tiles, splats, footprints, .. } = self;
        tiles.build(gpu, Commands::new(gpu), splats, footprints, size_px)
    }

    /// Draws all tiles.
    pub(super) fn rasterise(&mut self, commands: &mut Commands<'_>, background: [f32; 3]) -> Result<(), GpuError> {
        let Self { gpu, rasterise, tiles, splats, image, d_image, transmittance, size_px, .. } = self;
        let n_pixels = size_px[0] * size_px[1];
        image.fit(gpu, 3 * n_pixels)?;
        d_image.fit(gpu, 3 * n_pixels)?;
        transmittance.fit(gpu, n_pixels)?;
        rasterise.forward(commands, splats, tiles, *size_px, background, image, transmittance);
        Ok(())
    }

    /// Compares with the photograph, and begins the gradient of the image.
    pub(super) fn differ(
        &mut self,
        commands: &mut Commands<'_>,
        view: &TargetView<'_, f32>,
        weights: &LossWeights,
    ) -> Result<(), GpuError> {
        self.keep(view)?;
        let Self {
            gpu,
            ssim,
            l1,
            exposures,
            clear_masked,
            image,
            shown,
            d_image,
            totals,
            photographs,
            other,
            size_px,
            ..
        } = self;
        let target = Self::kept(photographs, other, view);
        if let Some(exposure) = &view.exposure {
            exposures.sums(gpu, commands, image, target, totals, EXPOSURE)?;
            if !exposure.is_none() {
                shown.fit(gpu, image.len())?;
                exposures.apply(commands, exposure, image, shown);
            }
        }
        let image = if is_shifted(view) { &*shown } else { &*image };
        clear_masked.run(commands, target, image);
        ssim.forward(gpu, commands, image, target, *size_px, totals, SIMILARITY)?;
        l1.forward(gpu, commands, image, target, totals, DIFFERENCES)?;
        l1.backward(commands, image, target, 1.0 - weights.dssim, d_image);
        ssim.backward(commands, image, target, *size_px, -weights.dssim, d_image);
        Ok(())
    }

    /// Adds the gradient of the difference in high frequencies, and writes its sum to `totals[first_total]`.
    pub(super) fn differ_in_detail(
        &mut self,
        commands: &mut Commands<'_>,
        view: &TargetView<'_, f32>,
        weight: f64,
        first_total: usize,
    ) -> Result<(), GpuError> {
        let Self { gpu, high_pass, image, shown, d_image, totals, photographs, other, size_px, .. } = self;
        let target = Self::kept(photographs, other, view);
        let image = if is_shifted(view) { &*shown } else { &*image };
        high_pass.forward_backward(gpu, commands, image, target, *size_px, weight, d_image, totals, first_total)
    }

    /// Pixels that do not count get no gradient.
    pub(super) fn mask_gradient(&self, commands: &mut Commands<'_>, view: &TargetView<'_, f32>) {
        self.clear_masked.run(commands, Self::kept(&self.photographs, &self.other, view), &self.d_image);
        if let Some(exposure) = view.exposure.as_ref().filter(|exposure| !exposure.is_none()) {
            self.exposures.backward(commands, exposure, &self.d_image);
        }
    }

    /// From the gradient of the image to those of the splats and of the background.
    pub(super) fn rasterise_backward(&mut self, commands: &mut Commands<'_>) -> Result<(), GpuError> {
        let Self { gpu, rasterise, tiles, splats, image, d_image, d_splats, transmittance, totals, .. } = self;
        d_splats.fit(gpu, splats.len())?;
        rasterise.backward(gpu, commands, splats, tiles, self.size_px, image, d_image, d_splats)?;
        rasterise.background(gpu, commands, transmittance, d_image, totals, BACKGROUND)
    }

    /// Values of the image.
    pub(super) fn n_values(&self) -> usize {
        self.image.len()
    }

    /// What the sums say of the comparison.
    pub(super) fn loss_of(&self, totals: &[f32], target: &TargetView<'_, f32>) -> ImageLoss<f32> {
        let n_values = self.n_values() as f32;
        ImageLoss {
            l1: totals[DIFFERENCES] / n_values,
            similarity: totals[SIMILARITY] / n_values,
            squared_sum: totals[DIFFERENCES + 1].into(),
            exposure: target.exposure.map(|_| Exposures::sums_of(&totals[EXPOSURE..])),
        }
    }

    /// What they say of the gradient of the background.
    pub(super) fn d_background_of(totals: &[f32]) -> [f32; 3] {
        std::array::from_fn(|channel| totals[BACKGROUND + channel])
    }

    fn compare_with(&mut self, view: &TargetView<'_, f32>, weights: &LossWeights) -> Result<ImageLoss<f32>, GpuError> {
        let gpu = self.gpu.clone();
        let mut commands = Commands::new(&gpu);
        self.differ(&mut commands, view, weights)?;
        commands.submit()?;
        Ok(self.loss_of(&self.totals.read(&gpu)?, view))
    }

    fn add_term_with(&mut self, view: &TargetView<'_, f32>, term: &mut ImageTerm<'_, f32>) -> Result<f32, GpuError> {
        let image = if is_shifted(view) { &self.shown } else { &self.image }.read(&self.gpu)?;
        let mut d_image = self.d_image.read(&self.gpu)?;
        let pair = ImagePair { image: &image, truth: view.truth(), size_px: self.size_px, level: self.level };
        let value = term(&pair, &mut d_image);
        self.d_image.write(&self.gpu, &d_image)?;
        Ok(value)
    }

    fn bin_with(
        &mut self,
        splats: &[Splat<f32>],
        footprints: &[Footprint<f32>],
        size_px: [usize; 2],
    ) -> Result<usize, GpuError> {
        self.splats.write(&self.gpu, splats)?;
        self.footprints.write(&self.gpu, footprints)?;
        self.build(size_px)
    }

    /// Has the device do what `add` lists.
    fn run(&mut self, add: impl FnOnce(&mut Self, &mut Commands<'_>) -> Result<(), GpuError>) -> Result<(), GpuError> {
        let gpu = self.gpu.clone();
        let mut commands = Commands::new(&gpu);
        add(self, &mut commands)?;
        commands.submit()
    }

    fn backward_all(&mut self) -> Result<(Vec<Splat<f32>>, [f32; 3]), GpuError> {
        self.run(Self::rasterise_backward)?;
        Ok((self.d_splats.read(&self.gpu)?, Self::d_background_of(&self.totals.read(&self.gpu)?)))
    }
}

/// Whether a photograph is compared with something else than what is drawn.
fn is_shifted(view: &TargetView<'_, f32>) -> bool {
    view.exposure.is_some_and(|exposure| !exposure.is_none())
}

impl ImageStages<f32> for GpuImage {
    fn bin(
        &mut self,
        splats: Vec<Splat<f32>>,
        footprints: Vec<Footprint<f32>>,
        size_px: [usize; 2],
    ) -> Result<usize, DeviceFault> {
        self.bin_with(&splats, &footprints, size_px).map_err(DeviceFault::new)
    }

    fn draw(&mut self, background: [f32; 3]) -> Result<(), DeviceFault> {
        self.run(|images, commands| images.rasterise(commands, background)).map_err(DeviceFault::new)
    }

    fn compare(&mut self, target: &TargetView<'_, f32>, weights: &LossWeights) -> Result<ImageLoss<f32>, DeviceFault> {
        self.compare_with(target, weights).map_err(DeviceFault::new)
    }

    fn add_term(&mut self, target: &TargetView<'_, f32>, term: &mut ImageTerm<'_, f32>) -> Result<f32, DeviceFault> {
        self.add_term_with(target, term).map_err(DeviceFault::new)
    }

    fn end_gradient(&mut self, target: &TargetView<'_, f32>) -> Result<(), DeviceFault> {
        let end = |images: &mut Self, commands: &mut Commands<'_>| {
            images.mask_gradient(commands, target);
            Ok(())
        };
        self.run(end).map_err(DeviceFault::new)
    }

    fn backward(&mut self) -> Result<(Vec<Splat<f32>>, [f32; 3]), DeviceFault> {
        self.backward_all().map_err(DeviceFault::new)
    }
}
