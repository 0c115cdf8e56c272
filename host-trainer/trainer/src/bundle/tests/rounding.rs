//! Values are rounded once, and by one rule: the bundle holds the symbols that the last phase of training drew.

use pocketsplat_core::Bundle;
use pocketsplat_core::context::Group;

use super::{SMALL, options, random_scene, with_context, write_bytes};
use crate::bundle::channels::ContextWork;
use crate::bundle::{ChannelCoding, WriteOptions, decoded_scene};
use crate::integer_model;
use crate::ops::noise::Stream;
use crate::ops::perturb;
use crate::scene::{ModelShape, Scene};
use crate::step::coding::{Coding, IntegerModel, RateTerms};
use crate::step::{Loss, TargetView, Workspace};
use crate::train::config::Backbone;
use crate::train::test_capture::{tiny_capture, tiny_hac_config};
use crate::train::{TrainConfig, Trainer};

/// The bundle of a scene under its context model.
fn coded_by_context(scene: &Scene<f32>, importance: Option<Vec<f32>>) -> Vec<u8> {
    write_bytes(scene, &WriteOptions { importance, ..options(ChannelCoding::Context, 256) })
}

#[test]
fn the_decoder_draws_what_the_last_step_drew() {
    drawn_twice(tiny_hac_config(80), 0.0);
    // Gaussians of equal depth change places: a step draws anchors level by level.
    drawn_twice(TrainConfig { backbone: Backbone::ContextGs, ..tiny_hac_config(80) }, 1e-3);
}

/// * `tolerance`: of the squared error.
fn drawn_twice(config: TrainConfig, tolerance: f64) {
    let capture = tiny_capture();
    let mut trainer = Trainer::new(&capture, config).expect("a sound capture");
    while !trainer.is_done() {
        trainer.advance().expect("a sound step");
    }
    let finished = trainer.finish().expect("the context has an integer form");
    let bytes = coded_by_context(&finished.scene, Some(finished.importance.clone()));
    let mut decoded =
        in_order_of(&finished.scene, &decoded_scene(&Bundle::parse(&bytes).expect("sound")).expect("sound"));
    // Values are what is compared: a bundle rounds the heads as well.
    decoded.heads = finished.scene.heads.clone();

    let (shape, model) = (trainer.scene.shape, trainer.scene.context.as_ref().expect("trained with one"));
    let section = integer_model::section(model, shape.values_per_anchor()).expect("an integer form");
    let networks = integer_model::rounded(model, shape.values_per_anchor()).expect("an integer form");
    let integers = integer_model::parse(&section, &shape).expect("a sound section");
    let exact = Some(IntegerModel { context: &integers, networks: &networks });
    let rate = RateTerms { lambda: 0.0, sample: 0.0, mask: 0.0, masks_weigh_anchors: false, grid: 0.0 };
    let last_step = Coding::Context { stream: Stream::of_run(config.seed), rate, exact };
    // Anchors that no view draws are not written, and none follow them.
    let mut last = trainer.scene.clone();
    last.anchors.mask_logits.clone_from(&finished.scene.anchors.mask_logits);
    let mut workspace = Workspace::new(&shape);
    for camera in trainer.cameras() {
        let truth = vec![0.0; 3 * camera.size_px.iter().product::<usize>()];
        let target = TargetView::new(camera, truth, None, [0.0; 3]);
        let mut squared_error = |scene: &Scene<f32>, coding: &Coding<'_, f32>| {
            workspace.step(scene, &target, &Loss::plain(config.loss), coding).squared_error
        };
        let drawn = squared_error(&last, &last_step);
        assert!(drawn > 0.0, "an image that shows something");
        let found = squared_error(&decoded, &Coding::Raw);
        assert!((found / drawn - 1.0).abs() <= tolerance, "{found}, drawn {drawn}");
        assert_ne!(squared_error(&finished.scene, &Coding::Raw), drawn, "nothing was rounded before the writer");
    }
}

/// `scene` with the values that a bundle of it decodes to; what is not coded stays as it was.
fn in_order_of(scene: &Scene<f32>, decoded: &Scene<f32>) -> Scene<f32> {
    let ModelShape { feature_dim: f, n_offsets: k, .. } = scene.shape;
    let s = scene.shape.n_log_scales();
    let mut scene = scene.clone();
    let anchors = &mut scene.anchors;
    for (from, cell) in decoded.anchors.lattice.iter().enumerate() {
        let to = anchors.lattice.iter().position(|known| known == cell).expect("a cell of the scene");
        anchors.features[to * f..][..f].copy_from_slice(&decoded.anchors.features[from * f..][..f]);
        anchors.log_scales[to * s..][..s].copy_from_slice(&decoded.anchors.log_scales[from * s..][..s]);
        anchors.offsets[to * 3 * k..][..3 * k].copy_from_slice(&decoded.anchors.offsets[from * 3 * k..][..3 * k]);
    }
    scene
}

#[test]
fn quotients_that_round_to_a_tie_round_as_in_training() {
    let mut scene = with_context(random_scene(SMALL, 400, 4), 5);
    scene.anchors.mask_logits.fill(1.0);
    let section = integer_model::section(scene.context.as_ref().expect("given one"), SMALL.values_per_anchor());
    let section = section.expect("a sound model");
    let integers = integer_model::parse(&section, &SMALL).expect("a sound section");
    let f = SMALL.feature_dim;
    let (mut expected, mut n_apart) = (Vec::new(), 0);
    for (a, cell) in scene.anchors.lattice.iter().enumerate() {
        let step = ContextWork::default().enter(&integers, *cell).value(Group::ALL[0]);
        let features = &mut scene.anchors.features[a * f..][..f];
        for (i, feature) in features.iter_mut().enumerate() {
            // Next to the middle between two symbols.
            let middle = ((a + i) as f32 + 0.5) * step;
            *feature = [middle.next_down(), middle, middle.next_up()][i % 3];
            let in_f64 = (f64::from(*feature) / f64::from(step)).round_ties_even();
            n_apart += usize::from(f64::from(perturb::symbol(*feature, step)) != in_f64);
        }
        let mut trained = features.to_vec();
        perturb::rounded(step, &mut trained, &mut vec![0.0; f]);
        expected.push((*cell, trained));
    }
    assert!(n_apart > 0, "values at which another precision rounds otherwise");
    let bytes = coded_by_context(&scene, None);
    let decoded = decoded_scene(&Bundle::parse(&bytes).expect("sound")).expect("sound");
    let mut found: Vec<_> = decoded.anchors.lattice.into_iter().zip(decoded.anchors.features.chunks(f)).collect();
    found.sort_by_key(|(cell, _)| *cell);
    expected.sort_by_key(|(cell, _)| *cell);
    assert!(found.into_iter().eq(expected.iter().map(|(cell, row)| (*cell, row.as_slice()))));
}
