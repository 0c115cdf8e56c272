//! Values are rounded once, and by one rule: the bundle holds the symbols that the last phase of training drew.

use glam::DVec3;
use pocketsplat_capture::dataset::Normalisation;
use pocketsplat_codec::bundle::{BundleInfo, ChannelCoding, WriteOptions, decoded_scene, write};
use pocketsplat_format::Bundle;
use pocketsplat_kernels::integer_model;
use pocketsplat_kernels::ops::rate::noise::Stream;
use pocketsplat_kernels::scene::{ModelShape, Scene};
use pocketsplat_kernels::step::coding::{Coding, IntegerModel, RateTerms};
use pocketsplat_kernels::step::{Loss, TargetView, Workspace};

use crate::train::config::Backbone;
use crate::train::test_capture::{tiny_capture, tiny_hac_config};
use crate::train::{TrainConfig, Trainer};

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
    let info = BundleInfo {
        normalisation: Normalisation { centre: DVec3::new(1.0, -2.0, 0.5), scale: 2.5 },
        background: [10, 20, 30],
        training_px: [64, 48],
        preview: capture.train[0].camera.clone(),
        protocol: None,
    };
    let importance = Some(finished.importance.clone());
    let options = WriteOptions { importance, channels: ChannelCoding::Context, ..WriteOptions::default() };
    let bytes = write(&finished.scene, &info, &options).expect("a sound scene").bytes;
    let mut decoded =
        in_order_of(&finished.scene, &decoded_scene(&Bundle::parse(&bytes).expect("sound")).expect("sound"));
    // Values are what is compared: a bundle rounds the heads as well.
    decoded.heads = finished.scene.heads.clone();

    let (shape, model) = (trainer.scene().shape, trainer.scene().context.as_ref().expect("trained with one"));
    let section = integer_model::section(model, shape.values_per_anchor()).expect("an integer form");
    let networks = integer_model::rounded(model, shape.values_per_anchor()).expect("an integer form");
    let integers = integer_model::parse(&section, &shape).expect("a sound section");
    let exact = Some(IntegerModel { context: &integers, networks: &networks });
    let rate = RateTerms { lambda: 0.0, sample: 0.0, mask: 0.0, masks_weigh_anchors: false, grid: 0.0 };
    let last_step = Coding::Context { stream: Stream::of_run(config.seed), rate, exact };
    // Anchors that no view draws are not written, and none follow them.
    let mut last = trainer.scene().clone();
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
