//! Each tier's scene is part of the next one's, a file cut at a tier's end is that scene, and plans follow the tiers.

use conformance::bundles::{ALL_CODERS, Coder, tier_ends, tiered};
use conformance::frame::{Frame, budget_for, draw, to_core};
use conformance::scenes::{CASES, cameras};
use pocketsplat_core::{Bundle, Camera, DecodeError, Decoder, ErrorClass, Field, FrameReport, Plan, Region};
use pocketsplat_format::bundle::AnchorSite;

fn camera() -> Camera {
    to_core(&cameras()[0].1)
}

fn file(coder: Coder) -> Vec<u8> {
    tiered(&CASES[0], coder, 64)
}

/// Sites and symbols of every anchor in the file, in order.
fn anchors(bundle: &Bundle<'_>) -> Vec<(AnchorSite, Vec<i16>)> {
    let mut scratch = vec![0; bundle.anchor_scratch_words()];
    let mut models = bundle.anchor_models(&mut scratch).expect("as many words as asked for");
    let n_channels = bundle.header().n_channels();
    let mut anchors = Vec::new();
    for chunk in bundle.chunks() {
        let n = usize::from(chunk.n_anchors());
        let (mut sites, mut symbols) = (vec![AnchorSite::default(); n], vec![0; n * n_channels]);
        chunk.decode_symbols(&mut models, &mut sites, &mut symbols).expect("a sound chunk");
        anchors.extend(sites.into_iter().zip(symbols.chunks(n_channels).map(<[i16]>::to_vec)));
    }
    anchors
}

fn draw_tiers(bundle: &Bundle<'_>, tiers: u8) -> (Frame, FrameReport) {
    let camera = camera();
    let plan = Plan::new(bundle, &budget_for(&camera).with_tiers(tiers)).expect("planned");
    assert_eq!(plan.n_tiers(), tiers.min(bundle.n_tiers()), "tiers of the plan");
    let mut scratch = vec![0; plan.scratch_len()];
    let mut frame = Frame::new(camera.width_px, camera.height_px);
    let mut decoder = Decoder::bind(bundle, plan, &mut scratch).expect("bound");
    let report = decoder.render(&camera, &mut frame).expect("drawn");
    (frame, report)
}

#[test]
fn tiers_are_nested() {
    for coder in ALL_CODERS {
        let bytes = file(coder);
        let whole = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let all = anchors(&whole);
        assert_eq!((whole.n_tiers(), all.len()), (3, whole.n_anchors() as usize), "{coder:?}");
        for (tier, end) in (0..).zip(tier_ends(&whole)) {
            let cut = Bundle::parse(&bytes[..end]).expect("cut at a tier's end");
            let counts = whole.tier(tier).expect("a tier");
            assert_eq!((cut.n_tiers(), cut.n_anchors(), cut.n_chunks()), (tier + 1, counts.n_anchors, counts.n_chunks));
            assert_eq!(anchors(&cut), all[..counts.n_anchors as usize], "{coder:?}: tier {tier} comes first");
            assert_eq!(cut.tier(2), whole.tier(2), "{coder:?}: what is cut off is still listed");
        }
    }
}

#[test]
fn a_cut_file_draws_what_fewer_tiers_of_the_whole_one_draw() {
    for coder in ALL_CODERS {
        let bytes = file(coder);
        let whole = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let frames: Vec<_> = (1..=3).map(|tiers| draw_tiers(&whole, tiers)).collect();
        for (end, frame) in tier_ends(&whole).into_iter().zip(&frames) {
            let cut = Bundle::parse(&bytes[..end]).expect("cut at a tier's end");
            assert!(draw_tiers(&cut, u8::MAX) == *frame, "{coder:?}: cut to {end} bytes");
        }
        let splats: Vec<u32> = frames.iter().map(|(_, report)| report.splats).collect();
        assert!(splats.is_sorted() && splats[0] < splats[2], "{coder:?}: splats of the tiers {splats:?}");
        let none = Plan::new(&whole, &budget_for(&camera()).with_tiers(0)).expect_err("no tier is no scene");
        assert_eq!(none, DecodeError::OutOfRange { field: Field::Tiers, found: 0, limit: 1 });
        assert_eq!(
            (none.class(), none.to_string().as_str()),
            (ErrorClass::Misuse, "tiers to draw is 0, the limit is 1")
        );
    }
}

#[test]
fn the_planned_bytes_suffice_for_every_tier_and_one_less_is_refused_by_number() {
    for coder in ALL_CODERS {
        let bytes = file(coder);
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let lens: Vec<usize> = (1..4)
            .map(|tiers| {
                let plan = Plan::new(&bundle, &budget_for(&camera()).with_tiers(tiers)).expect("planned");
                let needed = plan.scratch_len();
                let anchors = bundle.tier(tiers - 1).map_or(0, |tier| tier.n_anchors);
                let worst = anchors * u32::from(bundle.header().n_offsets);
                assert_eq!(plan.max_splats(), worst, "{coder:?}, {tiers} tiers: every offset");
                let skipping = Plan::new(&bundle, &plan.budget().skipping_damage()).expect("planned");
                for plan in [plan, skipping] {
                    let bind = |len: usize| Decoder::bind(&bundle, plan, &mut vec![0; len]).err();
                    assert_eq!(bind(needed), None, "{coder:?}, {tiers} tiers: {needed} bytes suffice");
                    let [needed_bytes, available] = [needed, needed - 1].map(|n| n as u32);
                    let expected =
                        DecodeError::ScratchTooSmall { region: Region::Fast, needed: needed_bytes, available };
                    assert_eq!(bind(needed - 1), Some(expected), "{coder:?}, {tiers} tiers");
                }
                needed
            })
            .collect();
        assert!(lens.is_sorted() && lens[0] < lens[2], "{coder:?}: bytes of the tiers {lens:?}");
        let all = Plan::new(&bundle, &budget_for(&camera())).expect("planned");
        assert_eq!(all.scratch_len(), lens[2], "{coder:?}: all tiers");
    }
}

#[test]
fn scratch_content_does_not_show() {
    for coder in ALL_CODERS {
        let bytes = file(coder);
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let camera = camera();
        let (expected, expected_report) = draw(&bundle, &camera).expect("drawn");
        let plan = Plan::new(&bundle, &budget_for(&camera)).expect("planned");
        for (start, fill) in [(0, 0xFF), (1, 0x5A), (2, 0x00), (3, 0xAA)] {
            let mut memory = vec![fill; start + plan.scratch_len()];
            let mut decoder = Decoder::bind(&bundle, plan, &mut memory[start..]).expect("bound");
            // The second frame finds what the first one left.
            for _ in 0..2 {
                let mut frame = Frame::new(camera.width_px, camera.height_px);
                let report = decoder.render(&camera, &mut frame).expect("drawn");
                assert!(frame == expected && report == expected_report, "{coder:?}: {fill:#04x} from byte {start}");
            }
        }
    }
}
