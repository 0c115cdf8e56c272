//! Steps and runs on the device against the CPU's.

use std::sync::{Arc, Mutex};

use crate::train::config::{Backbone, Densification, LearningRate, Rates};
use crate::train::density::statistics::Statistics;
use crate::train::modules::{Detail, Distribution, Modules, Pruning};
use crate::train::optimiser::Optimiser;
use crate::train::run::device_sync::{trained, trained_mut};
use crate::train::test_capture::{many_views, tiny_capture, tiny_config};
use crate::train::{TrainConfig, TrainError, Trainer};
use pocketsplat_gpu::parity::{Bound, assert_close, gpu, largest};
use pocketsplat_gpu::{Gpu, GpuStep, choose};
use pocketsplat_kernels::integer_model;
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::rate::perturb::symbol;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::coding::Coding;
use pocketsplat_kernels::step::coding::{IntegerModel, RateReport, RateTerms};
use pocketsplat_kernels::step::{
    Block, ExposureSums, LossWeights, Phase, SharedDevice, StepInfo, StepReport, Workspace, planes,
};
use pocketsplat_kernels::step::{Exposure, Loss, Resident as _, TargetView};

fn device(gpu: &Gpu) -> Option<SharedDevice<f32>> {
    Some(Arc::new(Mutex::new(GpuStep::new(gpu).expect("room"))))
}

/// A step, and all gradients that it leaves by name.
fn step(
    device: Option<SharedDevice<f32>>,
    scene: &Scene<f32>,
    target: &TargetView<'_, f32>,
    modules: Modules,
) -> (StepReport<f32>, Vec<(&'static str, Vec<f32>)>) {
    let mut workspace = Workspace::new(&scene.shape);
    workspace.set_device(device);
    let stream = pocketsplat_kernels::ops::rate::noise::Stream::of_run(1).branch(1);
    let info = StepInfo { iteration: 10, iterations: 20, phase: Phase::Raw, scaled: true, stream };
    let terms = modules.terms();
    let loss = Loss { weights: LossWeights::default(), modules: Some((&terms, &info)), pruned_share: 0.0 };
    let report = workspace.try_step(scene, target, &loss, &Coding::Raw).expect("runs");
    let blocks = workspace.blocks();
    let gradients = vec![
        ("features", blocks.iter().flat_map(|b| b.d_features.clone()).collect()),
        ("log-scales", blocks.iter().flat_map(|b| b.d_log_scales.clone()).collect()),
        ("offsets", blocks.iter().flat_map(|b| b.d_offsets.clone()).collect()),
        ("screen", blocks.iter().flat_map(|b| b.screen_gradients.clone()).collect()),
        ("heads", workspace.d_heads.each().flat_map(|head| head.groups()).flatten().copied().collect()),
        ("background", workspace.d_background.to_vec()),
    ];
    (report, gradients)
}

/// Bounds: loss and squared error are sums over the image, known to 1e-4. Gradients of parameters are sums over some hundred splats, in
/// each of which a pixel may fall on either side of a cut: 2 % of the largest of their kind.
fn compare(gpu: &Gpu, scene: &Scene<f32>, target: &TargetView<'_, f32>, modules: Modules) {
    let (expected, on_cpu) = step(None, scene, target, modules);
    let (found, on_device) = step(device(gpu), scene, target, modules);
    let sums = |r: &StepReport<f32>| [r.loss, r.squared_error as f32];
    assert_close("loss, squared error", &sums(&found), &sums(&expected), Bound { relative: 1e-4, absolute: 1e-7 });
    for (found, expected) in found.exposure.iter().zip(&expected.exposure) {
        let gains = |sums: &ExposureSums| sums.log_gains().expect("pixels").map(|gain| gain as f32);
        assert_close("exposure", &gains(found), &gains(expected), Bound { relative: 0.0, absolute: 1e-4 });
    }
    assert_eq!(found.exposure.is_some(), expected.exposure.is_some());
    assert_eq!((found.n_gaussians, found.n_splats), (expected.n_gaussians, expected.n_splats));
    // Lists have a little more slack on the device.
    assert!(found.n_pairs >= expected.n_pairs && found.n_pairs <= expected.n_pairs + expected.n_pairs / 100 + 2);
    for ((name, found), (_, expected)) in on_device.iter().zip(&on_cpu) {
        assert!(largest(expected) > 0.0 || scene.anchors.is_empty(), "{name} says nothing");
        assert_close(name, found, expected, Bound { relative: 0.0, absolute: 2e-2 * largest(expected) });
    }
}

#[test]
fn a_step_agrees_with_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let capture = tiny_capture();
    for dilation_compensation in [false, true] {
        let mut config = tiny_config(40);
        config.shape.dilation_compensation = dilation_compensation;
        let mut trainer = Trainer::new(&capture, config).expect("a run");
        for _ in 0..20 {
            trainer.advance().expect("a step");
        }
        let view = &capture.train[1];
        let camera = Pinhole::new(&view.camera);
        let image = &view.photograph().expect("in memory").image;
        let mask: Vec<bool> = (0..image.rgb.len() / 3).map(|i| i % 7 > 1).collect();
        for mask in [None, Some(mask.as_slice())] {
            for detail in [false, true] {
                let exposure = detail.then_some(Exposure { gain: [1.2, 1.0, 0.8] });
                let target = TargetView::new(&camera, planes(image), mask, [0.2, 0.5, 0.1]).exposed(exposure);
                compare(
                    gpu,
                    &trainer.state.learned.scene,
                    &target,
                    Modules { detail: detail.then(Detail::default), ..config.modules },
                );
            }
        }
    }
}

/// The gradients of [`GpuStep::gradients`] by the CPU: rows by anchor, where blocks have one level after the other.
fn cpu_gradients(workspace: &Workspace<f32>) -> Vec<(&'static str, Vec<f32>)> {
    let by_anchor = |gradients: fn(&Block<f32>) -> &[f32]| {
        let mut rows: Vec<(u32, &[f32])> = Vec::new();
        for block in workspace.blocks() {
            let width = (gradients(block).len() / block.anchors.len().max(1)).max(1);
            rows.extend(block.anchors.iter().copied().zip(gradients(block).chunks_exact(width)));
        }
        rows.sort_by_key(|(anchor, _)| *anchor);
        rows.into_iter().flat_map(|(_, row)| row.to_vec()).collect::<Vec<f32>>()
    };
    let mut all = vec![
        ("features", by_anchor(|b| &b.d_features)),
        ("log-scales", by_anchor(|b| &b.d_log_scales)),
        ("offsets", by_anchor(|b| &b.d_offsets)),
        ("mask logits", by_anchor(|b| &b.d_mask_logits)),
        ("heads", workspace.d_heads.each().flat_map(|head| head.groups()).flatten().copied().collect()),
    ];
    if let Some(found) = &workspace.d_context {
        match found.networks.as_slice() {
            [network] => {
                all.push(("context network", network.groups().concat()));
                all.push(("grid", found.rows.clone()));
            }
            levels => {
                let names = ["network of level 0", "network of level 1", "network of level 2"];
                all.extend(names.into_iter().zip(levels).map(|(name, network)| (name, network.groups().concat())));
            }
        }
    }
    all
}

/// A step on the CPU, which is given the integers that a device makes itself, and the heads as they are written.
fn step_here(
    workspace: &mut Workspace<f32>,
    scene: &Scene<f32>,
    target: &TargetView<'_, f32>,
    loss: &Loss<'_, f32>,
    coding: &Coding<'_, f32>,
) -> StepReport<f32> {
    let Coding::Integers { stream, rate, head_step } = *coding else {
        return workspace.step(scene, target, loss, coding);
    };
    let (model, n_channels) = (scene.context.as_ref().expect("there is one"), scene.shape.values_per_anchor());
    let section = integer_model::section(model, n_channels).expect("a sound model");
    let context = integer_model::parse(&section, &scene.shape).expect("a sound section");
    let networks = integer_model::rounded(model, n_channels).expect("a sound model");
    let exact = Some(IntegerModel { context: &context, networks: &networks });
    let mut drawn = scene.clone();
    let matrices = drawn.heads.each_mut().flat_map(|head| head.w1.iter_mut().chain(&mut head.w2));
    matrices.for_each(|weight| *weight = symbol(*weight, head_step) * head_step);
    workspace.step(&drawn, target, loss, &Coding::Context { stream, rate, exact })
}

/// Bounds: as [`compare`]. Counts are those of the CPU but for a splat at the edge of the image.
#[test]
fn a_step_of_a_resident_scene_agrees_with_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let capture = tiny_capture();
    let plain = Backbone::Scaffold;
    let backbones = [plain, plain, plain, Backbone::Hac, Backbone::HacPlus, Backbone::ContextGs];
    for (i, backbone) in backbones.into_iter().enumerate() {
        let mut config = TrainConfig { backbone, ..tiny_config(40) };
        config.shape.dilation_compensation = i == 1;
        config.shape.view_colour = i == 1;
        config.shape.anisotropic = i != 2;
        if i == 1 {
            let pruning = Pruning { weight: 1e-2, from: 0.0, ..Pruning::default() };
            let distribution = Some(Distribution { divergence: 0.1, spread: 0.1 });
            let detail = Some(Detail::default());
            config.modules = Modules { detail, distribution, pruning: Some(pruning), ..config.modules };
            config.shape = config.modules.shape(config.shape);
        }
        let mut trainer = Trainer::new(&capture, config).expect("a run");
        for _ in 0..20 {
            trainer.advance().expect("a step");
        }
        let scene = &trainer.state.learned.scene;
        let view = &capture.train[1];
        let camera = Pinhole::new(&view.camera);
        let image = &view.photograph().expect("in memory").image;
        let mask: Vec<bool> = (0..image.rgb.len() / 3).map(|i| i % 7 > 1).collect();
        let exposure = (i == 1).then_some(Exposure { gain: [1.2, 1.0, 0.8] });
        let target =
            TargetView::new(&camera, planes(image), (i == 1).then_some(&mask), [0.2, 0.5, 0.1]).exposed(exposure);
        let stream = pocketsplat_kernels::ops::rate::noise::Stream::of_run(1).branch(1);
        let info = StepInfo { iteration: 10, iterations: 20, phase: Phase::Raw, scaled: true, stream };
        let terms = config.modules.terms();
        let loss = Loss { weights: LossWeights::default(), modules: Some((&terms, &info)), pruned_share: 0.0 };
        let rate = RateTerms {
            lambda: 0.3,
            sample: 0.5,
            mask: 0.1,
            masks_weigh_anchors: backbone == Backbone::HacPlus,
            grid: 0.5,
        };
        let codings = match &scene.context {
            None => vec![Coding::Raw, Coding::Noise { stream, steps: [0.1, 0.05, 0.1] }],
            Some(model) if model.shifts.is_some() => vec![Coding::Context { stream, rate, exact: None }],
            Some(_) => {
                let head_step = 1.0 / 128.0;
                vec![Coding::Context { stream, rate, exact: None }, Coding::Integers { stream, rate, head_step }]
            }
        };
        assert_eq!(scene.context.is_some(), backbone.is_coded());
        for coding in codings {
            let mut workspace = Workspace::new(&scene.shape);
            let expected = step_here(&mut workspace, scene, &target, &loss, &coding);
            let mut optimiser = Optimiser::new(scene);
            let mut statistics = Statistics::new(scene.anchors.len(), scene.shape.n_offsets);
            let mut device = GpuStep::new(gpu).expect("room");
            assert!(device.can_step(scene, &loss, &coding));
            device.load(&trained(scene, &optimiser, &statistics)).expect("room");
            let found = device.step(&target, &loss, &coding, 1e18).expect("runs");
            assert!(found.is_sound);
            let sums = |r: &StepReport<f32>| [r.loss, r.squared_error as f32];
            let close = Bound { relative: 1e-4, absolute: 1e-7 };
            assert_close("loss, squared error", &sums(&found.report), &sums(&expected), close);
            assert_eq!(found.report.n_gaussians, expected.n_gaussians);
            if let (Some(found), Some(expected)) = (found.report.rate, expected.rate) {
                assert_eq!(found.n_sampled, expected.n_sampled);
                let bits = |rate: RateReport| rate.bits.map(|bits| bits as f32);
                assert_close("bits", &bits(found), &bits(expected), close);
            }
            assert_eq!(found.report.rate.is_some(), expected.rate.is_some());
            assert!(found.report.n_splats.abs_diff(expected.n_splats) <= 1 + expected.n_splats / 1000);
            for ((name, found), (_, expected)) in
                device.gradients().expect("runs").iter().zip(cpu_gradients(&workspace))
            {
                assert!(largest(&expected) > 0.0, "{name} says nothing");
                let bound = Bound { relative: 0.0, absolute: 2e-2 * largest(&expected) };
                assert_close(name, found, &expected, bound);
            }
            let bound = Bound { relative: 0.0, absolute: 2e-2 * largest(&workspace.d_background) };
            assert_close("background", &found.d_background, &workspace.d_background, bound);

            device.add_statistics().expect("runs");
            let sound = device.step(&target, &loss, &coding, 0.0).expect("runs").is_sound;
            assert!(!sound, "no gradient is at most 0");
            let mut back = scene.clone();
            let there = trained_mut(&mut back, &mut optimiser, &mut statistics);
            device.store(there).expect("it comes back");
            assert!(back == *scene && optimiser == Optimiser::new(scene), "nothing has moved yet");
            let mut counted = Statistics::new(scene.anchors.len(), scene.shape.n_offsets);
            counted.add(&workspace, scene.shape.n_offsets);
            assert_eq!(statistics.n_views, counted.n_views);
            let differ = statistics.n_drawn.iter().zip(&counted.n_drawn).filter(|(a, b)| a != b).count();
            assert!(differ <= 1 + expected.n_splats / 1000, "{differ} offsets");
            let relative = |values: &[f32]| Bound { relative: 1e-4, absolute: 2e-2 * largest(values) };
            let (found, expected) = (&statistics.opacity_sum, &counted.opacity_sum);
            assert_close("opacities", found, expected, Bound { relative: 1e-4, absolute: 1e-6 });
            let (found, expected) = (&statistics.gradient_sum, &counted.gradient_sum);
            assert_close("screen gradients", found, expected, relative(expected));
        }
    }
}

/// Means of the last 50 of 160 steps over anchors that stay: the squared error, and the bits of the scene.
fn run(device: Option<SharedDevice<f32>>, backbone: Backbone) -> (f64, Option<f64>) {
    let capture = many_views(7);
    // No growth, and no anchor goes: there a rounding makes another scene, whose bits are 4 % apart.
    let densification = Densification { gradient_threshold: 1e6, min_opacity: 0.0, ..Densification::default() };
    // While rates stay high, a rounding goes another way, too.
    let rates = Rates {
        offset: LearningRate::falling(0.01, 1e-4),
        opacity_head: LearningRate::falling(0.002, 2e-5),
        colour_head: LearningRate::falling(0.008, 5e-5),
        grid: LearningRate::falling(0.005, 1e-5),
        context: LearningRate::falling(0.005, 1e-5),
        ..Rates::default()
    };
    let config = TrainConfig { backbone, rates, densification, ..tiny_config(160) };
    let mut trainer = Trainer::new(&capture, config).expect("a run");
    trainer.set_device(device);
    let (mut error, mut bits) = (0.0, None);
    while !trainer.is_done() {
        let report = trainer.advance().expect("a step").report;
        if trainer.state.iteration <= 110 {
            continue;
        }
        error += report.squared_error / 50.0;
        let n_anchors = trainer.state.learned.scene.anchors.len() as f64;
        if let Some(rate) = report.rate {
            *bits.get_or_insert(0.0) += n_anchors * rate.bits.iter().sum::<f64>() / 50.0;
        }
    }
    (error, bits)
}

/// Bounds: 0.05 dB, and 1 % of the bits. On the CPU alone, in 300 steps, log-scales that begin one rounding away change the mean of
/// the bits by up to 0.5 %, those of the last step by 5 %.
#[test]
fn runs_of_all_backbones_come_to_the_same() {
    let Some(gpu) = gpu() else { return };
    for backbone in [Backbone::Scaffold, Backbone::Hac, Backbone::HacPlus, Backbone::ContextGs] {
        let ((cpu_error, cpu_bits), (error, bits)) = (run(None, backbone), run(device(gpu), backbone));
        let decibels = 10.0 * (cpu_error / error).log10();
        eprintln!("{backbone:?}: {decibels:.4} dB, bits {bits:?} for {cpu_bits:?}");
        assert!(decibels.abs() <= 0.05, "{backbone:?}: {decibels} dB");
        if let (Some(found), Some(expected)) = (bits, cpu_bits) {
            assert!((found / expected - 1.0).abs() <= 0.01, "{backbone:?}: {found} bits, {expected} on the CPU");
        }
        assert_eq!(bits.is_some(), backbone != Backbone::Scaffold);
    }
}

#[test]
fn the_same_run_gives_the_same_bits_and_goes_on_anywhere() {
    let Some(gpu) = gpu() else { return };
    let capture = tiny_capture();
    let train = |trainer: &mut Trainer<'_>, until: u32| {
        while trainer.state.iteration < until {
            trainer.advance().expect("a step");
        }
    };
    let begin = |until: u32| {
        let config = TrainConfig { backbone: Backbone::Hac, ..tiny_config(40) };
        let mut trainer = Trainer::new(&capture, config).expect("a run");
        trainer.set_device(device(gpu));
        train(&mut trainer, until);
        trainer
    };
    let whole = begin(40);
    let mut half = begin(20);
    half.fetch().expect("it comes back");
    let mut checkpoint = Vec::new();
    half.save(&mut checkpoint).expect("memory");
    let restored = || Trainer::restore(&capture, &checkpoint).expect("sound");
    let mut on_device = restored().run;
    on_device.set_device(device(gpu));
    assert_eq!(restored().written_by, on_device.kernels(), "which name the device");
    train(&mut on_device, 40);
    assert!(
        on_device.scene().anchors == whole.state.learned.scene.anchors
            && on_device.scene().heads == whole.state.learned.scene.heads
    );
    let mut on_cpu = restored().run;
    assert_ne!(restored().written_by, on_cpu.kernels());
    train(&mut on_cpu, 40);
    assert!(on_cpu.is_done());
}

/// Bound: of the ways that all values of an array go in three steps, 5 % in sum; some round to another symbol.
#[test]
fn the_last_phase_moves_everything_as_on_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let capture = tiny_capture();
    for backbone in [Backbone::Hac, Backbone::HacPlus] {
        let config = TrainConfig { backbone, ..tiny_config(40) };
        let mut trainer = Trainer::new(&capture, config).expect("a run");
        while trainer.state.iteration < 36 {
            trainer.advance().expect("a step");
        }
        assert_eq!(config.phase(37), Phase::IntegerModel);
        let mut checkpoint = Vec::new();
        trainer.save(&mut checkpoint).expect("memory");
        let after = |device: Option<SharedDevice<f32>>| {
            let mut run = Trainer::restore(&capture, &checkpoint).expect("sound").run;
            run.set_device(device);
            (0..3).for_each(|_| drop(run.advance().expect("a step")));
            run.fetch().expect("it comes back");
            moved(&run.state.learned.scene)
        };
        let (before, on_cpu, on_device) = (moved(&trainer.state.learned.scene), after(None), after(device(gpu)));
        for (((name, before), (_, cpu)), (_, device)) in before.iter().zip(&on_cpu).zip(&on_device) {
            let apart = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>();
            let (way, off) = (apart(before, cpu), apart(device, cpu));
            assert!(way > 0.0 && off <= 0.05 * way, "{backbone:?}, {name}: {off} off on a way of {way}");
        }
    }
}

/// What the last phase moves.
fn moved(scene: &Scene<f32>) -> Vec<(&'static str, Vec<f32>)> {
    let context = scene.context.as_ref().expect("there is one");
    vec![
        ("features", scene.anchors.features.clone()),
        ("log-scales", scene.anchors.log_scales.clone()),
        ("offsets", scene.anchors.offsets.clone()),
        ("heads", scene.heads.each().flat_map(|head| head.groups()).flatten().copied().collect()),
        ("context network", context.networks[0].groups().concat()),
        ("grid", context.rows.clone()),
    ]
}

#[test]
fn of_two_runs_on_one_device_the_first_is_told_that_its_scene_is_gone() {
    let Some(gpu) = gpu() else { return };
    let (capture, shared) = (tiny_capture(), device(gpu));
    let begin = || {
        let mut trainer = Trainer::new(&capture, tiny_config(6)).expect("a run");
        trainer.set_device(shared.clone());
        trainer.advance().expect("a step");
        trainer
    };
    let mut fetched = begin();
    fetched.fetch().expect("it comes back");
    let mut first = begin();
    let before = first.state.learned.scene.anchors.clone();
    let mut second = begin();
    for error in [first.fetch().expect_err("it is gone"), first.advance().expect_err("it is gone")] {
        assert!(matches!(error, TrainError::SceneReplaced) && error.to_string().contains("--resume"), "{error}");
    }
    assert!(first.state.learned.scene.anchors == before, "nothing of the other run came here");
    second.advance().expect("the last to come has the device");
    second.fetch().expect("it comes back");
    fetched.advance().expect("what stands here is brought anew");
}

#[test]
fn a_lost_device_ends_the_run_with_what_to_do_and_the_checkpoint_goes_on() {
    if gpu().is_none() {
        return;
    }
    let own = Gpu::open(&choose(None).expect("there is one")).expect("it opens twice");
    let capture = tiny_capture();
    let mut trainer = Trainer::new(&capture, tiny_config(6)).expect("a run");
    trainer.set_device(device(&own));
    for _ in 0..3 {
        trainer.advance().expect("a step");
    }
    let mut checkpoint = Vec::new();
    assert!(trainer.save(&mut checkpoint).is_err() && checkpoint.is_empty(), "what is newer is on the device");
    trainer.fetch().expect("it comes back");
    trainer.save(&mut checkpoint).expect("memory");
    own.destroy();
    let error = trainer.advance().expect_err("the device is gone").to_string();
    assert!(error.contains("the device was lost") && error.contains("--resume"), "{error}");
    let mut restored = Trainer::restore(&capture, &checkpoint).expect("sound").run;
    while !restored.is_done() {
        restored.advance().expect("a step");
    }
}
