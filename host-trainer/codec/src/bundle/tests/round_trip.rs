use std::collections::BTreeMap;

use pocketsplat_format::Bundle;
use pocketsplat_format::context::{Group, Trail};

use super::{
    SMALL, TABLES, camera, decoded_rows, info, options, random_scene, with_context, with_levels, write_bytes,
    write_random,
};
use crate::bundle::annotate::annotate;
use crate::bundle::channels::ContextWork;
use crate::bundle::{
    ChannelCoding, ChannelName, SizeReport, WriteError, WriteOptions, for_each_chunk, mean_steps, write,
};
use crate::render::decoder::core_image;
use crate::render::reference::ReferenceScene;
use pocketsplat_kernels::scene::{ModelShape, Scene};
use pocketsplat_kernels::step::parents::Parents;

/// Drawn offsets and symbols of the anchors that a bundle keeps, by their cells.
type Rows = BTreeMap<[i32; 3], (u32, Vec<i16>)>;

/// What the bundle of a scene holds, `steps` being those at a cell: features, log-scales, offsets.
fn rows_of_scene(scene: &Scene<f32>, steps: impl Fn([i32; 3]) -> [f32; 3]) -> Rows {
    let (f, k, anchors) = (scene.shape.feature_dim, scene.shape.n_offsets, &scene.anchors);
    let mut rows = Rows::new();
    for (a, &cell) in anchors.lattice.iter().enumerate() {
        let steps = steps(cell);
        let symbols =
            |values: &[f32], step: f32| values.iter().map(|&x| (x / step).round_ties_even() as i16).collect::<Vec<_>>();
        let features = symbols(&anchors.features[a * f..][..f], steps[0]);
        let log_scales = symbols(&anchors.log_scales[a * 6..][..6], steps[1]);
        let mut offsets = symbols(&anchors.offsets[a * 3 * k..][..3 * k], steps[2]);
        let mut drawn = 0;
        for offset in 0..k {
            if anchors.mask_logits[a * k + offset] > -4.595_12 {
                drawn |= 1 << offset;
            } else {
                offsets[3 * offset..][..3].fill(0);
            }
        }
        if drawn != 0 {
            rows.insert(cell, (drawn, [features, log_scales, offsets].concat()));
        }
    }
    rows
}

fn rows_of_bundle(bundle: &Bundle<'_>) -> Rows {
    decoded_rows(bundle).into_iter().map(|(site, symbols)| (site.lattice, (site.mask, symbols))).collect()
}

#[test]
fn every_symbol_comes_back_under_static_tables() {
    for (n_anchors, chunk_anchors) in [(1, 128), (300, 128), (129, 1), (500, 1024)] {
        let mut scene = random_scene(SMALL, n_anchors, 3);
        // Far outliers take the escape.
        scene.anchors.offsets[0] = 600.0;
        scene.anchors.features[0] = -655.0;
        scene.anchors.mask_logits[0] = 1.0;
        let bytes = write_bytes(&scene, &options(TABLES, chunk_anchors));
        let bundle = Bundle::parse(&bytes).expect("a sound bundle");
        assert!(bundle.tables().is_some(), "a scene without context");
        let expected = rows_of_scene(&scene, |_| [0.02; 3]);
        assert_eq!(rows_of_bundle(&bundle), expected, "{n_anchors} anchors in chunks of {chunk_anchors}");
        assert_eq!(bundle.n_anchors() as usize, expected.len(), "{n_anchors} anchors in chunks of {chunk_anchors}");
    }
}

/// Values of a context-coded scene that take escapes: a byte beyond the table, and three.
fn with_escapes(scene: &mut Scene<f32>) {
    scene.anchors.offsets[..3].copy_from_slice(&[18.0, -18.0, 1000.0]);
    scene.anchors.features[..2].copy_from_slice(&[655.0, -655.0]);
    scene.anchors.mask_logits[0] = 1.0;
}

#[test]
fn every_symbol_comes_back_under_a_context() {
    for (n_anchors, chunk_anchors) in [(1, 128), (300, 128), (129, 1), (500, 1024)] {
        let mut scene = with_context(random_scene(SMALL, n_anchors, 4), 5);
        with_escapes(&mut scene);
        let bytes = write_bytes(&scene, &options(ChannelCoding::Context, chunk_anchors));
        let bundle = Bundle::parse(&bytes).expect("a sound bundle");
        let context = bundle.context().expect("the coder asked for");
        let expected = rows_of_scene(&scene, |cell| {
            let steps = ContextWork::default().enter(context, cell);
            Group::ALL.map(|group| steps.value(group))
        });
        assert_eq!(rows_of_bundle(&bundle), expected, "{n_anchors} anchors in chunks of {chunk_anchors}");
    }
}

/// Steps follow the anchors before; what matters is that one rule finds them twice.
#[test]
fn every_symbol_comes_back_where_anchors_follow_anchors() {
    for (n_anchors, chunk_anchors) in [(1, 128), (300, 128), (129, 1), (500, 1024)] {
        let mut scene = with_levels(random_scene(SMALL, n_anchors, 4), 5);
        with_escapes(&mut scene);
        let bytes = write_bytes(&scene, &options(ChannelCoding::Context, chunk_anchors));
        let bundle = Bundle::parse(&bytes).expect("a sound bundle");
        let context = bundle.context().expect("the coder asked for");
        let (mut steps_of, mut n_of_level) = (BTreeMap::new(), [0; 3]);
        for_each_chunk(&bundle, |_, sites, symbols| {
            let (mut work, mut trail) = (ContextWork::default(), Trail::default());
            for (site, symbols) in sites.iter().zip(symbols.chunks(SMALL.values_per_anchor())) {
                let steps = work.enter(context, site.lattice);
                work.leave(&steps, symbols);
                let values = Group::ALL.map(|group| steps.value(group));
                steps_of.insert(site.lattice, values);
                n_of_level[context.place(&mut trail, site.lattice).expect("levels").level] += 1;
            }
        })
        .expect("sound chunks");
        let expected = rows_of_scene(&scene, |cell| steps_of.get(&cell).copied().unwrap_or([1.0; 3]));
        assert_eq!(rows_of_bundle(&bundle), expected, "{n_anchors} anchors in chunks of {chunk_anchors}");
        if chunk_anchors == 1024 {
            assert!(n_of_level.iter().all(|n| *n > 5), "anchors of all levels: {n_of_level:?}");
        }
        let report = SizeReport::of(&bundle).expect("sound");
        assert!(report.states() >= 0.0 && report.states() < 8.0 * f64::from(bundle.n_chunks()), "{report:?}");
    }
}

/// What training takes for a bundle's levels are those of the bundle: the same steps at every anchor.
#[test]
fn training_finds_the_levels_of_the_bundle() {
    let mut scene = with_levels(random_scene(SMALL, 700, 4), 7);
    levels_of_the_bundle(&scene, &options(ChannelCoding::Context, 256));
    scene.anchors.prune_rank = (0..700).map(|i| (i * 37 % 700) as f32 / 700.0).collect();
    let importance = Some(scene.anchors.prune_rank.clone());
    levels_of_the_bundle(&scene, &WriteOptions { importance, ..options(ChannelCoding::Context, 256) });
}

fn levels_of_the_bundle(scene: &Scene<f32>, options: &WriteOptions) {
    let bytes = write_bytes(scene, options);
    let bundle = Bundle::parse(&bytes).expect("a sound bundle");
    let context = bundle.context().expect("the coder asked for");
    let parents = Parents::of_integers(scene, context);
    let of_cell: BTreeMap<[i32; 3], u32> = scene.anchors.lattice.iter().copied().zip(0..).collect();
    for_each_chunk(&bundle, |_, sites, symbols| {
        let mut work = ContextWork::default();
        for (site, symbols) in sites.iter().zip(symbols.chunks(SMALL.values_per_anchor())) {
            let steps = work.enter(context, site.lattice);
            work.leave(&steps, symbols);
            assert_eq!(parents.steps(context, scene, of_cell[&site.lattice]), steps, "at {:?}", site.lattice);
        }
    })
    .expect("sound chunks");
}

#[test]
fn tables_can_have_a_contexts_mean_steps() {
    let scene = with_context(random_scene(SMALL, 200, 4), 5);
    let mean = mean_steps(&scene).expect("a scene with a context");
    let bytes = write_bytes(&scene, &options(ChannelCoding::Tables(mean), 64));
    let bundle = Bundle::parse(&bytes).expect("a sound bundle");
    let steps: Vec<f32> = bundle.tables().expect("the coder asked for").of_channels().map(|table| table.step).collect();
    let n_channels = SMALL.values_per_anchor();
    let base = scene.context.as_ref().map(|context| context.base_steps).expect("a context");
    for (channel, group) in [(0, 0), (SMALL.feature_dim, 1), (n_channels - 1, 2)] {
        let octaves = (steps[channel] / base[group]).log2();
        assert!((-3.0..=0.875).contains(&octaves), "channel {channel}: {octaves} octaves from the base step");
    }
    assert_eq!(
        rows_of_bundle(&bundle),
        rows_of_scene(&scene, |_| [steps[0], steps[SMALL.feature_dim], steps[n_channels - 1]])
    );
}

#[test]
fn an_empty_scene_is_a_bundle_of_background() {
    let scene = random_scene(SMALL, 0, 1);
    let bytes = write_bytes(&scene, &WriteOptions::default());
    let bundle = Bundle::parse(&bytes).expect("a sound bundle");
    let frame = core_image(&bundle, &camera(20, 20)).expect("a frame");
    assert!(frame.image.rgb.as_chunks().0.iter().all(|&pixel| pixel == [10, 20, 30]), "background everywhere");
}

#[test]
fn without_hidden_offsets_masks_cost_nothing() {
    let mut scene = random_scene(SMALL, 100, 2);
    scene.anchors.mask_logits.fill(1.0);
    let written = write(&scene, &info(), &WriteOptions::default()).expect("a sound scene");
    let report = written.report;
    assert_eq!((report.mask_model, report.ideal.masks), (0, 0.0), "{report:?}");
    assert_eq!(report.n_drawn_offsets, 300, "all of them");
}

#[test]
fn values_that_do_not_fit_are_named() {
    let fails = |scene: &Scene<f32>, why: &str| write(scene, &info(), &options(TABLES, 64)).expect_err(why);
    let shown = || {
        let mut scene = random_scene(SMALL, 10, 7);
        scene.anchors.mask_logits.fill(1.0);
        scene
    };
    let mut scene = shown();
    scene.anchors.log_scales[6 * 4 + 1] = f32::NAN;
    let error = fails(&scene, "NaN");
    assert!(matches!(error, WriteError::NotFinite { anchor: 4, channel: ChannelName::LogScale(1), .. }), "{error}");
    assert_eq!(
        error.to_string(),
        "anchor 4, log-scale 1: NaN is not finite; training diverged before this was written",
        "message"
    );
    let mut scene = shown();
    scene.anchors.offsets[9 * 2 + 4] = 1e4;
    let error = fails(&scene, "too far");
    assert!(
        matches!(error, WriteError::BeyondSymbols { anchor: 2, channel: ChannelName::Offset(1, 1), .. }),
        "{error}"
    );
    scene.anchors.mask_logits[3 * 2 + 1] = -10.0;
    write(&scene, &info(), &options(TABLES, 64)).expect("what is not drawn is not coded");
    let mut scene = shown();
    scene.heads.opacity.b1[2] = 1e6;
    let error = fails(&scene, "too large for half");
    assert!(matches!(error, WriteError::Weight { head: "opacity", .. }), "{error}");
    let mut scene = shown();
    scene.anchors.lattice[3][1] = i32::MIN;
    let error = fails(&scene, "beyond the lattice");
    assert!(matches!(error, WriteError::BeyondLattice { anchor: 3, .. }), "{error}");
    scene.anchors.lattice[3][1] = 1 << 22;
    let error = fails(&scene, "too wide");
    assert!(matches!(error, WriteError::LatticeTooWide { .. }), "{error}");
    let mut scene = shown();
    scene.anchors.lattice[8] = scene.anchors.lattice[5];
    let error = fails(&scene, "two of a cell");
    assert!(matches!(error, WriteError::SharedCell { anchors: [5, 8], .. }), "{error}");
    let error = write(&shown(), &info(), &options(ChannelCoding::Context, 64)).expect_err("no context to code with");
    assert_eq!(error, WriteError::NoContext, "{error}");
}

#[test]
fn the_annotated_dump_shows_every_byte_once() {
    for coder in [TABLES, ChannelCoding::Context] {
        let (_, bytes) = write_random(coder, SMALL, 40, 9, 16);
        let dump = annotate(&bytes, usize::MAX).expect("a sound bundle");
        let shown = dump.lines().filter_map(|line| {
            let (hex, _) = line.get(8..)?.split_at_checked(23)?;
            hex.trim().split(' ').map(|byte| u8::from_str_radix(byte, 16).ok()).collect::<Option<Vec<u8>>>()
        });
        assert_eq!(shown.flatten().collect::<Vec<u8>>(), bytes, "{coder:?}: the hexadecimal column is the file");
        let short = annotate(&bytes, 2).expect("a sound bundle");
        assert!(short.lines().count() < dump.lines().count() / 2, "{coder:?}: arrays are abbreviated");
    }
}

#[test]
fn the_size_report_accounts_for_every_byte() {
    for coder in [TABLES, ChannelCoding::Context] {
        let scene = with_context(random_scene(SMALL, 700, 9), 10);
        let importance = Some((0..700).map(|i| (i % 13) as f32).collect());
        let written = write(&scene, &info(), &WriteOptions { importance, ..options(coder, 128) }).expect("sound");
        let report = written.report;
        let bundle = Bundle::parse(&written.bytes).expect("a sound bundle");
        assert_eq!(SizeReport::of(&bundle), Ok(report), "{coder:?}: as the bundle tells");
        let sum: f64 = report.parts().iter().map(|part| part.bytes).sum();
        assert!((sum - written.bytes.len() as f64).abs() < 1e-6, "{coder:?}: {report:?}");
        // Each stream ends in two words of state, of which half a word on average says nothing.
        let per_chunk = report.states() / f64::from(bundle.n_chunks());
        assert!((0.0..6.0).contains(&per_chunk), "{coder:?}: {per_chunk} bytes a chunk");
    }
}

#[test]
fn large_scenes_pay_little_for_states_and_container() {
    let shape = ModelShape { feature_dim: 16, n_offsets: 6, ..SMALL };
    let scene = with_context(random_scene(shape, 6000, 9), 10);
    let mean_tables = ChannelCoding::Tables(mean_steps(&scene).expect("a scene with a context"));
    for coder in [mean_tables, ChannelCoding::Context] {
        let importance = Some((0..6000).map(|i| (i % 101) as f32).collect());
        let options = WriteOptions { channels: coder, importance, ..WriteOptions::default() };
        let written = write(&scene, &info(), &options).expect("a sound scene");
        let report = written.report;
        let over = report.states() / (report.ideal.total() / 8.0);
        assert!((0.0..0.005).contains(&over), "{coder:?}: {over} over the models' cross entropy");
        let container = report.container() / report.total as f64;
        assert!(container < 0.02, "{coder:?}: {container} of the file, {report:?}");
    }
}

#[test]
fn the_decoder_draws_what_the_oracle_draws() {
    for (seed, coder, compensation) in [(11, TABLES, false), (12, TABLES, true), (13, ChannelCoding::Context, true)] {
        let shape = ModelShape { dilation_compensation: compensation, ..SMALL };
        let (_, bytes) = write_random(coder, shape, 2500, seed, 128);
        let bundle = Bundle::parse(&bytes).expect("a sound bundle");
        let camera = camera(100, 70);
        let frame = core_image(&bundle, &camera).expect("a frame");
        let oracle = ReferenceScene::from_bundle(&bundle).expect("a sound bundle");
        let background = info().background.map(|byte| f64::from(byte) / 255.0);
        let reference = oracle.render(&camera, background);
        let worst = frame.image.rgb.as_chunks::<3>().0.iter().zip(&reference).flat_map(|(ours, exact)| {
            ours.iter().zip(exact).map(|(&byte, &value)| (f64::from(byte) - 255.0 * value.clamp(0.0, 1.0)).abs())
        });
        let worst = worst.fold(0.0, f64::max);
        // Half a step is the rounding to bytes; one more is a splat whose alpha is 1/255 here and a little less there.
        assert!(worst < 1.5, "seed {seed}: {worst} steps of 255, {:?}", frame.report);
        assert!(frame.report.splats > 1000, "a scene worth drawing: {:?}", frame.report);
    }
}
