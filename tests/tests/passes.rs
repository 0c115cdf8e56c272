//! Does a frame go over its scene as seldom as it can, in no more memory than it says, and does damage leave nothing behind?
//!
//! Pixels do not tell: they are the same whatever a pass costs. So these are bounds on what frames of a committed bundle take.

use conformance::fuzz::frame::Frame;
use conformance::seal::reseal;
use pocketsplat_core::{
    Budget, Bundle, Camera, DecodeError, Decoder, FrameReport, HeadWeights, MaxSplats, Overflow, Plan, Residency,
    SectionKind, Strips,
};
use pocketsplat_format::bundle::{MANIFEST_RECORD_LEN, TierMeasures};

const BUNDLE: &[u8] = include_bytes!("../golden/static.psb");

fn bundle() -> Bundle<'static> {
    Bundle::parse(BUNDLE).expect("a committed bundle is sound")
}

/// Streamed frames of the preview.
fn budget(n_strips: u8, n_places: u32, overflow: Overflow) -> Budget {
    let preview = bundle().header().preview;
    Budget::for_frame(preview.width_px, preview.height_px)
        .with_residency(Residency::Streamed)
        .with_strips(Strips::Exactly(n_strips))
        .with_max_splats(MaxSplats::AtMost(n_places))
        .with_overflow(overflow)
}

fn drawn(bundle: &Bundle<'_>, plan: Plan, camera: &Camera) -> Result<(Frame, FrameReport), DecodeError> {
    let mut scratch = vec![0; plan.scratch_len()];
    let mut frame = Frame::new(camera.width_px, camera.height_px);
    let report = Decoder::bind(bundle, plan, &mut scratch)?.render(camera, &mut frame)?;
    Ok((frame, report))
}

fn report(budget: &Budget, camera: &Camera) -> FrameReport {
    let bundle = bundle();
    let (_, report) = drawn(&bundle, Plan::new(&bundle, budget).expect("planned"), camera).expect("drawn");
    report
}

#[test]
fn notes_of_where_splats_lie_save_decoding() {
    let found = report(&budget(8, 600, Overflow::Slabs), &bundle().header().preview);
    assert_eq!((found.splats, found.splats_dropped), (1150, 0), "{found:?}");
    assert!(found.anchors_decoded <= 2300, "2150 with notes, 2425 without: {found:?}");
}

#[test]
fn a_slab_without_room_lets_go_of_few_splats() {
    let found = report(&budget(8, 60, Overflow::Slabs), &bundle().header().preview);
    assert_eq!((found.splats, found.splats_dropped), (1150, 0), "{found:?}");
    assert!(found.slabs <= 45, "41 if the farthest eighth makes room, 50 if half: {found:?}");
}

#[test]
fn strips_with_room_for_their_splats_share_a_pass() {
    let found = report(&budget(8, 600, Overflow::LeaveOut), &bundle().header().preview);
    assert_eq!((found.splats, found.splats_dropped), (1150, 0), "{found:?}");
    assert!(found.decode_passes <= 4, "5 with a strip less in each: {found:?}");
}

#[test]
fn slabs_behind_finished_pixels_are_not_drawn() {
    let bundle = Bundle::parse(include_bytes!("../golden/isotropic.psb")).expect("a committed bundle is sound");
    // So near that the few splats in view cover every pixel.
    let camera = bundle.header().preview.orbited(2.355);
    let camera = Camera { focal_px: camera.focal_px.map(|f| 400.0 * f), ..camera };
    let plan = Plan::new(&bundle, &budget(2, 2, Overflow::Slabs)).expect("planned");
    let (_, found) = drawn(&bundle, plan, &camera).expect("drawn");
    assert!(found.slabs <= 46, "44 until every pixel is finished, 50 to the last splat: {found:?}");
}

/// A bundle with one chunk that decodes to other symbols and then does not end as it should, under right checksums.
fn damaged(chunk: u32, at: usize) -> Vec<u8> {
    let mut bytes = BUNDLE.to_vec();
    let bundle = bundle();
    let chunks = bundle.sections().find(|section| section.kind == SectionKind::Chunks).expect("chunks");
    let chunk = bundle.chunk(chunk).expect("in the file");
    bytes[chunks.offset as usize + chunk.offset() as usize + at * chunk.n_bytes() / 8] ^= 0x55;
    reseal(&mut bytes);
    bytes
}

/// The plan of a budget with heads in halves, which are evaluated two anchors at a time: for too few bytes for heads in f32.
fn in_halves(bundle: &Bundle<'_>, budget: &Budget) -> Plan {
    let whole = Plan::new(bundle, budget).expect("memory without limit");
    let plan = Plan::new(bundle, &budget.in_bytes(whole.scratch_len() - 1)).expect("halves do");
    assert_eq!((plan.head_weights(), plan.max_splats()), (HeadWeights::F16, whole.max_splats()), "{plan:?}");
    plan
}

#[test]
fn a_damaged_chunk_takes_no_place_and_leaves_no_anchor_behind() {
    let preview = bundle().header().preview;
    let mut n_damaged = 0;
    for (chunk, at) in (0..bundle().n_chunks()).flat_map(|chunk| [(chunk, 2), (chunk, 5)]) {
        let bytes = damaged(chunk, at);
        let bundle = Bundle::parse(&bytes).expect("checksums are right");
        for (n_strips, n_places) in [(1, 40), (1, 400), (2, 300), (8, 100), (8, 2000)] {
            let streamed = budget(n_strips, n_places, Overflow::LeaveOut).skipping_damage();
            let [resident, summed] =
                [Residency::Resident, Residency::AutoWithSums].map(|residency| streamed.with_residency(residency));
            let f32s = |budget| Plan::new(&bundle, budget).expect("memory without limit");
            let halves = |budget| in_halves(&bundle, budget);
            for plans in
                [[&streamed, &resident].map(f32s), [&streamed, &summed].map(f32s), [&streamed, &resident].map(halves)]
            {
                let [(frame, report), (expected, expected_report)] =
                    plans.map(|plan| drawn(&bundle, plan, &preview).expect("damage is left out"));
                let counts = |r: &FrameReport| (r.splats, r.splats_dropped, r.chunks_damaged, r.first_damaged);
                assert_eq!(
                    counts(&report),
                    counts(&expected_report),
                    "chunk {chunk}: streamed and resident, {plans:?}"
                );
                assert!(frame == expected, "chunk {chunk}: streamed and resident draw something else, {plans:?}");
                n_damaged += report.chunks_damaged;
            }
        }
    }
    assert!(n_damaged > 50, "{n_damaged} damaged chunks");
}

#[test]
fn a_frame_in_slabs_touches_no_more_bytes_than_it_says() {
    let bundle = bundle();
    let preview = bundle.header().preview;
    let (mut n_full, mut n_less) = (0, 0);
    for (n_strips, n_places) in [(1, 60), (1, 400), (1, 2000), (2, 150), (4, 320), (8, 440), (8, 600)] {
        for residency in [Residency::Streamed, Residency::Resident, Residency::AutoWithSums] {
            let budget = budget(n_strips, n_places, Overflow::Slabs).with_residency(residency);
            let plan = Plan::new(&bundle, &budget).expect("planned");
            let mut said = 0;
            // A byte that keeps both of two fills was not touched.
            let [zeros, ones] = [0, u8::MAX].map(|fill| {
                let mut scratch = vec![fill; plan.scratch_len()];
                let mut frame = Frame::new(preview.width_px, preview.height_px);
                let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("planned memory");
                said = decoder.render(&preview, &mut frame).expect("drawn").scratch_used as usize;
                scratch
            });
            let touched = zeros.iter().zip(&ones).filter(|pair| *pair != (&0, &u8::MAX)).count();
            assert!(touched <= said && said <= plan.scratch_len(), "{touched} bytes touched, {said} said: {plan:?}");
            n_full += usize::from(said == plan.scratch_len());
            n_less += usize::from(said < plan.scratch_len());
        }
    }
    assert!(n_full > 0 && n_less > 0, "{n_full} frames took all of their memory, {n_less} less");
}

#[test]
fn several_strips_count_as_two_passes_when_plans_are_compared() {
    let mut bytes = BUNDLE.to_vec();
    let whole = bundle();
    let manifest = whole.sections().find(|section| section.kind == SectionKind::Manifest).expect("a manifest");
    for record in bytes[manifest.offset as usize..][..manifest.len as usize].chunks_exact_mut(MANIFEST_RECORD_LEN) {
        let measures = TierMeasures {
            psnr_db: None,
            n_views: 0,
            n_cameras: 1,
            max_visible_anchors: 310,
            max_splats: 1150,
            max_strip_splats: [1150, 700, 400, 200],
            max_strip_pairs: [0; 4],
            // Twice as much as decoding all anchors counts as.
            max_head_kilo_macs: 500,
            max_kilo_pixels: 100,
            max_decoded_anchors: 310,
            level: 0,
        };
        record.copy_from_slice(&measures.emit());
    }
    reseal(&mut bytes);
    let bundle = Bundle::parse(&bytes).expect("sound");
    let preview = bundle.header().preview;
    let frame = Budget::for_frame(preview.width_px, preview.height_px);
    let len = |strips, residency| {
        let plan = Plan::new(&bundle, &frame.with_strips(Strips::Exactly(strips)).with_residency(residency));
        plan.expect("memory without limit").scratch_len()
    };
    let (streamed, resident) = (len(1, Residency::Streamed), len(8, Residency::Resident));
    let least = streamed.max(resident);
    assert!(least < len(1, Residency::Resident), "both fit where one strip with resident anchors does not");
    let plan = Plan::new(&bundle, &frame.in_bytes(least)).expect("planned");
    assert_eq!((plan.n_strips(), plan.is_resident()), (1, false), "to decode once costs less than to run heads twice");
}
