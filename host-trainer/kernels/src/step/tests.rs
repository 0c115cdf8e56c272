//! The whole step against finite differences, and f32 against f64.

use glam::DVec3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use pocketsplat_format::context::{GridFrame, GridLevel, Group, LevelKind};

use super::coding::{IntegerModel, RateTerms};
use super::draw::BLOCK;
use super::example::{camera, flatten, gradients, scene, shapes, step_with, truth};
use super::*;
use crate::finite_difference::{assert_piecewise_gradient, random};
use crate::integer_model::{parse, rounded, section};
use crate::ops::rate::noise::Stream;
use crate::scene::init::initial_scene;
use crate::scene::{ContextModel, ContextNetwork};

fn step<R: Real>(scene: &Scene<R>) -> (f64, Vec<f64>) {
    let (report, workspace) = coded_step(scene, &Coding::Raw);
    (report.loss.into(), gradients(scene, &workspace))
}

fn coded_step<R: Real>(scene: &Scene<R>, coding: &Coding<'_, R>) -> (StepReport<R>, Workspace<R>) {
    step_with(scene, coding, &Loss::plain(LossWeights::default()))
}

/// A context whose grid and network say something.
fn context(seed: u64, scene: &Scene<f64>) -> ContextModel<f64> {
    let levels = [(LevelKind::Volume, 5, 125), (LevelKind::Volume, 40, 64), (LevelKind::Xz, 9, 81)];
    let levels = levels.map(|(kind, resolution, n_rows)| GridLevel { kind, resolution, n_rows }).to_vec();
    let frame = GridFrame::spanning([-60; 3], [60; 3]);
    let mut model = ContextModel::filled(&scene.shape, frame, levels, 6, [1.0, 0.1, 0.2], 0.0);
    model = model.with_taps(&scene.shape, 2, 0.0);
    model.rows = random(seed, model.rows.len());
    // Outputs of less than 0.8, so that no step or scale is at the end of its range.
    for (i, (group, size)) in (1..).zip(model.networks[0].groups_mut().into_iter().zip([0.4, 0.4, 0.05, 0.3, 0.4])) {
        *group = random(seed + i, group.len()).iter().map(|v| size * v).collect();
    }
    model
}

/// The scene with anchors that share cells.
fn close_together(mut scene: Scene<f64>) -> Scene<f64> {
    for [_, y, z] in &mut scene.anchors.lattice {
        (*y, *z) = (*y / 8, *z / 8);
    }
    scene
}

/// Networks of anchors that follow anchors, which say something.
fn levels(seed: u64, scene: &Scene<f64>) -> ContextModel<f64> {
    let frame = GridFrame::spanning([-60; 3], [60; 3]);
    let mut model = ContextModel::following(&scene.shape, frame, [5, 6, 7], 6, [1.0, 0.1, 0.2], 0.0);
    for (seed, network) in (seed..).step_by(10).zip(&mut model.networks) {
        for (i, (group, size)) in (1..).zip(network.mlp.groups_mut().into_iter().zip([0.4, 0.4, 0.05, 0.3])) {
            *group = random(seed + i, group.len()).iter().map(|v| size * v).collect();
        }
    }
    model
}

fn rate(grid: f64) -> RateTerms {
    // Bits that weigh as much as the image, so that a wrong gradient shows.
    RateTerms { lambda: 0.3, sample: 0.6, mask: 0.1, masks_weigh_anchors: false, grid }
}

#[test]
fn the_whole_step_agrees_with_finite_differences() {
    for (seed, shape) in (1..).zip(shapes()) {
        let mut scene = scene(seed, shape);
        let (_, analytic) = step(&scene);
        let x: Vec<f64> = flatten(&mut scene).into_iter().map(|p| *p).collect();
        assert_piecewise_gradient("step", &x, &analytic, |x| {
            let mut moved = scene.clone();
            for (p, v) in flatten(&mut moved).into_iter().zip(x) {
                *p = *v;
            }
            step(&moved).0
        });
    }
}

#[test]
fn a_step_under_an_exposure_agrees_with_finite_differences() {
    let mut scene = scene(4, shapes()[0]);
    let pinhole = Pinhole::new(&camera());
    let exposure = Exposure { gain: [1.4, 0.9, 0.6] };
    let mask: Vec<bool> = (0..truth().len() / 3).map(|i| i % 5 > 0).collect();
    let exposed = |scene: &Scene<f64>| {
        let mut workspace = Workspace::new(&scene.shape);
        let target = TargetView::new(&pinhole, truth(), Some(&mask), [0.1, 0.2, 0.3]).exposed(Some(exposure));
        let report = workspace.step(scene, &target, &Loss::plain(LossWeights::default()), &Coding::Raw);
        (report, gradients(scene, &workspace), workspace.image(scene, &pinhole, [0.1, 0.2, 0.3]))
    };
    let (report, analytic, image) = exposed(&scene);
    let sums = ExposureSums::of(&image, &truth(), Some(&mask));
    assert_eq!(report.exposure, Some(sums), "of the image before its exposure");
    let x: Vec<f64> = flatten(&mut scene).into_iter().map(|p| *p).collect();
    assert_piecewise_gradient("step", &x, &analytic, |x| {
        let mut moved = scene.clone();
        for (p, v) in flatten(&mut moved).into_iter().zip(x) {
            *p = *v;
        }
        exposed(&moved).0.loss
    });
}

#[test]
fn f32_agrees_with_f64() {
    for (seed, shape) in (11..).zip(shapes()) {
        let scene = scene(seed, shape);
        let (loss, exact) = step(&scene);
        let (rounded_loss, rounded) = step(&scene.cast::<f32>());
        assert!((loss - rounded_loss).abs() <= 1e-5 * loss);
        let scale = exact.iter().fold(0.0f64, |s, g| s.max(g.abs()));
        for (i, (a, b)) in exact.iter().zip(&rounded).enumerate() {
            assert!((a - b).abs() <= 1e-3 * a.abs().max(1e-2 * scale), "parameter {i}: f64 {a}, f32 {b}");
        }
    }
}

#[test]
fn a_view_that_sees_nothing_has_zero_gradients() {
    let mut scene = scene(3, shapes()[0]);
    for cell in &mut scene.anchors.lattice {
        cell[2] -= 5000;
    }
    let mut workspace = Workspace::new(&scene.shape);
    let pinhole = Pinhole::new(&camera());
    let target = TargetView::new(&pinhole, truth(), None, [0.0; 3]);
    let report = workspace.step(&scene, &target, &Loss::plain(LossWeights::default()), &Coding::Raw);
    assert!(report.loss.is_finite() && report.n_splats == 0);
    assert!(gradients(&scene, &workspace).iter().all(|g| *g == 0.0));
}

#[test]
fn blocks_of_anchors_add_up() {
    // The heads' gradients are sums over blocks; along random directions, because there are hundreds of weights.
    let shape = shapes()[0];
    let points: Vec<DVec3> = random(5, 3 * 700).chunks_exact(3).map(|p| DVec3::from_slice(p) * 0.6).collect();
    let mut scene = initial_scene(shape, 0.001, &points, &mut ChaCha8Rng::seed_from_u64(5)).cast::<f64>();
    assert!(scene.anchors.len() > 2 * BLOCK, "several blocks");
    scene.anchors.features = random(6, scene.anchors.features.len());
    scene.anchors.log_scales.iter_mut().for_each(|s| *s -= 0.5);
    let (_, analytic) = step(&scene);
    let x: Vec<f64> = flatten(&mut scene).into_iter().map(|p| *p).collect();
    let first_weight = x.len() - scene.heads.each().map(|h| h.n_params()).sum::<usize>();
    for seed in 0..4 {
        let direction = random(90 + seed, x.len() - first_weight);
        let along: f64 = direction.iter().zip(&analytic[first_weight..]).map(|(d, g)| d * g).sum();
        assert_piecewise_gradient("heads", &[0.0], &[along], |t| {
            let mut moved = scene.clone();
            for (p, d) in flatten(&mut moved).into_iter().skip(first_weight).zip(&direction) {
                *p += t[0] * d;
            }
            step(&moved).0
        });
    }
}

#[test]
fn a_step_with_noise_and_rate_agrees_with_finite_differences() {
    let stream = Stream::of_run(31);
    let codings = [
        (shapes()[2], Coding::Noise { stream, steps: [0.3, 0.1, 0.2] }),
        (shapes()[1], Coding::Context { stream, rate: rate(0.0), exact: None }),
        (shapes()[6], Coding::Context { stream, rate: rate(0.0), exact: None }),
    ];
    for (shape, coding) in codings {
        let mut scene = scene(31, shape);
        if matches!(coding, Coding::Context { .. }) {
            scene.context = Some(context(31, &scene));
        }
        let (report, workspace) = coded_step(&scene, &coding);
        let sampled = report.rate.map_or(0, |rate| rate.n_sampled);
        assert!((5..20).contains(&sampled) || scene.context.is_none(), "{sampled} of 20 anchors are in the sample");
        let analytic = gradients(&scene, &workspace);
        let x: Vec<f64> = flatten(&mut scene).into_iter().map(|p| *p).collect();
        assert_piecewise_gradient("step", &x, &analytic, |x| {
            let mut moved = scene.clone();
            for (p, v) in flatten(&mut moved).into_iter().zip(x) {
                *p = *v;
            }
            coded_step(&moved, &coding).0.loss
        });
    }
}

/// Gradients stop at what a parent gives, so the parameters that move here are those that no anchor gives: offsets, and the
/// networks of level 0.
#[test]
fn a_step_with_levels_agrees_with_finite_differences() {
    let mut scene = close_together(scene(35, shapes()[1]));
    scene.context = Some(levels(35, &scene));
    let coding = Coding::Context { stream: Stream::of_run(35), rate: rate(0.0), exact: None };
    let (_, workspace) = coded_step(&scene, &coding);
    let level = |anchor: u32| workspace.parents.level(anchor);
    let of_level: Vec<usize> = (0..3).map(|l| (0u32..20).filter(|a| level(*a) == l).count()).collect();
    assert!(of_level.iter().all(|n| *n > 1), "anchors of all levels: {of_level:?}");
    let analytic = gradients(&scene, &workspace);
    let mut model = scene.context.clone().expect("given one");
    let n_of = |network: &ContextNetwork<f64>| network.groups().iter().map(|group| group.len()).sum::<usize>();
    let n_rest: usize = model.networks[1..].iter().map(n_of).sum();
    let n = analytic.len() - n_rest;
    let first = n - n_of(&model.networks[0]);
    assert!(analytic[n..].iter().any(|g| *g != 0.0), "levels 1 and 2 learn");
    let x: Vec<f64> = model.networks[0].groups_mut().into_iter().flatten().map(|p| *p).collect();
    assert_piecewise_gradient("network of level 0", &x, &analytic[first..n], |x| {
        let mut moved = scene.clone();
        for (p, v) in flatten(&mut moved)[first..n].iter_mut().zip(x) {
            **p = *v;
        }
        coded_step(&moved, &coding).0.loss
    });
}

/// Shifting a feature of all anchors is shifting the biases behind it, and all rows of its level together.
#[test]
fn the_gradients_of_the_grid_are_those_of_its_features() {
    let mut scene = scene(41, shapes()[0]);
    scene.context = Some(context(41, &scene));
    let coding = Coding::Context { stream: Stream::of_run(1), rate: rate(0.0), exact: None };
    let (_, workspace) = coded_step(&scene, &coding);
    let (model, gradients) = (scene.context.unwrap(), workspace.d_context.unwrap());
    let mut rows = gradients.rows.as_slice();
    for (l, level) in model.levels.iter().enumerate() {
        let (own, after) = rows.split_at(level.n_rows as usize * 4);
        rows = after;
        for f in 0..4 {
            let by_rows: f64 = own.iter().skip(f).step_by(4).sum();
            let mlp = &model.networks[0].mlp;
            let weights = mlp.w1.iter().skip(4 * l + f).step_by(mlp.n_in);
            let by_biases: f64 = weights.zip(&gradients.networks[0].mlp.b1).map(|(w, d)| w * d).sum();
            assert!((by_rows - by_biases).abs() < 1e-12 && by_rows != 0.0, "{by_rows} and {by_biases}");
        }
    }
}

#[test]
fn masks_hide_save_bits_and_are_pushed_shut() {
    let mut scene = scene(51, shapes()[0]);
    let open = coded_step(&scene, &Coding::Raw).0;
    let k = scene.shape.n_offsets;
    for logit in scene.anchors.mask_logits.iter_mut().step_by(k) {
        *logit = -5.0;
    }
    scene.anchors.mask_logits[k..2 * k].fill(-5.0);
    scene.context = Some(context(51, &scene));
    let coding = Coding::Context { stream: Stream::of_run(1), rate: rate(1.0), exact: None };
    let (report, workspace) = coded_step(&scene, &coding);
    assert!(report.n_gaussians < open.n_gaussians);
    for block in workspace.blocks() {
        assert!(!block.anchors.contains(&1), "an anchor without a drawn offset is invisible");
        assert!(block.sources.iter().all(|source| source.offset != 0));
        for (row, anchor) in block.anchors.iter().enumerate() {
            let logits = &scene.anchors.mask_logits[*anchor as usize * k..];
            assert!(block.d_mask_logits[row * k] > 0.0, "only the mask term: {}", logits[0]);
        }
    }
    let without = coded_step(&scene, &Coding::Context { stream: Stream::of_run(1), rate: rate(0.0), exact: None }).0;
    assert!(report.loss > without.loss, "the grid's bits count");
}

/// HAC++: each mask of an anchor answers for a K-th part of its features' and log-scales' bits, whether it is open or shut.
#[test]
fn masks_answer_for_their_anchors() {
    let mut scene = scene(53, shapes()[0]);
    let k = scene.shape.n_offsets;
    scene.anchors.mask_logits[1] = -5.0;
    scene.context = Some(context(53, &scene));
    let gradients = |masks_weigh_anchors: bool| {
        let rate = RateTerms { mask: 0.0, sample: 1.0, masks_weigh_anchors, ..rate(0.0) };
        let (report, workspace) = coded_step(&scene, &Coding::Context { stream: Stream::of_run(1), rate, exact: None });
        let blocks = workspace.blocks().iter();
        let logits = blocks.clone().flat_map(|block| {
            block.anchors.iter().flat_map(|a| scene.anchors.mask_logits[*a as usize * k..][..k].to_vec())
        });
        let found: Vec<(f64, f64)> = logits.zip(blocks.flat_map(|block| block.d_mask_logits.clone())).collect();
        (report.rate.expect("a rate"), found)
    };
    let ((rate_report, with), (_, without)) = (gradients(true), gradients(false));
    // Per anchor, in the weight of a bit; every anchor is drawn.
    let weight = 0.3 / (rate_report.n_sampled * scene.shape.values_per_anchor()) as f64;
    let mut sum = 0.0;
    for (with, without) in with.chunks(k).zip(without.chunks(k)) {
        let shares: Vec<f64> = with
            .iter()
            .zip(without)
            .map(|((logit, a), (_, b))| (a - b) / crate::ops::heads::mask::slope(*logit))
            .collect();
        assert!(shares.iter().all(|share| *share > 0.0 && (share / shares[0] - 1.0).abs() < 1e-9), "{shares:?}");
        sum += shares.iter().sum::<f64>();
    }
    let [features, log_scales, _] = rate_report.bits;
    let expected = weight * rate_report.n_sampled as f64 * (features + log_scales);
    assert!((sum / expected - 1.0).abs() < 1e-9, "{sum} instead of {expected}");
}

/// In the last phase the step draws the very values that a decoder reads.
#[test]
fn rounded_values_are_symbols_of_the_integer_model() {
    rounding_twice_is_rounding_once(scene(61, shapes()[1]), context);
    rounding_twice_is_rounding_once(scene(61, shapes()[6]), context);
    rounding_twice_is_rounding_once(close_together(scene(61, shapes()[1])), levels);
}

fn rounding_twice_is_rounding_once(mut exact: Scene<f64>, model: fn(u64, &Scene<f64>) -> ContextModel<f64>) {
    exact.context = Some(model(61, &exact));
    let (scene, shape) = (exact.cast::<f32>(), exact.shape);
    let (model, n_channels) = (scene.context.as_ref().unwrap(), scene.shape.values_per_anchor());
    let section = section(model, n_channels).unwrap();
    let context = parse(&section, &scene.shape).unwrap();
    let networks = rounded(model, n_channels).unwrap();
    let step = |scene: &Scene<f32>| {
        let exact = Some(IntegerModel { context: &context, networks: &networks });
        coded_step(scene, &Coding::Context { stream: Stream::of_run(3), rate: rate(0.0), exact })
    };
    let (report, workspace) = step(&scene);
    let mut snapped = scene.clone();
    let parents = Parents::of_integers(&scene, &context);
    for (a, anchor) in (0..scene.anchors.len()).zip(0..) {
        let steps = parents.steps(&context, &scene, anchor);
        let arrays = [
            (Group::Feature, &mut snapped.anchors.features, scene.shape.feature_dim),
            (Group::LogScale, &mut snapped.anchors.log_scales, shape.n_log_scales()),
            (Group::Offset, &mut snapped.anchors.offsets, 3 * scene.shape.n_offsets),
        ];
        for (group, values, width) in arrays {
            for value in &mut values[a * width..(a + 1) * width] {
                *value = (*value / steps.value(group)).round_ties_even() * steps.value(group);
            }
        }
    }
    let (again, repeated) = step(&snapped);
    assert_eq!(
        (again.squared_error, again.loss),
        (report.squared_error, report.loss),
        "rounding twice is rounding once"
    );
    assert_eq!(coded_step(&snapped, &Coding::Raw).0.squared_error, report.squared_error);
    let n =
        flatten(&mut snapped).len() - networks.iter().flat_map(ContextNetwork::groups).map(<[f32]>::len).sum::<usize>();
    assert!(gradients(&scene, &workspace)[..n] == gradients(&snapped, &repeated)[..n], "straight through");
}
