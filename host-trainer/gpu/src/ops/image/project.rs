//! [`pocketsplat_kernels::ops::image::project`] over slots.

use bytemuck::{Pod, Zeroable};

use crate::{Buffer, Commands, GROUPS, Gpu, Kernel, MATH, RECORDS};
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::heads::neural_gaussians::Gaussian;
use pocketsplat_kernels::ops::image::project::{Footprint, Splat};

const PREPARE: &str = include_str!("project/prepare.wgsl");

/// Its kernels.
#[derive(Clone, Debug)]
pub struct Project {
    forward: Kernel,
    backward: Kernel,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    rotation: [[f32; 3]; 3],
    translation: [f32; 3],
    focal_px: [f32; 2],
    principal_px: [f32; 2],
    size_px: [f32; 2],
    slope_low: [f32; 2],
    slope_high: [f32; 2],
    compensated: u32,
    n_slots: u32,
}

impl Parameters {
    fn new(camera: &Pinhole<f32>, compensated: bool, n_slots: usize) -> Self {
        let bounds = [camera.slope_bounds(0), camera.slope_bounds(1)];
        Self {
            rotation: camera.rotation,
            translation: camera.translation,
            focal_px: camera.focal_px,
            principal_px: camera.principal_px,
            size_px: camera.size_px.map(|s| s as f32),
            slope_low: bounds.map(|[low, _]| low),
            slope_high: bounds.map(|[_, high]| high),
            compensated: compensated.into(),
            n_slots: n_slots as u32,
        }
    }
}

impl Project {
    /// Compiles the kernels.
    pub fn new(gpu: &Gpu) -> Self {
        let with = |source| [GROUPS, RECORDS, MATH, PREPARE, source];
        Self {
            forward: Kernel::new(gpu, "project", &with(include_str!("project/forward.wgsl"))),
            backward: Kernel::new(gpu, "project backward", &with(include_str!("project/backward.wgsl"))),
        }
    }

    /// Projects the Gaussians of all slots; a splat that is not drawn has depth 0.
    ///
    /// * `gaussians`, `splats`, `footprints`: `[n_slots]`.
    pub fn forward(
        &self,
        commands: &mut Commands<'_>,
        camera: &Pinhole<f32>,
        compensated: bool,
        gaussians: &Buffer<Gaussian<f32>>,
        splats: &Buffer<Splat<f32>>,
        footprints: &Buffer<Footprint<f32>>,
    ) {
        let parameters = Parameters::new(camera, compensated, gaussians.len());
        commands.run_items(&self.forward, &parameters, &[gaussians, splats, footprints], gaussians.len());
    }

    /// Adds the gradients of drawn splats to those of their Gaussians.
    ///
    /// * all `[n_slots]`.
    #[expect(clippy::too_many_arguments, reason = "what the kernel is bound to")]
    pub fn backward(
        &self,
        commands: &mut Commands<'_>,
        camera: &Pinhole<f32>,
        compensated: bool,
        gaussians: &Buffer<Gaussian<f32>>,
        footprints: &Buffer<Footprint<f32>>,
        d_splats: &Buffer<Splat<f32>>,
        d_gaussians: &Buffer<Gaussian<f32>>,
    ) {
        let parameters = Parameters::new(camera, compensated, gaussians.len());
        let buffers = [gaussians as _, footprints as _, d_splats as _, d_gaussians as _];
        commands.run_items(&self.backward, &parameters, &buffers, gaussians.len());
    }
}

#[cfg(test)]
mod tests;
