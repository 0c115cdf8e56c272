use half::f16;
use pocketsplat_format::Bundle;

use super::{SMALL, info, random_scene};
use crate::bundle::{WriteOptions, decoded_heads, write};
use pocketsplat_kernels::scene::{Heads, ModelShape, Scene};

/// Heads of enough weights to pay for tables.
const WIDE: ModelShape = ModelShape { feature_dim: 32, n_offsets: 8, ..SMALL };

/// The heads of a bundle of `scene`, whether they are coded, and the bytes of their section.
fn written(scene: &Scene<f32>, head_fraction_bits: Option<[u8; 2]>) -> (Heads<f32>, bool, usize) {
    let options = WriteOptions { head_fraction_bits, ..WriteOptions::default() };
    let written = write(scene, &info(), &options).expect("a sound scene");
    let bundle = Bundle::parse(&written.bytes).expect("a sound bundle");
    (decoded_heads(&bundle), bundle.header().features.coded_heads, written.report.heads)
}

fn halves(weights: &[f32]) -> Vec<f32> {
    weights.iter().map(|&w| f16::from_f32(w).to_f32()).collect()
}

#[test]
fn raw_weights_come_back_as_halves() {
    let scene = random_scene(SMALL, 10, 81);
    let (heads, is_coded, n_bytes) = written(&scene, None);
    assert!(!is_coded, "nothing asked for");
    for (stored, trained) in heads.each().zip(scene.heads.each()) {
        for (stored, trained) in stored.groups().into_iter().zip(trained.groups()) {
            assert_eq!(stored, halves(trained));
        }
    }
    assert_eq!(n_bytes, 2 * scene.heads.each().map(|head| head.n_params()).sum::<usize>(), "two bytes each");
}

#[test]
fn coded_weights_come_back_within_half_a_step_and_save_bytes() {
    let mut scene = random_scene(WIDE, 10, 82);
    // Outliers take the escape; both fit 32767 steps.
    (scene.heads.opacity.w1[3], scene.heads.colour.w2[5]) = (-100.0, 200.0);
    let (_, _, raw_bytes) = written(&scene, None);
    let (heads, is_coded, n_bytes) = written(&scene, Some([8, 7]));
    assert!(is_coded && 10 * n_bytes < 9 * raw_bytes, "{n_bytes} of {raw_bytes} bytes");
    for (stored, trained) in heads.each().zip(scene.heads.each()) {
        for (stored, trained, step) in [(&stored.w1, &trained.w1, 1.0 / 256.0), (&stored.w2, &trained.w2, 1.0 / 128.0)]
        {
            let farthest = stored.iter().zip(trained).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(farthest <= 0.5 * step, "{farthest} with steps of {step}");
            assert!(stored.iter().all(|w| (w / step).fract() == 0.0), "whole steps of {step}");
        }
        assert_eq!((&stored.b1, &stored.b2), (&halves(&trained.b1), &halves(&trained.b2)), "biases");
    }
}

#[test]
fn weights_that_coding_would_not_shorten_stay_halves() {
    let (_, is_coded, _) = written(&random_scene(WIDE, 10, 83), Some([24, 24]));
    assert!(!is_coded, "beyond 32767 steps");
    let (_, is_coded, _) = written(&random_scene(SMALL, 10, 83), Some([9, 9]));
    assert!(!is_coded, "tables cost more than so few weights save");
}
