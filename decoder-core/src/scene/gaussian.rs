//! The Gaussians of one anchor seen from one place.

use super::Anchor;
use crate::bundle::Effects;
use crate::math::{sigmoid, tanh};
use crate::mlp::Heads;

/// Opacities below one step of an 8-bit channel draw nothing.
const OPACITY_MIN: f32 = 1.0 / 255.0;

/// Quaternions shorter than this are divided by this instead.
const QUATERNION_NORM_MIN: f32 = 1e-12;

/// One 3D Gaussian, normalised frame.
pub(crate) struct Gaussian {
    pub(crate) centre: [f32; 3],
    /// Standard deviations along its own axes, normalised units.
    pub(crate) scale: [f32; 3],
    /// Unit quaternion w, x, y, z from its own axes to the world's.
    pub(crate) rotation: [f32; 4],
    /// In (0, 1].
    pub(crate) opacity: f32,
    /// RGB, 0 to 1 but for what the detail head adds.
    pub(crate) colour: [f32; 3],
}

/// Scratch memory of the heads.
pub(crate) struct Workspace<'s> {
    /// `[head_inputs]`.
    pub(crate) inputs: &'s mut [f32],
    /// `[hidden_len]`.
    pub(crate) hidden: &'s mut [f32],
    /// [`crate::mlp::sums_len`] floats.
    pub(crate) detail_sums: &'s mut [f32],
}

/// Calls `draw` with each Gaussian of `anchor` that a camera at `eye` can see, offsets ascending.
///
/// Masked offsets take no part. The covariance and colour heads run only when an opacity is positive, and only for those
/// offsets.
///
/// # Budget
/// The opacity head, and at most the others: `3F(F + 4) + 11KF` multiply-adds, and with a detail head of H units
/// `H(F + 6K)` more.
pub(crate) fn for_each_gaussian(
    anchor: &Anchor<'_>,
    effects: Effects,
    eye: [f32; 3],
    heads: &Heads<'_>,
    work: &mut Workspace<'_>,
    mut draw: impl FnMut(&Gaussian),
) {
    fill_inputs(anchor, effects, eye, work.inputs);
    let Some((opacities, visible)) = opacities(anchor, heads, work) else { return };
    // The hidden layers share one buffer, so the colours of all visible offsets follow the covariances of all.
    let mut covariances = [[0.0; 7]; MAX_K];
    let hidden = heads.covariance.activate(work.inputs, work.hidden);
    for (offset, covariance) in covariances.iter_mut().enumerate() {
        if visible & (1 << offset) != 0 {
            *covariance = heads.covariance.block(offset, hidden).unwrap_or_default();
        }
    }
    // Only then the buffer is free for the detail head.
    let mut colours = [[0.0; 3]; MAX_K];
    let hidden = heads.colour.activate(work.inputs, work.hidden);
    for (k, colour) in colours.iter_mut().enumerate() {
        if visible & (1 << k) != 0 {
            *colour = heads.colour.block(k, hidden).unwrap_or_default().map(sigmoid);
        }
    }
    if let Some(detail) = &heads.detail {
        detail.begin(anchor.feature, work.detail_sums);
        for (k, colour) in colours.iter_mut().enumerate() {
            if visible & (1 << k) != 0 {
                let [r, g, b] = detail.residual(*colour, work.detail_sums, work.hidden);
                let [plain_r, plain_g, plain_b] = *colour;
                *colour = [plain_r + r, plain_g + g, plain_b + b];
            }
        }
    }
    let outputs = covariances.iter().zip(opacities).zip(colours);
    for (k, (offset, ((covariance, opacity), colour))) in anchor.offsets.iter().zip(outputs).enumerate() {
        if visible & (1 << k) != 0 {
            draw(&gaussian(anchor, *offset, *covariance, opacity, colour));
        }
    }
}

/// Most offsets of an anchor, as a length.
const MAX_K: usize = crate::bundle::MAX_OFFSETS as usize;

/// Concatenates feature, direction and distance, the last two if the scene has them.
fn fill_inputs(anchor: &Anchor<'_>, effects: Effects, eye: [f32; 3], inputs: &mut [f32]) {
    let [ax, ay, az] = anchor.position;
    let [ex, ey, ez] = eye;
    let [dx, dy, dz] = [ax - ex, ay - ey, az - ez];
    let distance = libm::sqrtf(dx * dx + dy * dy + dz * dz);
    let direction = if distance > 0.0 { [dx / distance, dy / distance, dz / distance] } else { [0.0; 3] };
    let direction = direction.iter().take(if effects.view_direction { 3 } else { 0 });
    let distance = core::iter::once(&distance).take(effects.view_distance.into());
    for (input, &value) in inputs.iter_mut().zip(anchor.feature.iter().chain(direction).chain(distance)) {
        *input = value;
    }
}

/// The opacities and a bit for each offset that is opaque enough to draw; `None` when there is none.
fn opacities(anchor: &Anchor<'_>, heads: &Heads<'_>, work: &mut Workspace<'_>) -> Option<([f32; MAX_K], u32)> {
    let mut opacities = [0.0; MAX_K];
    let mut visible = 0_u32;
    let hidden = heads.opacity.activate(work.inputs, work.hidden);
    for (offset, opacity) in opacities.iter_mut().take(anchor.offsets.len()).enumerate() {
        let bit = 1_u32 << (offset & 31);
        if anchor.mask & bit == 0 {
            continue;
        }
        let [logit] = heads.opacity.block(offset, hidden)?;
        // tanh keeps the sign and the order, so most offsets leave before it.
        if logit > 0.0 {
            *opacity = tanh(logit);
            visible |= if *opacity >= OPACITY_MIN { bit } else { 0 };
        }
    }
    (visible != 0).then_some((opacities, visible))
}

fn gaussian(anchor: &Anchor<'_>, offset: [f32; 3], covariance: [f32; 7], opacity: f32, colour: [f32; 3]) -> Gaussian {
    let [x, y, z] = anchor.position;
    let [lx, ly, lz] = anchor.extent;
    let [gx, gy, gz] = anchor.base_scale;
    let [ox, oy, oz] = offset;
    let [s0, s1, s2, w, i, j, k] = covariance;
    let norm = libm::sqrtf(w * w + i * i + j * j + k * k);
    let norm = if norm > QUATERNION_NORM_MIN { norm } else { QUATERNION_NORM_MIN };
    Gaussian {
        centre: [x + ox * lx, y + oy * ly, z + oz * lz],
        scale: [gx * sigmoid(s0), gy * sigmoid(s1), gz * sigmoid(s2)],
        rotation: [w / norm, i / norm, j / norm, k / norm],
        opacity,
        colour,
    }
}
