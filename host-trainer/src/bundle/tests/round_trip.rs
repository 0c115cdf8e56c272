use pocketsplat_core::Bundle;

use super::{SMALL, STEPS, camera, info, random_scene, write_random};
use crate::bundle::annotate::annotate;
use crate::bundle::{ChannelName, SizeReport, WriteError, write};
use crate::render::decoder::core_image;
use crate::render::reference::ReferenceScene;
use crate::scene::{Heads, Scene};

/// One anchor as the trainer has it and as the bundle returns it: lattice and symbols.
type Row = ([i32; 3], Vec<i16>);

fn rows_of_scene(scene: &Scene<f32>, step: f32) -> Vec<Row> {
    let symbol = |x: &f32| (f64::from(*x) / f64::from(step)).round_ties_even() as i16;
    let anchors = &scene.anchors;
    (0..anchors.len())
        .map(|a| {
            let part = |values: &[f32], n: usize| values[a * n..(a + 1) * n].iter().map(symbol).collect::<Vec<_>>();
            let features = part(&anchors.features, scene.shape.feature_dim);
            let offsets = part(&anchors.offsets, 3 * scene.shape.n_offsets);
            (anchors.lattice[a], [features, part(&anchors.log_scales, 6), offsets].concat())
        })
        .collect()
}

fn rows_of_bundle(bundle: &Bundle<'_>) -> Vec<Row> {
    let n_channels = bundle.header().n_channels();
    let mut rows = Vec::new();
    for chunk in bundle.chunks() {
        let n = usize::from(chunk.n_anchors());
        let (mut lattice, mut symbols) = (vec![[0; 3]; n], vec![0; n * n_channels]);
        chunk.decode_symbols(bundle.tables(), &mut lattice, &mut symbols).expect("a sound chunk");
        rows.extend(lattice.into_iter().zip(symbols.chunks_exact(n_channels).map(<[i16]>::to_vec)));
    }
    rows
}

#[test]
fn every_symbol_comes_back() {
    for (n_anchors, chunk_anchors) in [(1, 128), (300, 128), (129, 1), (500, 1024)] {
        let (mut scene, _) = write_random(SMALL, n_anchors, 3, chunk_anchors);
        // Far outliers take the escape.
        scene.anchors.offsets[0] = 600.0;
        scene.anchors.features[0] = -655.0;
        let bytes = write(&scene, &info(), &STEPS).expect("a sound scene");
        let bundle = Bundle::parse(&bytes).expect("a sound bundle");
        let (mut expected, mut found) = (rows_of_scene(&scene, 0.02), rows_of_bundle(&bundle));
        // The bundle is in Morton order.
        expected.sort();
        found.sort();
        assert_eq!(expected, found, "{n_anchors} anchors in chunks of {chunk_anchors}");
    }
}

#[test]
fn an_empty_scene_is_a_bundle_of_background() {
    let scene = random_scene(SMALL, 0, 1);
    let bytes = write(&scene, &info(), &STEPS).expect("an empty scene");
    let bundle = Bundle::parse(&bytes).expect("a sound bundle");
    let frame = core_image(&bundle, &camera(20, 20)).expect("a frame");
    assert!(frame.image.rgb.as_chunks().0.iter().all(|&pixel| pixel == [10, 20, 30]), "background everywhere");
}

#[test]
fn weights_come_back_as_halves() {
    let (scene, bytes) = write_random(SMALL, 10, 5, 128);
    let bundle = Bundle::parse(&bytes).expect("a sound bundle");
    let Heads { colour, .. } = &scene.heads;
    let stored: Vec<f32> = bundle.heads().colour.w2.iter().collect();
    let rounded: Vec<f32> = colour.w2.iter().map(|&w| half::f16::from_f32(w).to_f32()).collect();
    assert_eq!(stored, rounded, "colour W2");
}

#[test]
fn values_that_do_not_fit_are_named() {
    let mut scene = random_scene(SMALL, 10, 7);
    scene.anchors.log_scales[6 * 4 + 1] = f32::NAN;
    let error = write(&scene, &info(), &STEPS).expect_err("NaN");
    assert!(
        matches!(error, WriteError::NotFinite { anchor: 4, channel: ChannelName::LogScale(1), .. }),
        "unexpected {error}"
    );
    assert_eq!(
        error.to_string(),
        "anchor 4, log-scale 1: NaN is not finite; training diverged before this was written",
        "message"
    );
    let mut scene = random_scene(SMALL, 10, 7);
    scene.anchors.offsets[9 * 2 + 4] = 1e4;
    let error = write(&scene, &info(), &STEPS).expect_err("too far");
    assert!(
        matches!(error, WriteError::BeyondSymbols { anchor: 2, channel: ChannelName::Offset(1, 1), .. }),
        "unexpected {error}"
    );
    let mut scene = random_scene(SMALL, 10, 7);
    scene.heads.opacity.b1[2] = 1e6;
    let error = write(&scene, &info(), &STEPS).expect_err("too large for half");
    assert!(matches!(error, WriteError::Weight { head: "opacity", .. }), "unexpected {error}");
    let mut scene = random_scene(SMALL, 10, 7);
    scene.anchors.lattice[3][1] = i32::MIN;
    let error = write(&scene, &info(), &STEPS).expect_err("beyond the lattice");
    assert!(matches!(error, WriteError::BeyondLattice { anchor: 3, .. }), "unexpected {error}");
}

#[test]
fn the_annotated_dump_shows_every_byte_once() {
    let (_, bytes) = write_random(SMALL, 40, 9, 16);
    let dump = annotate(&bytes).expect("a sound bundle");
    let shown = dump.lines().filter_map(|line| {
        let (hex, _) = line.get(8..)?.split_at_checked(23)?;
        hex.trim().split(' ').map(|byte| u8::from_str_radix(byte, 16).ok()).collect::<Option<Vec<u8>>>()
    });
    assert_eq!(shown.flatten().collect::<Vec<u8>>(), bytes, "the hexadecimal column is the file");
}

#[test]
fn the_size_report_accounts_for_every_byte() {
    let (_, bytes) = write_random(SMALL, 700, 9, 128);
    let report = SizeReport::of(&Bundle::parse(&bytes).expect("a sound bundle")).expect("sound chunks");
    let parts = [report.header, report.heads, report.tables, report.directory, report.lattice, report.symbols];
    assert_eq!(parts.iter().sum::<usize>(), bytes.len(), "{report:?}");
    let ideal_bytes = (report.feature_bits + report.log_scale_bits + report.offset_bits) / 8.0;
    let n_chunks = 700_usize.div_ceil(128);
    let overhead = report.symbols as f64 - ideal_bytes;
    assert!((0.0..6.0 * n_chunks as f64).contains(&overhead), "{overhead} bytes over {n_chunks} chunks");
}

#[test]
fn the_decoder_draws_what_the_oracle_draws() {
    for (seed, compensation) in [(11, false), (12, true)] {
        let shape = crate::scene::ModelShape { dilation_compensation: compensation, ..SMALL };
        let (_, bytes) = write_random(shape, 1500, seed, 128);
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
        // Half a step is the rounding to bytes; the rest is what f32 and the running exponential may add.
        assert!(worst < 0.51, "seed {seed}: {worst} steps of 255, {:?}", frame.report);
        assert!(frame.report.splats > 1000, "a scene worth drawing: {:?}", frame.report);
    }
}
