//! The Gaussians of one anchor seen from one place.

use bytemuck::{Pod, Zeroable};
use pocketsplat_format::bundle::Effects;
use pocketsplat_format::{Stage, Stopwatch};

use super::Anchor;
use crate::functions::Functions;
use crate::mlp::{HeadFormat, Heads, MlpHead, Role};

/// Opacities below one step of an 8-bit channel draw nothing.
const OPACITY_MIN: f32 = 1.0 / 255.0;

/// Quaternions shorter than this are divided by this instead.
const QUATERNION_NORM_MIN: f32 = 1e-12;

/// One 3D Gaussian, normalised frame.
pub(crate) struct Gaussian {
    pub(crate) centre: [f32; 3],
    /// Standard deviations along its own axes, normalised units; of an isotropic one all the same.
    pub(crate) scale: [f32; 3],
    /// Unit quaternion w, x, y, z from its own axes to the world's; of an isotropic one [`NO_ROTATION`].
    pub(crate) rotation: [f32; 4],
    /// In (0, 1].
    pub(crate) opacity: f32,
    /// RGB, 0 to 1 but for what the detail head adds.
    pub(crate) colour: [f32; 3],
}

/// The quaternion that turns nothing.
pub(crate) const NO_ROTATION: [f32; 4] = [1.0, 0.0, 0.0, 0.0];

/// What the heads say about one offset.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct HeadOutputs {
    opacity: f32,
    /// Scale logits, then an unnormalised quaternion; or one scale logit.
    covariance: [f32; 7],
    colour: [f32; 3],
}

/// Takes the Gaussians of anchors.
pub(crate) trait GaussianSink {
    /// The Gaussian of an anchor's offset; anchors ascend, and offsets within one.
    fn gaussian(&mut self, anchor: u32, offset: usize, gaussian: &Gaussian);

    /// The multiply-adds that an anchor took.
    fn head_macs(&mut self, _: u64) {}
}

/// Scratch memory of the heads.
pub(crate) struct Workspace<'s> {
    /// `[hidden_len]`.
    pub(crate) hidden: &'s mut [f32],
    /// `[sums_len]`, see [`crate::mlp::HeadShape`].
    pub(crate) detail_sums: &'s mut [f32],
    /// `[K]`.
    pub(crate) outputs: &'s mut [HeadOutputs],
}

/// What the heads of a scene are evaluated with.
pub(super) struct Evaluation<'e, 's, H: HeadFormat> {
    pub(super) heads: &'e Heads<'s, H>,
    pub(super) work: &'e mut Workspace<'s>,
    pub(super) effects: Effects,
}

impl<H: HeadFormat> Evaluation<'_, '_, H> {
    /// Hands the Gaussians of `anchor` to `sink` that are seen from where `inputs` are; the caller has entered [`Stage::Heads`].
    ///
    /// Masked offsets take no part. The covariance and colour heads run only when an opacity is positive, and only for those
    /// offsets.
    ///
    /// # Budget
    /// The opacity head, and at most the others: `3F(F + 4) + 11KF` multiply-adds (`5KF` of isotropic Gaussians), with a detail head
    /// of H units `H(F + 6K)` more.
    // Not inlined: it has several callers.
    #[inline(never)]
    pub(super) fn run<F: Functions>(
        &mut self,
        number: u32,
        anchor: &Anchor<'_>,
        inputs: H::Values<'_>,
        role: &mut Role<'_>,
        watch: &mut impl Stopwatch,
        sink: &mut impl GaussianSink,
    ) {
        let Self { heads, work, effects } = self;
        let Workspace { hidden, detail_sums, outputs } = work;
        let [opacity_saved, saved] = if role.sums().is_some() { heads.shape.feature_macs() } else { [0; 2] };
        let mut macs = heads.shape.opacity_macs(anchor.mask.count_ones() as usize) - opacity_saved;
        let units = heads.opacity.activate(0, inputs, hidden, role);
        let visible = fill_opacities::<H, F>(anchor, heads, units, outputs);
        if visible != 0 {
            // The hidden layers share one buffer, so the colours of all visible offsets follow the covariances of all.
            let units = heads.covariance.activate(1, inputs, hidden, role);
            for (k, output) in visible_only(outputs, visible) {
                output.covariance = heads.covariance.block(k, units).unwrap_or_default();
            }
            let units = heads.colour.activate(2, inputs, hidden, role);
            for (k, output) in visible_only(outputs, visible) {
                output.colour = heads.colour.block(k, units).unwrap_or_default().map(F::sigmoid);
            }
            // Only then the buffer is free for the detail head.
            if cfg!(feature = "detail")
                && let Some(detail) = &heads.detail
            {
                let detail_sums = match role.sums() {
                    Some(sums) => sums.of_detail(),
                    None => {
                        detail.begin(anchor.feature, detail_sums);
                        detail_sums
                    }
                };
                for (_, output) in visible_only(outputs, visible) {
                    let [r, g, b] = detail.residual(output.colour, detail_sums, hidden);
                    let [plain_r, plain_g, plain_b] = output.colour;
                    output.colour = [plain_r + r, plain_g + g, plain_b + b];
                }
            }
            watch.enter(Stage::Project);
            for (k, output) in visible_only(outputs, visible) {
                if let Some(offset) = anchor.offsets.get(k) {
                    sink.gaussian(number, k, &gaussian::<F>(anchor, *effects, *offset, output));
                }
            }
            macs += heads.shape.open_macs(visible.count_ones() as usize) - saved;
        }
        sink.head_macs(macs as u64);
    }
}

/// The outputs of the offsets that are drawn, each with the offset's number.
fn visible_only(outputs: &mut [HeadOutputs], visible: u32) -> impl Iterator<Item = (usize, &mut HeadOutputs)> {
    outputs.iter_mut().enumerate().filter(move |(k, _)| visible & (1 << (k & 31)) != 0)
}

/// Concatenates feature, distance and direction, the last two if the scene has them, as many as there is room for: each head
/// reads the first of them.
pub(super) fn fill_inputs(anchor: &Anchor<'_>, effects: Effects, eye: [f32; 3], inputs: &mut [f32]) {
    let [ax, ay, az] = anchor.position;
    let [ex, ey, ez] = eye;
    let [dx, dy, dz] = [ax - ex, ay - ey, az - ez];
    let distance = pocketsplat_half::sqrt(dx * dx + dy * dy + dz * dz);
    let direction = if distance > 0.0 { [dx, dy, dz].map(|d| d / distance) } else { [0.0; 3] };
    let mut inputs = inputs.iter_mut();
    // Not a chain of iterators, each of whose steps would ask where in the chain it is.
    for (&value, input) in anchor.feature.iter().zip(inputs.by_ref()) {
        *input = value;
    }
    if effects.view_distance
        && let Some(input) = inputs.next()
    {
        *input = distance;
    }
    for (input, value) in inputs.zip(direction) {
        *input = value;
    }
}

/// Fills in opacities; returns a bit for each offset that is opaque enough to draw.
fn fill_opacities<H: HeadFormat, F: Functions>(
    anchor: &Anchor<'_>,
    heads: &Heads<'_, H>,
    units: H::Values<'_>,
    outputs: &mut [HeadOutputs],
) -> u32 {
    let mut visible = 0_u32;
    for (k, output) in visible_only(outputs, anchor.mask) {
        let [logit] = heads.opacity.block(k, units).unwrap_or_default();
        // tanh keeps the sign and the order, so most offsets leave before it.
        if logit > 0.0 {
            output.opacity = F::tanh(logit);
            visible |= if output.opacity >= OPACITY_MIN { 1 << (k & 31) } else { 0 };
        }
    }
    visible
}

fn gaussian<F: Functions>(anchor: &Anchor<'_>, effects: Effects, offset: [f32; 3], output: &HeadOutputs) -> Gaussian {
    let [x, y, z] = anchor.position;
    let [lx, ly, lz] = anchor.extent;
    let [gx, gy, gz] = anchor.base_scale;
    let [ox, oy, oz] = offset;
    let [s0, s1, s2, w, i, j, k] = output.covariance;
    let s0 = gx * F::sigmoid(s0);
    let (scale, rotation) = if cfg!(feature = "anisotropy") && effects.anisotropic {
        let norm = pocketsplat_half::sqrt(w * w + i * i + j * j + k * k);
        let norm = if norm > QUATERNION_NORM_MIN { norm } else { QUATERNION_NORM_MIN };
        let scale = [s0, gy * F::sigmoid(s1), gz * F::sigmoid(s2)];
        (scale, [w, i, j, k].map(|q| q / norm))
    } else {
        ([s0; 3], NO_ROTATION)
    };
    Gaussian {
        centre: [x + ox * lx, y + oy * ly, z + oz * lz],
        scale,
        rotation,
        opacity: output.opacity,
        colour: output.colour,
    }
}
