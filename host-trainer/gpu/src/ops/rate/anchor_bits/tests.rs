//! Against the CPU. Bounds: a value's probability is a difference of tails near 1 where its scale is small, so gradients are known to
//! 1e-4 of themselves and 1e-5 of the largest; where the probability is almost the one it is lifted to, they may be there on one side alone:
//! at most 1 in 1000. Sums of bits are known to 1e-5.

use super::*;
use crate::parity::{Bound, SIZES, assert_close, gpu, largest};
use pocketsplat_format::context::first_tap;
use pocketsplat_kernels::finite_difference::random;
use pocketsplat_kernels::ops::heads::mask;
use pocketsplat_kernels::ops::rate::anchor_bits as cpu;

fn of(seed: u64, len: usize, scale: f64) -> Vec<f32> {
    random(seed, len).iter().map(|v| (scale * v) as f32).collect()
}

/// How many of `found` are beyond the bound.
fn n_beyond(found: &[f32], expected: &[f32], bound: Bound) -> usize {
    assert_eq!(found.len(), expected.len());
    let beyond = |(a, b): &(&f32, &f32)| {
        let (a, b) = (f64::from(**a), f64::from(**b));
        !((a - b).abs() <= bound.absolute + bound.relative * b.abs())
    };
    found.iter().zip(expected).filter(beyond).count()
}

fn compare(gpu: &Gpu, shape: &ModelShape, n: usize, n_taps: usize, anchor_weight: f32) {
    let (f, s, k, c) = (shape.feature_dim, shape.n_log_scales(), shape.n_offsets, shape.values_per_anchor());
    let n_out = 2 * c + 3;
    let rows: Vec<u32> = (0..n as u32).filter(|row| row % 5 != 3).collect();
    let base_steps = [0.5, 0.02, 0.1];
    let values = [of(1, n * f, 4.0), of(2, n * s, 0.1), of(3, n * 3 * k, 0.8)];
    let mask_logits = of(4, n * k, 8.0);
    let mut outputs = of(5, rows.len() * n_out, 5.0);
    for (i, output) in outputs.iter_mut().enumerate() {
        // Beyond what means, scales and steps reach, and at the ends.
        *output = match i % 97 {
            11 => -3.0,
            12 => 0.875,
            _ => *output,
        };
    }
    let (taps, first_tap_weight) = (of(6, first_tap(f, n_taps), 0.4), 13);
    let weight = 0.125f32;
    let before = 0.0;
    let mut d_values = [f, s, 3 * k].map(|width| vec![before; n * width]);
    let mut d_mask_logits = vec![before; n * k];
    let mut d_outputs = vec![0.0; outputs.len()];
    let mut d_taps = vec![0.0; taps.len()];
    let mut sums = [0.0; 3];
    let mut scratch = cpu::Scratch::default();
    let per_row = rows.iter().zip(outputs.chunks_exact(n_out)).zip(d_outputs.chunks_exact_mut(n_out));
    for ((row, outputs), d_outputs) in per_row {
        let of = |width: usize| *row as usize * width..(*row as usize + 1) * width;
        let drawn: Vec<bool> = mask_logits[of(k)].iter().map(|logit| mask::is_open(*logit)).collect();
        let mut d_drawn = vec![0.0; k];
        let [d_features, d_log_scales, d_offsets] = &mut d_values;
        let one = cpu::Rows {
            shape,
            base_steps,
            values: [&values[0][of(f)], &values[1][of(s)], &values[2][of(3 * k)]],
            drawn: &drawn,
            outputs,
            n_taps,
            taps: &taps,
        };
        let mut gradients = cpu::Gradients {
            values: [&mut d_features[of(f)], &mut d_log_scales[of(s)], &mut d_offsets[of(3 * k)]],
            outputs: d_outputs,
            taps: &mut d_taps,
            drawn: &mut d_drawn,
        };
        let bits = cpu::forward_backward(&one, weight, &mut scratch, &mut gradients);
        let shared = anchor_weight * ((bits[0] + bits[1]) / k as f64) as f32;
        for ((d, logit), d_drawn) in d_mask_logits[of(k)].iter_mut().zip(&mask_logits[of(k)]).zip(d_drawn) {
            *d += (d_drawn + shared) * mask::slope(*logit);
        }
        for (sum, bits) in sums.iter_mut().zip(bits) {
            *sum += bits;
        }
    }

    let upload = |values: &[f32]| Buffer::upload(gpu, "test", values).expect("room");
    let weights = upload(&[vec![3.0; first_tap_weight], taps].concat());
    let d_weights = upload(&vec![0.5; weights.len()]);
    let there = values.each_ref().map(|values| upload(values));
    let d_there = values.each_ref().map(|values| upload(&vec![before; values.len()]));
    let (masks, d_masks) = (upload(&mask_logits), upload(&vec![before; n * k]));
    let (outs, d_outs) = (upload(&outputs), upload(&vec![9.0; outputs.len()]));
    let totals = upload(&[7.0; 4]);
    let rows = Buffer::upload(gpu, "rows", &rows).expect("room");
    let sampled = Sampled {
        shape,
        base_steps,
        rows: &rows,
        values: there.each_ref(),
        mask_logits: &masks,
        outputs: &outs,
        n_taps,
        weights: &weights,
        first_tap: first_tap_weight,
    };
    let gradients =
        Gradients { values: d_there.each_ref(), mask_logits: &d_masks, outputs: &d_outs, weights: &d_weights };
    let mut kernels = AnchorBits::new(gpu).expect("room");
    let mut commands = Commands::new(gpu);
    let by = [weight, anchor_weight];
    kernels.forward_backward(gpu, &mut commands, &sampled, by, &gradients, &totals, 1).expect("room");
    commands.submit().expect("runs");
    let read = |buffer: &Buffer<f32>| buffer.read(gpu).expect("runs");
    let name = |what: &str| format!("{what} of {n} anchors, {n_taps} taps");
    let found = read(&totals);
    assert_eq!(found[0], 7.0);
    let bound = Bound { relative: 1e-5, absolute: 1e-4 };
    assert_close(&name("bits"), &found[1..], &sums.map(|sum| sum as f32), bound);
    let bound = |expected: &[f32]| Bound { relative: 1e-4, absolute: 1e-5 * largest(expected) };
    for (found, expected) in d_there.iter().zip(&d_values) {
        let n_beyond = n_beyond(&read(found), expected, bound(expected));
        assert!(n_beyond <= expected.len() / 1000, "{}: {n_beyond} values", name("gradient"));
    }
    let n_beyond = n_beyond(&read(&d_outs), &d_outputs, bound(&d_outputs));
    assert!(n_beyond <= d_outputs.len() / 1000, "{}: {n_beyond} outputs", name("gradient"));
    assert_close(&name("masks"), &read(&d_masks), &d_mask_logits, bound(&d_mask_logits));
    let d_weights = read(&d_weights);
    assert!(d_weights[..first_tap_weight].iter().all(|d| *d == 0.5), "no taps");
    let d_taps: Vec<f32> = d_taps.iter().map(|d| d + 0.5).collect();
    let of_sum = Bound { relative: 1e-4, absolute: 1e-5 * largest(&d_taps) };
    assert_close(&name("taps"), &d_weights[first_tap_weight..], &d_taps, of_sum);
}

#[test]
fn anchor_bits_agree_with_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for (n, (f, k, anisotropic, n_taps)) in SIZES.into_iter().zip([
        (8, 2, true, 3),
        (5, 1, false, 9),
        (32, 10, true, 0),
        (16, 5, true, 2),
        (32, 10, true, 4),
    ]) {
        let shape = ModelShape { anisotropic, ..ModelShape::plain(f, k) };
        for anchor_weight in [0.0, 0.125] {
            compare(gpu, &shape, n, n_taps, anchor_weight);
        }
    }
}
