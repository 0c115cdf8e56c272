//! [`pocketsplat_kernels::ops::image::rasterise`] over slots: a workgroup is a tile, a thread a pixel.

use bytemuck::{Pod, Zeroable};

use super::tiles::Tiles;
use crate::ops::primitives::sum::Sum;
use crate::{Buffer, Commands, GROUP_THREADS, GROUPS, Gpu, GpuError, Kernel, MATH, RECORDS};
use pocketsplat_kernels::ops::image::project::Splat;
use pocketsplat_kernels::ops::image::tiles::TILE_PX;

/// Numbers of a splat.
const N_NUMBERS: usize = 9;

/// Its kernels, and the gradients of pairs.
#[derive(Debug)]
pub struct Rasterise {
    forward: Kernel,
    backward: Kernel,
    gather: Kernel,
    background: Kernel,
    sum: Sum,
    d_pairs: Buffer<f32>,
    parts: Buffer<f32>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    size_px: [u32; 2],
    n_tiles: u32,
    background: [f32; 3],
}

impl Parameters {
    fn new(size_px: [usize; 2], background: [f32; 3]) -> Self {
        let n_tiles = size_px.map(|s| s.div_ceil(TILE_PX) as u32).iter().product();
        Self { size_px: size_px.map(|s| s as u32), n_tiles, background }
    }
}

impl Rasterise {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        const BLEND: &str = include_str!("rasterise/blend.wgsl");
        let with = |source| [GROUPS, RECORDS, MATH, BLEND, source];
        Ok(Self {
            forward: Kernel::new(gpu, "rasterise", &with(include_str!("rasterise/forward.wgsl"))),
            backward: Kernel::new(gpu, "rasterise backward", &with(include_str!("rasterise/backward.wgsl"))),
            gather: Kernel::new(gpu, "rasterise: sums of splats", &[GROUPS, include_str!("rasterise/gather.wgsl")]),
            background: Kernel::new(gpu, "rasterise: background", &[GROUPS, include_str!("rasterise/background.wgsl")]),
            sum: Sum::new(gpu),
            parts: Buffer::zeros(gpu, "sums of the background", 1)?,
            d_pairs: Buffer::zeros(gpu, "gradients of pairs", 1)?,
        })
    }

    /// Draws all tiles.
    ///
    /// * `splats`: `[n_slots]`. * `image`: planes `[3, height, width]`. * `transmittance`: `[height, width]`, the share of the background
    ///   that comes through.
    #[expect(clippy::too_many_arguments, reason = "what the kernel is bound to")]
    pub fn forward(
        &self,
        commands: &mut Commands<'_>,
        splats: &Buffer<Splat<f32>>,
        tiles: &Tiles,
        size_px: [usize; 2],
        background: [f32; 3],
        image: &Buffer<f32>,
        transmittance: &Buffer<f32>,
    ) {
        let parameters = Parameters::new(size_px, background);
        let buffers = [
            splats as _,
            &tiles.starts as _,
            tiles.entries() as _,
            &tiles.slot_of_pair as _,
            image as _,
            transmittance as _,
        ];
        commands.run(&self.forward, &parameters, &buffers, parameters.n_tiles as usize);
    }

    /// Gradient of [`Self::forward`] with respect to every splat.
    ///
    /// * `image`: what forward wrote. * `d_image`: planes. * `d_splats`: `[n_slots]`, zero where no tile lists the splat.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    #[expect(clippy::too_many_arguments, reason = "what the kernel is bound to")]
    pub fn backward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        splats: &Buffer<Splat<f32>>,
        tiles: &Tiles,
        size_px: [usize; 2],
        image: &Buffer<f32>,
        d_image: &Buffer<f32>,
        d_splats: &Buffer<Splat<f32>>,
    ) -> Result<(), GpuError> {
        self.d_pairs.fit(gpu, N_NUMBERS * tiles.slot_of_pair.len())?;
        let parameters = Parameters::new(size_px, [0.0; 3]);
        let lists = [&tiles.starts as _, tiles.entries() as _, &tiles.slot_of_pair as _];
        let buffers = [&[splats as _][..], &lists, &[image as _, d_image as _, &self.d_pairs as _]].concat();
        commands.run(&self.backward, &parameters, &buffers, parameters.n_tiles as usize);
        let n_values = N_NUMBERS * splats.len();
        let buffers = [&tiles.first_pair as _, &tiles.n_tiles as _, &self.d_pairs as _, d_splats as _];
        commands.run_items(&self.gather, &(n_values as u32), &buffers, n_values);
        Ok(())
    }

    /// Gradient of [`Self::forward`] with respect to the background, `Σ T·∂L/∂C` over the pixels, to `totals` from `first_total` on.
    ///
    /// * `transmittance`: what forward wrote. * `d_image`: planes.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn background(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        transmittance: &Buffer<f32>,
        d_image: &Buffer<f32>,
        totals: &Buffer<f32>,
        first_total: usize,
    ) -> Result<(), GpuError> {
        let n_groups = transmittance.len().div_ceil(GROUP_THREADS);
        self.parts.fit(gpu, 3 * n_groups)?;
        let n_pixels = transmittance.len() as u32;
        commands.run(&self.background, &n_pixels, &[transmittance, d_image, &self.parts], n_groups);
        self.sum.run(commands, &self.parts, 3, totals, first_total);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
