//! The stages of a step between splats and the loss, on a GPU.
//!
//! Splats come from the CPU and their gradients go back to it; photographs are uploaded once and stay, as 8 bit.

use std::collections::BTreeMap;

use super::ops::l1::L1;
use super::ops::rasterise::Rasterise;
use super::ops::ssim::Ssim;
use super::ops::target::{ClearMasked, Target};
use super::ops::tiles::Tiles;
use super::{Buffer, Commands, Gpu, GpuError};
use crate::ops::project::{Footprint, Splat};
use crate::ops::simd::Level;
use crate::step::{DeviceFault, ImageLoss, ImagePair, ImageStages, ImageTerm, LossWeights, TargetView};

/// Places of the sums in [`GpuImage::totals`].
const SIMILARITY: usize = 0;
const DIFFERENCES: usize = 1;
const BACKGROUND: usize = 3;
const N_TOTALS: usize = 6;

/// Kernels and buffers of the stages.
#[derive(Debug)]
pub struct GpuImage {
    gpu: Gpu,
    level: Level,
    tiles: Tiles,
    rasterise: Rasterise,
    ssim: Ssim,
    l1: L1,
    clear_masked: ClearMasked,
    size_px: [usize; 2],
    splats: Buffer<Splat<f32>>,
    footprints: Buffer<Footprint<f32>>,
    d_splats: Buffer<Splat<f32>>,
    image: Buffer<f32>,
    transmittance: Buffer<f32>,
    d_image: Buffer<f32>,
    totals: Buffer<f32>,
    /// By their number in the capture.
    photographs: BTreeMap<usize, Target>,
    /// One without a number.
    other: Option<Target>,
}

impl GpuImage {
    /// Compiles all kernels.
    ///
    /// # Errors
    /// [`GpuError`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let made = Self {
            level: Level::detect(),
            tiles: Tiles::new(gpu)?,
            rasterise: Rasterise::new(gpu)?,
            ssim: Ssim::new(gpu)?,
            l1: L1::new(gpu)?,
            clear_masked: ClearMasked::new(gpu),
            size_px: [0; 2],
            splats: Buffer::zeros(gpu, "splats", 1)?,
            footprints: Buffer::zeros(gpu, "extents of splats", 1)?,
            d_splats: Buffer::zeros(gpu, "gradients of splats", 1)?,
            image: Buffer::zeros(gpu, "pixels of the image", 1)?,
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

    fn compare_with(&mut self, view: &TargetView<'_, f32>, weights: &LossWeights) -> Result<ImageLoss<f32>, GpuError> {
        self.keep(view)?;
        let Self { gpu, ssim, l1, clear_masked, image, d_image, totals, photographs, other, size_px, .. } = self;
        let target = Self::kept(photographs, other, view);
        let mut commands = Commands::new(gpu);
        clear_masked.run(&mut commands, target, image);
        ssim.forward(gpu, &mut commands, image, target, *size_px, totals, SIMILARITY)?;
        l1.forward(gpu, &mut commands, image, target, totals, DIFFERENCES)?;
        l1.backward(&mut commands, image, target, 1.0 - weights.dssim, d_image);
        ssim.backward(&mut commands, image, target, *size_px, -weights.dssim, d_image);
        commands.submit()?;
        let sums = totals.read(gpu)?;
        let n_values = image.len() as f32;
        Ok(ImageLoss {
            l1: sums[DIFFERENCES] / n_values,
            similarity: sums[SIMILARITY] / n_values,
            squared_sum: sums[DIFFERENCES + 1].into(),
        })
    }

    fn add_term_with(&mut self, view: &TargetView<'_, f32>, term: &mut ImageTerm<'_, f32>) -> Result<f32, GpuError> {
        let image = self.image.read(&self.gpu)?;
        let mut d_image = self.d_image.read(&self.gpu)?;
        let pair = ImagePair { image: &image, truth: view.truth(), size_px: self.size_px, level: self.level };
        let value = term(&pair, &mut d_image);
        self.d_image.write(&self.gpu, &d_image)?;
        Ok(value)
    }

    fn backward_all(&mut self) -> Result<(Vec<Splat<f32>>, [f32; 3]), GpuError> {
        let Self { gpu, rasterise, tiles, splats, image, d_image, d_splats, transmittance, totals, .. } = self;
        let mut commands = Commands::new(gpu);
        d_splats.fit(gpu, splats.len())?;
        rasterise.backward(gpu, &mut commands, splats, tiles, self.size_px, image, d_image, d_splats)?;
        rasterise.background(gpu, &mut commands, transmittance, d_image, totals, BACKGROUND)?;
        commands.submit()?;
        let sums = totals.read(gpu)?;
        Ok((d_splats.read(gpu)?, std::array::from_fn(|channel| sums[BACKGROUND + channel])))
    }
}

impl ImageStages<f32> for GpuImage {
    fn name(&self) -> String {
        self.gpu.name.clone()
    }

    fn bin(
        &mut self,
        splats: Vec<Splat<f32>>,
        footprints: Vec<Footprint<f32>>,
        size_px: [usize; 2],
    ) -> Result<usize, DeviceFault> {
        self.size_px = size_px;
        let mut build = || {
            self.splats.write(&self.gpu, &splats)?;
            self.footprints.write(&self.gpu, &footprints)?;
            self.tiles.build(&self.gpu, Commands::new(&self.gpu), &self.splats, &self.footprints, size_px)
        };
        build().map_err(DeviceFault::new)
    }

    fn draw(&mut self, background: [f32; 3]) -> Result<(), DeviceFault> {
        let Self { gpu, rasterise, tiles, splats, image, d_image, transmittance, size_px, .. } = self;
        let n_pixels = size_px[0] * size_px[1];
        let mut draw = || {
            image.fit(gpu, 3 * n_pixels)?;
            d_image.fit(gpu, 3 * n_pixels)?;
            transmittance.fit(gpu, n_pixels)?;
            let mut commands = Commands::new(gpu);
            rasterise.forward(&mut commands, splats, tiles, *size_px, background, image, transmittance);
            commands.submit()
        };
        draw().map_err(DeviceFault::new)
    }

    fn compare(&mut self, target: &TargetView<'_, f32>, weights: &LossWeights) -> Result<ImageLoss<f32>, DeviceFault> {
        self.compare_with(target, weights).map_err(DeviceFault::new)
    }

    fn add_term(&mut self, target: &TargetView<'_, f32>, term: &mut ImageTerm<'_, f32>) -> Result<f32, DeviceFault> {
        self.add_term_with(target, term).map_err(DeviceFault::new)
    }

    fn end_gradient(&mut self, target: &TargetView<'_, f32>) -> Result<(), DeviceFault> {
        let Self { gpu, clear_masked, photographs, other, d_image, .. } = self;
        let mut commands = Commands::new(gpu);
        clear_masked.run(&mut commands, Self::kept(photographs, other, target), d_image);
        commands.submit().map_err(DeviceFault::new)
    }

    fn backward(&mut self) -> Result<(Vec<Splat<f32>>, [f32; 3]), DeviceFault> {
        self.backward_all().map_err(DeviceFault::new)
    }
}

#[cfg(test)]
mod tests;
