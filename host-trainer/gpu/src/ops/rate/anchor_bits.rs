//! [`pocketsplat_kernels::ops::rate::anchor_bits`] over the sampled anchors of a view, a thread a channel.

use bytemuck::{Pod, Zeroable};

use crate::ops::primitives::sum::Sum;
use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel, MATH};
use pocketsplat_kernels::ops::rate::adaptive_step::EXPONENTS;
use pocketsplat_kernels::ops::rate::anchor_bits::LOG2_SCALES;
use pocketsplat_kernels::scene::{MASK_THRESHOLD, ModelShape};

/// Its kernels, and what they leave for one another, `[n_sampled, C]` each.
#[derive(Debug)]
pub struct AnchorBits {
    residuals: Kernel,
    bits: Kernel,
    outputs: Kernel,
    exponents: Kernel,
    values: Kernel,
    masks: Kernel,
    taps: Kernel,
    sum: Sum,
    /// What values leave of the means of their anchor's place, in steps.
    residual: Buffer<f32>,
    bits_of_values: Buffer<f32>,
    /// Weight · ∂bits/∂x at fixed means.
    d_direct: Buffer<f32>,
    /// Weight · ∂bits/∂x through the taps as well.
    d_value: Buffer<f32>,
    /// Weight · ∂bits/∂log₂ σ.
    d_log2_scale: Buffer<f32>,
    /// `[n_sampled, 3]`.
    parts: Buffer<f32>,
}

/// The sampled anchors and what the context model says of them.
#[derive(Clone, Copy, Debug)]
pub struct Sampled<'a> {
    /// Widths.
    pub shape: &'a ModelShape,
    /// Of features, log-scales, offsets.
    pub base_steps: [f32; 3],
    /// `[n_sampled]` rows of the view's anchors.
    pub rows: &'a Buffer<u32>,
    /// `[n, F]`, `[n, 6]` or `[n, 4]`, `[n, 3K]` of the view's anchors, noised or rounded.
    pub values: [&'a Buffer<f32>; 3],
    /// `[n, K]`.
    pub mask_logits: &'a Buffer<f32>,
    /// `[n_sampled, 2C + 3]`: see [`Rows::outputs`](pocketsplat_kernels::ops::rate::anchor_bits::Rows::outputs).
    pub outputs: &'a Buffer<f32>,
    /// Features that a feature's mean follows at most.
    pub n_taps: usize,
    /// The network's parameters, in which the weights of taps begin at `first_tap`.
    pub weights: &'a Buffer<f32>,
    /// Where.
    pub first_tap: usize,
}

/// Where gradients go.
#[derive(Clone, Copy, Debug)]
pub struct Gradients<'a> {
    /// As [`Sampled::values`]; added to.
    pub values: [&'a Buffer<f32>; 3],
    /// As [`Sampled::mask_logits`]; added to.
    pub mask_logits: &'a Buffer<f32>,
    /// As [`Sampled::outputs`]; overwritten.
    pub outputs: &'a Buffer<f32>,
    /// As [`Sampled::weights`]; the taps are added to.
    pub weights: &'a Buffer<f32>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    base_steps: [f32; 3],
    exponents: [f32; 2],
    log2_scales: [f32; 2],
    bit_weight: f32,
    anchor_weight: f32,
    mask_threshold: f32,
    n_sampled: u32,
    /// Features, log-scales, offsets.
    widths: [u32; 3],
    n_taps: u32,
    first_tap: u32,
}

impl AnchorBits {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        const SHARED: &str = include_str!("anchor_bits/channel.wgsl");
        let kernel = |name, source| Kernel::new(gpu, name, &[GROUPS, MATH, SHARED, source]);
        let with_rate =
            [GROUPS, MATH, SHARED, include_str!("anchor_bits/rate.wgsl"), include_str!("anchor_bits/bits.wgsl")];
        let room = |what| Buffer::zeros(gpu, what, 1);
        Ok(Self {
            residuals: kernel("anchor bits: residuals", include_str!("anchor_bits/residuals.wgsl")),
            bits: Kernel::new(gpu, "anchor bits", &with_rate),
            outputs: kernel("anchor bits: to outputs", include_str!("anchor_bits/outputs.wgsl")),
            exponents: kernel("anchor bits: to exponents", include_str!("anchor_bits/exponents.wgsl")),
            values: kernel("anchor bits: to values", include_str!("anchor_bits/values.wgsl")),
            masks: kernel("anchor bits: to masks", include_str!("anchor_bits/masks.wgsl")),
            taps: kernel("anchor bits: to taps", include_str!("anchor_bits/taps.wgsl")),
            sum: Sum::new(gpu),
            residual: room("residuals of sampled values")?,
            bits_of_values: room("bits of sampled values")?,
            d_direct: room("gradients of residuals")?,
            d_value: room("gradients of sampled values")?,
            d_log2_scale: room("gradients of scales")?,
            parts: room("bits of sampled anchors")?,
        })
    }

    /// Writes the bits of the drawn features, log-scales and offsets of the sample to `totals` from `first_total` on, and `weight` times
    /// their gradients.
    ///
    /// A mask answers for `weight` times the bits of its offset, and for a K-th part of `anchor_weight` times those of its anchor's other
    /// values, as [`slope`](pocketsplat_kernels::ops::heads::mask::slope) takes them to its logit.
    ///
    /// Cost: C threads an anchor, 2 + 2T reads of global memory each.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    #[expect(clippy::too_many_arguments, reason = "what the kernels are bound to")]
    pub fn forward_backward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        sampled: &Sampled<'_>,
        [weight, anchor_weight]: [f32; 2],
        gradients: &Gradients<'_>,
        totals: &Buffer<f32>,
        first_total: usize,
    ) -> Result<(), GpuError> {
        let Sampled { shape, base_steps, rows, values, mask_logits, outputs, n_taps, weights, first_tap } = *sampled;
        let (n, n_channels) = (rows.len(), shape.values_per_anchor());
        let len = n * n_channels;
        let Self { residual, bits_of_values, d_direct, d_value, d_log2_scale, parts, .. } = self;
        for buffer in [&mut *residual, bits_of_values, d_direct, d_value, d_log2_scale] {
            buffer.fit(gpu, len)?;
        }
        parts.fit(gpu, 3 * n)?;
        let (residual, bits, d_direct) = (&*residual, &*bits_of_values, &*d_direct);
        let (d_value, d_log2_scale, parts) = (&*d_value, &*d_log2_scale, &*parts);
        let parameters = Parameters {
            base_steps,
            exponents: EXPONENTS.map(|e| e as f32),
            log2_scales: LOG2_SCALES.map(|e| e as f32),
            bit_weight: weight,
            anchor_weight,
            mask_threshold: MASK_THRESHOLD as f32,
            n_sampled: n as u32,
            widths: [shape.feature_dim, shape.n_log_scales(), 3 * shape.n_offsets].map(|width| width as u32),
            n_taps: n_taps as u32,
            first_tap: first_tap as u32,
        };
        let [features, log_scales, offsets] = values;
        let buffers = [outputs as _, rows as _, features as _, log_scales as _, offsets as _, residual as _];
        commands.run_items(&self.residuals, &parameters, &buffers, len);
        let buffers = [
            outputs as _,
            rows as _,
            mask_logits as _,
            weights as _,
            residual as _,
            bits as _,
            d_direct as _,
            d_log2_scale as _,
        ];
        commands.run_items(&self.bits, &parameters, &buffers, len);
        let buffers =
            [outputs as _, weights as _, d_direct as _, d_log2_scale as _, d_value as _, gradients.outputs as _];
        commands.run_items(&self.outputs, &parameters, &buffers, len);
        let buffers = [outputs as _, residual as _, d_value as _, d_log2_scale as _, gradients.outputs as _];
        commands.run_items(&self.exponents, &parameters, &buffers, 3 * n);
        let [d_features, d_log_scales, d_offsets] = gradients.values;
        let buffers = [outputs as _, rows as _, d_value as _, d_features as _, d_log_scales as _, d_offsets as _];
        commands.run_items(&self.values, &parameters, &buffers, len);
        let buffers = [mask_logits as _, rows as _, bits as _, gradients.mask_logits as _, parts as _];
        commands.run_items(&self.masks, &parameters, &buffers, n);
        let n_weights = pocketsplat_format::context::first_tap(shape.feature_dim, n_taps);
        commands.run(&self.taps, &parameters, &[residual, d_direct, gradients.weights], n_weights);
        self.sum.run(commands, parts, 3, totals, first_total);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
