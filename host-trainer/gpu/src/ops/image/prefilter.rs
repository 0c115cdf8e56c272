//! [`pocketsplat_kernels::ops::image::prefilter`]: the anchors that a view may show, ascending.

use bytemuck::{Pod, Zeroable};
use pocketsplat_format::rules::{DILATION_PX2, DILATION_REACH_PX, INK_DEVIATIONS, NEAR};

use crate::ops::primitives::compact::Compact;
use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel, MATH};
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::scene::{MASK_THRESHOLD, ModelShape};

/// Its kernels, and the anchors of the last view.
#[derive(Debug)]
pub struct Prefilter {
    by_anchor: Kernel,
    by_offsets: Kernel,
    /// The visible anchors, ascending, and the row of each anchor among them.
    pub visible: Compact,
}

/// What of the anchors decides, in the device's memory.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// `[n, 3]`, world frame.
    pub positions: &'a Buffer<f32>,
    /// `[n, 6]` or `[n, 4]`.
    pub log_scales: &'a Buffer<f32>,
    /// `[n, 3K]`.
    pub offsets: &'a Buffer<f32>,
    /// `[n, K]`.
    pub mask_logits: &'a Buffer<f32>,
    /// `[n]`: see [`Anchors::prune_rank`](pocketsplat_kernels::scene::Anchors::prune_rank); 1 where nothing has ranked them.
    pub prune_rank: &'a Buffer<f32>,
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
    near: f32,
    dilation_px2: f32,
    dilation_reach_px: f32,
    ink_deviations: f32,
    mask_threshold: f32,
    pruned_share: f32,
    n_anchors: u32,
    n_offsets: u32,
    n_log_scales: u32,
}

impl Prefilter {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let with = |source| [GROUPS, MATH, include_str!("prefilter/anchor.wgsl"), source];
        Ok(Self {
            by_anchor: Kernel::new(gpu, "prefilter", &with(include_str!("prefilter/by_anchor.wgsl"))),
            by_offsets: Kernel::new(gpu, "prefilter by offsets", &with(include_str!("prefilter/by_offsets.wgsl"))),
            visible: Compact::new(gpu)?,
        })
    }

    /// Lists the anchors that [`shows`](pocketsplat_kernels::ops::image::prefilter::shows) and that are drawn and kept at all. Returns their number.
    ///
    /// Waits once, for that number.
    ///
    /// * `pruned_share`: anchors of a lower rank are left out.
    ///
    /// # Errors
    /// [`GpuError`].
    pub fn run(
        &mut self,
        gpu: &Gpu,
        mut commands: Commands<'_>,
        camera: &Pinhole<f32>,
        shape: &ModelShape,
        shown: Shown<'_>,
        pruned_share: f32,
    ) -> Result<usize, GpuError> {
        let n_anchors = shown.prune_rank.len();
        self.visible.fit(gpu, n_anchors)?;
        let bounds = [camera.slope_bounds(0), camera.slope_bounds(1)];
        let parameters = Parameters {
            rotation: camera.rotation,
            translation: camera.translation,
            focal_px: camera.focal_px,
            principal_px: camera.principal_px,
            size_px: camera.size_px.map(|s| s as f32),
            slope_low: bounds.map(|[low, _]| low),
            slope_high: bounds.map(|[_, high]| high),
            near: NEAR,
            dilation_px2: DILATION_PX2 as f32,
            dilation_reach_px: DILATION_REACH_PX as f32,
            ink_deviations: INK_DEVIATIONS as f32,
            mask_threshold: MASK_THRESHOLD as f32,
            pruned_share,
            n_anchors: n_anchors as u32,
            n_offsets: shape.n_offsets as u32,
            n_log_scales: shape.n_log_scales() as u32,
        };
        let Shown { positions, log_scales, offsets, mask_logits, prune_rank } = shown;
        if shape.sees_view() {
            let buffers =
                [positions as _, log_scales as _, mask_logits as _, prune_rank as _, &self.visible.marks as _];
            commands.run_items(&self.by_anchor, &parameters, &buffers, n_anchors);
        } else {
            let buffers = [
                positions as _,
                log_scales as _,
                mask_logits as _,
                prune_rank as _,
                &self.visible.marks as _,
                offsets as _,
            ];
            commands.run_items(&self.by_offsets, &parameters, &buffers, n_anchors);
        }
        self.visible.run(gpu, commands)
    }
}

#[cfg(test)]
pub(in crate::ops) mod tests;
