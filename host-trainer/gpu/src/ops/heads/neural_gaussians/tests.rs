//! Against the CPU. Bounds: a Gaussian is a few exponentials, quotients and roots, known to 1e-6 of itself each, opacity near 0 to 1e-7; a
//! centre is a sum that may cancel, of parts as large as `exp(log_scales)`. Gradients lose a digit to 1 − σ and to the projection onto the
//! quaternion; those of an anchor are sums over K offsets that may cancel, known to 2e-6 of what they add up.

use super::*;
use crate::parity::{Bound, SIZES, assert_close, gpu, largest};
use pocketsplat_kernels::finite_difference::random;
use pocketsplat_kernels::ops::heads::neural_gaussians as cpu;

/// Everything about n anchors, in the order of the kernels' buffers.
struct Anchors {
    positions: Vec<f32>,
    log_scales: Vec<f32>,
    offsets: Vec<f32>,
    mask_logits: Vec<f32>,
    outputs: cpu::HeadOutputs<f32>,
}

fn random_anchors(shape: &ModelShape, n: usize) -> Anchors {
    let of = |seed, len, scale: f64| random(seed, len).iter().map(|v| (scale * v) as f32).collect::<Vec<f32>>();
    let k = shape.n_offsets;
    Anchors {
        positions: of(1, 3 * n, 5.0),
        log_scales: of(2, n * shape.n_log_scales(), 3.0),
        offsets: of(3, 3 * n * k, 2.0),
        mask_logits: of(4, n * k, 8.0),
        outputs: cpu::HeadOutputs {
            opacity: of(5, n * k, 2.0),
            covariance: of(6, n * k * shape.covariance_outputs(), 3.0),
            colour: of(7, 3 * n * k, 4.0),
        },
    }
}

fn fields(g: &Gaussian<f32>) -> [Vec<f32>; 5] {
    [g.centre.to_vec(), g.scale.to_vec(), g.rotation.to_vec(), vec![g.opacity], g.colour.to_vec()]
}

/// Log-scales, offsets, mask logits; opacity, covariance, colour.
fn split(all: &[Buffer<f32>; 6]) -> (ViewAnchors<'_>, HeadOutputs<'_>) {
    let [log_scales, offsets, mask_logits, opacity, covariance, colour] = all;
    (ViewAnchors { log_scales, offsets, mask_logits }, HeadOutputs { opacity, covariance, colour })
}

/// Both ways; the gradients' way has the CPU's Gaussians, with another colour.
fn compare(gpu: &Gpu, shape: &ModelShape, anchors: &Anchors) {
    let Anchors { positions, log_scales, offsets, mask_logits, outputs } = anchors;
    let (n, k) = (positions.len() / 3, shape.n_offsets);
    let (mut gaussians, mut sources) = (Vec::new(), Vec::new());
    let places: Vec<[f32; 3]> = positions.as_chunks().0.to_vec();
    cpu::forward(shape, &places, log_scales, offsets, mask_logits, outputs, &mut gaussians, &mut sources);
    let slot_of = |source: &cpu::Source| (source.row as usize) * k + source.offset as usize;
    let mut slots = vec![Gaussian::default(); n * k];
    for (gaussian, source) in gaussians.iter_mut().zip(&sources) {
        slots[slot_of(source)] = *gaussian;
        gaussian.colour[0] += 0.3;
    }
    let noise = random(9, 14 * n * k);
    let d_slots: Vec<Gaussian<f32>> =
        noise.chunks_exact(14).map(|v| bytemuck::cast::<[f32; 14], _>(std::array::from_fn(|i| v[i] as f32))).collect();
    let d_gaussians: Vec<_> = sources.iter().map(|source| d_slots[slot_of(source)]).collect();
    let mut d_outputs = cpu::HeadOutputs::default();
    d_outputs.reset(shape, n);
    let mut d_log_scales = vec![0.0; log_scales.len()];
    let (mut d_offsets, mut d_mask_logits) = (vec![0.0; offsets.len()], vec![0.0; n * k]);
    cpu::backward(
        shape,
        log_scales,
        offsets,
        mask_logits,
        outputs,
        &gaussians,
        &sources,
        &d_gaussians,
        &mut d_outputs,
        &mut d_log_scales,
        &mut d_offsets,
        &mut d_mask_logits,
    );

    let upload = |values: &[f32]| Buffer::upload(gpu, "test", values).expect("room");
    // What was there before does not matter.
    let open = |len: usize| upload(&vec![9.0; len]);
    let read = |buffer: &Buffer<f32>| buffer.read(gpu).expect("runs");
    let kernels = NeuralGaussians::new(gpu);
    let given = [log_scales, offsets, mask_logits, &outputs.opacity, &outputs.covariance, &outputs.colour];
    let inputs = given.map(|values| upload(values));
    let gradients = given.map(|values| open(values.len()));
    let found = Buffer::upload(gpu, "Gaussians", &vec![Gaussian { opacity: 9.0, ..Gaussian::default() }; n * k]);
    let (found, positions) = (found.expect("room"), upload(positions));
    let mut with_colour = slots.clone();
    for slot in with_colour.iter_mut().filter(|slot| slot.opacity > 0.0) {
        slot.colour[0] += 0.3;
    }
    let with_colour = Buffer::upload(gpu, "Gaussians", &with_colour).expect("room");
    let d_found = Buffer::upload(gpu, "gradients of Gaussians", &d_slots).expect("room");
    let ((anchors, heads), (d_anchors, d_heads)) = (split(&inputs), split(&gradients));
    let mut commands = Commands::new(gpu);
    kernels.forward(&mut commands, shape, &positions, anchors, heads, &found);
    kernels.backward(&mut commands, shape, anchors, heads, &with_colour, &d_found, d_heads, d_anchors);
    commands.submit().expect("runs");
    for (slot, (found, expected)) in found.read(gpu).expect("runs").iter().zip(&slots).enumerate() {
        let name = format!("slot {slot}");
        let sizes = &log_scales[slot / k * shape.n_log_scales()..][..3];
        let reach = sizes.iter().map(|s| f64::from(s.exp())).fold(1.0, f64::max);
        let bounds = [(2e-6, 1e-5 * reach), (5e-6, 1e-37), (0.0, 2e-6), (5e-6, 1e-7), (5e-6, 1e-37)];
        for ((found, expected), (relative, absolute)) in fields(found).iter().zip(&fields(expected)).zip(bounds) {
            assert_close(&name, found, expected, Bound { relative, absolute });
        }
    }
    let expected =
        [&d_log_scales, &d_offsets, &d_mask_logits, &d_outputs.opacity, &d_outputs.covariance, &d_outputs.colour];
    let widths = [shape.n_log_scales(), 3, 1, 1, shape.covariance_outputs(), 3];
    for (((found, expected), width), what) in gradients.iter().zip(expected).zip(widths).zip(0..) {
        for (row, (found, expected)) in read(found).chunks(width).zip(expected.chunks(width)).enumerate() {
            let added_up = if what == 0 { parts_of_log_scales(&gaussians, &d_gaussians, &sources, row) } else { 0.0 };
            let bound = Bound { relative: 2e-5, absolute: 2e-6 * largest(expected).max(0.1).max(added_up) };
            assert_close(&format!("gradient {what} of {row}"), found, expected, bound);
        }
    }
}

/// What an anchor's offsets add to the gradient of its sizes, by magnitude.
fn parts_of_log_scales(
    gaussians: &[Gaussian<f32>],
    d_gaussians: &[Gaussian<f32>],
    sources: &[cpu::Source],
    row: usize,
) -> f64 {
    let of_row = gaussians.iter().zip(d_gaussians).zip(sources).filter(|(_, source)| source.row as usize == row);
    let along = |((g, d), _): ((&Gaussian<f32>, &Gaussian<f32>), _)| {
        g.scale.iter().zip(d.scale).map(|(scale, d)| f64::from((scale * d).abs())).sum::<f64>()
    };
    of_row.map(along).sum()
}

#[test]
fn neural_gaussians_agree_with_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for n in SIZES {
        for (anisotropic, k) in [(true, 10), (false, 5), (true, 1)] {
            let shape = ModelShape { anisotropic, ..ModelShape::plain(4, k) };
            compare(gpu, &shape, &random_anchors(&shape, n));
        }
    }
}

/// Saturated sigmoids, quaternions of length 0 and 1e-3, masks at the threshold, opacity logits of 0 and beside it, tiny and huge sizes.
#[test]
fn hard_neural_gaussians_agree_with_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let shape = ModelShape::plain(4, 4);
    let mut anchors = random_anchors(&shape, 4);
    anchors.mask_logits[..12].fill(1.0);
    anchors.mask_logits[12..].copy_from_slice(&[MASK_THRESHOLD as f32, -4.595_119, -4.595_121, 30.0]);
    anchors
        .outputs
        .opacity
        .copy_from_slice(&[0.0, 1e-7, -1e-7, 0.0099, 0.0101, 9.0, 40.0, -40.0, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5]);
    anchors.outputs.covariance[35..42].copy_from_slice(&[30.0, -30.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    anchors.outputs.covariance[42..49].copy_from_slice(&[-80.0, 80.0, 0.0, 1e-3, -1e-3, 2e-3, 0.0]);
    anchors.outputs.colour[15..21].copy_from_slice(&[50.0, -50.0, 17.0, -17.0, 0.0, 100.0]);
    anchors.log_scales[6..12].copy_from_slice(&[-20.0, 6.0, 0.0, -20.0, 6.0, 8.0]);
    compare(gpu, &shape, &anchors);
}
