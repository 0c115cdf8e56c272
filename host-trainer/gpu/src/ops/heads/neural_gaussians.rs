//! [`pocketsplat_kernels::ops::heads::neural_gaussians`] into slots: row of the view's anchors × K + offset.

use bytemuck::{Pod, Zeroable};

use crate::{Buffer, Commands, GROUPS, Gpu, Kernel, MATH, RECORDS};
use pocketsplat_kernels::ops::heads::neural_gaussians::Gaussian;
use pocketsplat_kernels::scene::{MASK_THRESHOLD, ModelShape};

/// Its kernels.
#[derive(Clone, Debug)]
pub struct NeuralGaussians {
    forward: Kernel,
    backward_heads: Kernel,
    backward_anchors: Kernel,
}

/// The anchors of a view, or their gradients.
#[derive(Clone, Copy, Debug)]
pub struct ViewAnchors<'a> {
    /// `[n, 6]` or `[n, 4]`.
    pub log_scales: &'a Buffer<f32>,
    /// `[n, 3K]`.
    pub offsets: &'a Buffer<f32>,
    /// `[n, K]`.
    pub mask_logits: &'a Buffer<f32>,
}

/// Outputs of the heads, or their gradients.
#[derive(Clone, Copy, Debug)]
pub struct HeadOutputs<'a> {
    /// `[n, K]` opacity logits.
    pub opacity: &'a Buffer<f32>,
    /// `[n, 7K]` or `[n, K]`: see [`HeadOutputs`](pocketsplat_kernels::ops::heads::neural_gaussians::HeadOutputs).
    pub covariance: &'a Buffer<f32>,
    /// `[n, 3K]` colour logits.
    pub colour: &'a Buffer<f32>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_items: u32,
    n_offsets: u32,
    n_log_scales: u32,
    n_covariances: u32,
    mask_threshold: f32,
}

impl Parameters {
    fn new(shape: &ModelShape, n_items: usize) -> Self {
        Self {
            n_items: n_items as u32,
            n_offsets: shape.n_offsets as u32,
            n_log_scales: shape.n_log_scales() as u32,
            n_covariances: shape.covariance_outputs() as u32,
            mask_threshold: MASK_THRESHOLD as f32,
        }
    }
}

impl NeuralGaussians {
    /// Compiles the kernels.
    pub fn new(gpu: &Gpu) -> Self {
        let with = |source| [GROUPS, RECORDS, MATH, include_str!("neural_gaussians/parameters.wgsl"), source];
        let kernel = |name, source| Kernel::new(gpu, name, &with(source));
        Self {
            forward: kernel("neural Gaussians", include_str!("neural_gaussians/forward.wgsl")),
            backward_heads: kernel("neural Gaussians: to heads", include_str!("neural_gaussians/backward_heads.wgsl")),
            backward_anchors: kernel(
                "neural Gaussians: to anchors",
                include_str!("neural_gaussians/backward_anchors.wgsl"),
            ),
        }
    }

    /// Writes the Gaussians of all slots; one that a mask hides, or whose opacity is not positive, is all zero.
    ///
    /// * `positions`: `[n, 3]`, world frame. * `gaussians`: `[n·K]`.
    pub fn forward(
        &self,
        commands: &mut Commands<'_>,
        shape: &ModelShape,
        positions: &Buffer<f32>,
        anchors: ViewAnchors<'_>,
        outputs: HeadOutputs<'_>,
        gaussians: &Buffer<Gaussian<f32>>,
    ) {
        let ViewAnchors { log_scales, offsets, mask_logits } = anchors;
        let HeadOutputs { opacity, covariance, colour } = outputs;
        let buffers = [
            positions as _,
            log_scales as _,
            offsets as _,
            mask_logits as _,
            opacity as _,
            covariance as _,
            colour as _,
            gaussians as _,
        ];
        commands.run_items(&self.forward, &Parameters::new(shape, gaussians.len()), &buffers, gaussians.len());
    }

    /// Gradients of [`Self::forward`], given those of the Gaussians; all are overwritten.
    ///
    /// * `gaussians`: as forward left them, whatever has been added to their colours.
    #[expect(clippy::too_many_arguments, reason = "what the kernels are bound to")]
    pub fn backward(
        &self,
        commands: &mut Commands<'_>,
        shape: &ModelShape,
        anchors: ViewAnchors<'_>,
        outputs: HeadOutputs<'_>,
        gaussians: &Buffer<Gaussian<f32>>,
        d_gaussians: &Buffer<Gaussian<f32>>,
        d_outputs: HeadOutputs<'_>,
        d_anchors: ViewAnchors<'_>,
    ) {
        let buffers = [
            outputs.covariance as _,
            outputs.colour as _,
            gaussians as _,
            d_gaussians as _,
            d_outputs.opacity as _,
            d_outputs.covariance as _,
            d_outputs.colour as _,
        ];
        commands.run_items(&self.backward_heads, &Parameters::new(shape, gaussians.len()), &buffers, gaussians.len());
        let n_anchors = gaussians.len() / shape.n_offsets;
        let buffers = [
            anchors.log_scales as _,
            anchors.offsets as _,
            anchors.mask_logits as _,
            gaussians as _,
            d_gaussians as _,
            d_anchors.log_scales as _,
            d_anchors.offsets as _,
            d_anchors.mask_logits as _,
        ];
        commands.run_items(&self.backward_anchors, &Parameters::new(shape, n_anchors), &buffers, n_anchors);
    }
}

#[cfg(test)]
mod tests;
