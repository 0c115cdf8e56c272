use glam::DVec3;
use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::{MANIFEST_RECORD_LEN, TierMeasures};

use super::{SMALL, TABLES, camera, info, options, random_scene};
use crate::bundle::{CodedScene, WriteError, WriteOptions, code};
use crate::manifest::{cameras_to_measure, measure};
use crate::render::decoder::core_image_of_tiers;
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Photograph, View};

fn tiered_scene() -> CodedScene {
    let scene = random_scene(SMALL, 900, 61);
    let importance = Some((0..900).map(|i| ((i * 7919) % 900) as f32).collect());
    let options = WriteOptions { importance, pruning_rates: vec![0.6, 0.3, 0.0], ..options(TABLES, 32) };
    code(&scene, &info(), &options).expect("a sound scene")
}

fn tiered_bundle() -> Vec<u8> {
    tiered_scene().into_file(&[]).expect("a sound bundle").bytes
}

/// Views from all sides, some near enough to miss half of the scene.
fn cameras() -> Vec<Camera> {
    (0..12)
        .map(|i| {
            let turn = glam::DMat3::from_rotation_y(0.5 * f64::from(i));
            let base = camera(64, 48);
            Camera {
                rotation: base.rotation * turn,
                translation: DVec3::new(0.3, 0.1, 0.8 + 0.3 * f64::from(i)),
                ..base
            }
        })
        .collect()
}

#[test]
fn measures_are_what_the_decoder_needs() {
    let bytes = tiered_bundle();
    let bundle = Bundle::parse(&bytes).expect("a sound bundle");
    let cameras = cameras();
    let measures = measure(&bundle, &cameras, &[]).expect("sound chunks");
    assert_eq!(measures.len(), 3, "one a tier");
    for (tier, measures) in (0..).zip(&measures) {
        let reports: Vec<_> = cameras
            .iter()
            .map(|camera| core_image_of_tiers(&bundle, camera, tier + 1).expect("a frame").report)
            .collect();
        let most = |count: fn(&pocketsplat_core::FrameReport) -> u32| reports.iter().map(count).max().unwrap_or(0);
        assert_eq!(measures.max_decoded_anchors, most(|r| r.anchors_decoded), "tier {tier}");
        let splats = most(|r| r.splats);
        // The trainer's renderer keeps what the decoder's drops below 1/255, and rounds otherwise.
        assert!(measures.max_splats.abs_diff(splats) <= 1 + splats / 100, "tier {tier}: {measures:?}, {splats}");
        assert!(measures.max_visible_anchors >= most(|r| r.anchors_visible), "tier {tier}: {measures:?}");
        let pairs = most(|r| r.tile_splats);
        assert!(u64::from(measures.max_strip_pairs[0]) + 2 >= u64::from(pairs), "tier {tier}: {measures:?}, {pairs}");
        let pixels = f64::from(most(|r| r.pixel_splats)) / 1024.0;
        assert!(f64::from(measures.max_kilo_pixels) > 0.95 * pixels, "tier {tier}: {measures:?}, {pixels}");
        assert_eq!(measures.max_splats, measures.max_strip_splats[0], "one strip is the frame");
        assert!(measures.max_strip_splats.is_sorted_by(|a, b| a >= b), "lower strips, fewer splats: {measures:?}");
        assert!(measures.max_strip_splats[3] * 8 >= measures.max_splats, "eight strips hold the frame: {measures:?}");
        assert_eq!((measures.n_cameras, measures.n_views, measures.psnr_db), (12, 0, None), "tier {tier}");
    }
    assert!(measures.is_sorted_by_key(|m| (m.max_splats, m.max_visible_anchors, m.max_head_kilo_macs)), "nested");
}

#[test]
fn psnr_rises_with_the_tiers_and_is_perfect_at_the_last() {
    let bytes = tiered_bundle();
    let bundle = Bundle::parse(&bytes).expect("a sound bundle");
    let camera = camera(70, 50);
    // The truth is the whole scene less a little, so that nothing is infinitely good.
    let mut image = core_image_of_tiers(&bundle, &camera, 3).expect("a frame").image;
    image.rgb.iter_mut().step_by(97).for_each(|byte| *byte ^= 8);
    let view = View::new("held out".to_owned(), camera, Photograph { image, mask: None });
    let measures = measure(&bundle, &[], &[view]).expect("sound chunks");
    let psnr: Vec<f32> = measures.iter().filter_map(|m| m.psnr_db).collect();
    assert!(psnr.len() == 3 && psnr.is_sorted() && psnr[2] > 45.0, "{psnr:?}");
}

#[test]
fn measures_come_back_from_the_file_and_change_nothing_else() {
    let unmeasured = tiered_bundle();
    let coded = tiered_scene();
    let measures = measure(&coded.bundle().expect("sound"), &cameras()[..2], &[]).expect("sound chunks");
    assert_eq!(coded.file_len(), unmeasured.len(), "known before there is a file");
    let error = coded.clone().into_file(&measures[1..]).expect_err("three tiers");
    assert!(matches!(error, WriteError::Length { needed: 3, found: 2, .. }), "{error}");
    let bytes = coded.into_file(&measures).expect("a sound bundle").bytes;
    let bundle = Bundle::parse(&bytes).expect("sound");
    for (tier, measures) in (0..).zip(&measures) {
        let found = bundle.measures(tier).expect("a tier");
        assert_eq!(TierMeasures { level: 0, ..found }, *measures, "tier {tier}");
        assert!(found.level > 0, "tier {tier}: as small a scene keeps some level");
    }
    let n_changed = bytes.iter().zip(&unmeasured).filter(|(a, b)| a != b).count();
    assert!(n_changed <= 3 * MANIFEST_RECORD_LEN + 8, "the manifest and two checksums: {n_changed} bytes");
}

#[test]
fn a_few_of_many_cameras_are_measured() {
    let many: Vec<Camera> = cameras().iter().cycle().take(100).cloned().collect();
    let n = cameras_to_measure(&many).len();
    assert!(n == 48 || n == 48 + 24, "48 and an orbit: {n}");
    assert!(cameras_to_measure(&[]).is_empty(), "nothing to measure");
}
