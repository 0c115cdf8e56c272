//! Symbols at and beyond the ends of their tables, under both coders.

use pocketsplat_codec::bundle::{self, ChannelCoding, WriteOptions};
use pocketsplat_format::Bundle;
use pocketsplat_kernels::scene::Scene;

use super::picture::{camera, codec_error};
use super::{Case, Family, error};
use crate::frame::info_for;
use crate::scenes::{CASES, masked, random_scene, with_context};

const ANSWER: &str = "\
A coded value is off by the rounding to its symbol, half a step, and by nothing else.";

const ANALYSIS: &str = "\
Entropy coding is exact. The two f32 operations that make the value again add 32,767·1.2e-7 of a step, which is 0.004. Under a context
the step of an anchor is up to 2^(7/8) = 1.834 base steps, and the errors are given in base steps. A symbol outside its table, however
far, is escaped. A table of one symbol takes no bits at all.";

/// Half a step, and what the two operations of a value leave; under a context of 1.834 base steps.
const STATIC: f64 = 0.505;
const CONTEXT: f64 = 0.922;

fn error_of(scene: &Scene<f32>, channels: ChannelCoding) -> f64 {
    let options = WriteOptions { channels, chunk_anchors: 64, ..WriteOptions::default() };
    let written = bundle::write(scene, &info_for(&camera()), &options).expect("a scene to be written");
    codec_error(scene, &Bundle::parse(&written.bytes).expect("the writer's bundle is sound"))
}

fn scene() -> Scene<f32> {
    masked(random_scene(&CASES[1]), 3)
}

/// Values of a kind set to the farthest symbols of their step, up and down in turn.
fn farthest(values: &mut [f32], step: f32) {
    for (i, value) in values.iter_mut().enumerate() {
        *value = if i % 2 == 0 { 32_767.0 } else { -32_767.0 } * step;
    }
}

/// A context whose network says `mean` and `log2_scale` of everything.
fn opinionated(mean: f32, log2_scale: f32) -> Scene<f32> {
    let mut scene = with_context(scene(), 5);
    let n_channels = scene.shape.values_per_anchor();
    if let Some(model) = &mut scene.context {
        model.networks[0].mlp.b2[..n_channels].fill(mean);
        model.networks[0].mlp.b2[n_channels..2 * n_channels].fill(log2_scale);
    }
    scene
}

pub(super) fn family() -> Family {
    let steps = "worst value, steps";
    let base_steps = "worst value, base steps";
    let cases: Vec<Case> = vec![
        error("ends of the symbols", "every value at ±32,767 steps", steps, STATIC, || {
            let mut scene = scene();
            farthest(&mut scene.anchors.features, 0.1);
            farthest(&mut scene.anchors.log_scales, 0.05);
            farthest(&mut scene.anchors.offsets, 0.1);
            error_of(&scene, ChannelCoding::default())
        }),
        error("one outlier", "a feature at 32,767 steps among zeros", steps, STATIC, || {
            let mut scene = scene();
            scene.anchors.features.fill(0.0);
            scene.anchors.features[11] = 3276.7;
            error_of(&scene, ChannelCoding::default())
        }),
        error("one value", "every value the same: tables of one symbol", steps, STATIC, || {
            let mut scene = scene();
            for values in [&mut scene.anchors.features, &mut scene.anchors.log_scales, &mut scene.anchors.offsets] {
                values.fill(-1.25);
            }
            error_of(&scene, ChannelCoding::default())
        }),
        error("every symbol once", "features spread over all of ±32,767 steps", steps, STATIC, || {
            let mut scene = scene();
            let n = scene.anchors.features.len() as f32;
            for (i, value) in scene.anchors.features.iter_mut().enumerate() {
                *value = (2.0 * i as f32 / n - 1.0) * 3276.7;
            }
            error_of(&scene, ChannelCoding::default())
        }),
        error("beyond a context's tables", "values hundreds of steps from the mean", base_steps, CONTEXT, || {
            let mut scene = with_context(scene(), 5);
            for (i, value) in scene.anchors.features.iter_mut().enumerate().step_by(7) {
                *value = if i % 2 == 0 { 655.0 } else { -655.0 };
            }
            error_of(&scene, ChannelCoding::Context)
        }),
        error("a context too sure", "scales of 2⁻¹⁰⁰: every symbol escapes", base_steps, CONTEXT, || {
            error_of(&opinionated(0.0, -100.0), ChannelCoding::Context)
        }),
        error("a context too vague", "scales of 2¹⁰⁰, held at the widest", base_steps, CONTEXT, || {
            error_of(&opinionated(0.0, 100.0), ChannelCoding::Context)
        }),
        error("a context far off", "means 2,000 base steps away", base_steps, CONTEXT, || {
            error_of(&opinionated(2000.0, 0.0), ChannelCoding::Context)
        }),
    ];
    Family { title: "Codec", answer: ANSWER, analysis: ANALYSIS, cases }
}
