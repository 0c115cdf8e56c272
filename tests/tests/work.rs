//! Is the time of a frame bounded, whatever a file asks for, and does no step of one take long?

use std::task::Poll;

use conformance::frame::Frame;
use conformance::pack::draft::Draft;
use conformance::pack::heads::Widths;
use conformance::pack::models::Anchor;
use pocketsplat_core::{
    Budget, Bundle, Camera, DecodeError, Decoder, FrameReport, MaxSplats, Overflow, Plan, Residency, Strips, TileSink,
};
use pocketsplat_format::bundle::Effects;

const GOLDEN: [&[u8]; 3] = [
    include_bytes!("../golden/static.psb"),
    include_bytes!("../golden/context.psb"),
    include_bytes!("../golden/matte.psb"),
];

/// The splats of a tile: more than anchors, whose step ends behind 200,000 and one anchor.
const MOST_OF_STEP: u64 = 64 * (16 * 95 + 256 * 34);

/// The frame, its report, and the most model instructions of a step.
fn advanced(bundle: &Bundle<'_>, budget: &Budget, camera: &Camera) -> Result<(Frame, FrameReport, u64), DecodeError> {
    let plan = Plan::new(bundle, budget)?;
    let mut scratch = vec![0; plan.scratch_len()];
    let mut decoder = Decoder::bind(bundle, plan, &mut scratch)?;
    let mut drawing = decoder.begin(camera)?;
    let mut frame = Frame::new(camera.width_px, camera.height_px);
    let (mut before, mut most) = (0, 0);
    loop {
        match drawing.advance()? {
            Poll::Pending => {}
            Poll::Ready(Some(tile)) => frame.tile(tile).expect("infallible"),
            Poll::Ready(None) => break,
        }
        let now = drawing.report().instructions(bundle.model_cost());
        // What damage took is in no report.
        most = most.max(now.saturating_sub(before));
        before = now;
    }
    Ok((frame, drawing.report(), most))
}

#[test]
fn frames_in_small_steps_are_those_of_render() {
    for bytes in GOLDEN {
        let bundle = Bundle::parse(bytes).expect("a committed bundle is sound");
        let camera = bundle.header().preview;
        let all = Budget::for_frame(camera.width_px, camera.height_px);
        let few = all.with_max_splats(MaxSplats::AtMost(200));
        let in_slabs = few.with_overflow(Overflow::Slabs);
        for budget in [all, few, in_slabs, in_slabs.with_strips(Strips::Exactly(4)), all.skipping_damage()] {
            for residency in [Residency::Auto, Residency::AutoWithSums, Residency::Resident, Residency::Streamed] {
                let budget = budget.with_residency(residency);
                let plan = Plan::new(&bundle, &budget).expect("planned");
                let mut scratch = vec![0; plan.scratch_len()];
                let mut expected = Frame::new(camera.width_px, camera.height_px);
                let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("bound");
                let expected_report = decoder.render(&camera, &mut expected).expect("drawn");
                let (frame, report, most) = advanced(&bundle, &budget, &camera).expect("drawn");
                assert!(frame == expected, "{budget:?}");
                assert_eq!(report, expected_report, "{budget:?}");
                assert!(most <= MOST_OF_STEP, "{most} model instructions in one step: {budget:?}");
            }
        }
    }
}

/// Chunks of no bytes where `n_anchors` is 1,024: every symbol, and every cell of a block of 16 by 8 by 8, is certain.
fn hostile(n_chunks: usize, n_anchors: usize) -> Draft {
    let effects = Effects { anisotropic: true, view_colour: true, ..Effects::default() };
    let widths = Widths { features: 4, offsets: 4, colour_hidden: 8, detail_hidden: 0 };
    let n_channels = widths.features + 6 + 3 * widths.offsets;
    let cells = (0..1024).map(|i| [i & 15, i >> 4 & 7, i >> 7]).take(n_anchors);
    let chunk: Vec<Anchor> = cells.map(|cell| Anchor { cell, drawn: 15, symbols: vec![0; n_channels] }).collect();
    let front = Bundle::parse(GOLDEN[0]).expect("a committed bundle is sound").header().preview;
    Draft::of(effects, widths, vec![vec![chunk; n_chunks]], front, 7)
}

#[test]
fn a_small_file_that_asks_for_hours_is_refused_within_its_budget() {
    let [some, more] = [1, 101].map(|n_chunks| hostile(n_chunks, 1024).file());
    assert!(more.len() - some.len() <= 100 * 32, "{} bytes a chunk of 1,024 anchors", (more.len() - some.len()) / 100);
    let bundle = Bundle::parse(&more).expect("sound, as far as a parser can tell");
    let camera = bundle.header().preview;
    let all = Budget::for_frame(camera.width_px, camera.height_px).with_max_splats(MaxSplats::AtMost(2000));
    let plan = Plan::new(&bundle, &all).expect("planned");
    assert_eq!(plan.work(), None, "its manifest says nothing");
    for budget in [all, all.with_overflow(Overflow::Slabs), all.with_strips(Strips::Exactly(4))] {
        let budget = budget.with_residency(Residency::Streamed);
        let most_work = 20_000_000;
        let error = advanced(&bundle, &budget.with_most_work(most_work), &camera).err();
        let Some(DecodeError::TooMuchWork { needed_so_far, limit }) = error else { panic!("{error:?}") };
        let over = u64::from(needed_so_far - limit) << 10;
        assert!(u64::from(limit) == most_work >> 10 && over <= MOST_OF_STEP, "{over} above the limit: {budget:?}");
    }
}

/// A record of the directory costs 32 bytes and a look, whether its chunk is in view or not.
#[test]
fn chunks_out_of_view_are_work_too() {
    let file = hostile(600, 8).file();
    let bundle = Bundle::parse(&file).expect("sound");
    let front = bundle.header().preview;
    let away = Camera { translation: [0.0, 0.0, -1e4], ..front };
    let all = Budget::for_frame(front.width_px, front.height_px)
        .with_max_splats(MaxSplats::AtMost(2000))
        .with_residency(Residency::Streamed);
    let of_strips = all.with_strips(Strips::Exactly(4));
    for (budget, n_looks) in [
        (all, 600),
        (all.with_strips(Strips::Exactly(2)), 2 * 2 * 600),
        (of_strips, 600),
        (of_strips.with_overflow(Overflow::Slabs), 4 * 600),
        (of_strips.with_overflow(Overflow::Slabs).skipping_damage(), 5 * 600),
    ] {
        let work = n_looks * 300;
        let (_, report, _) = advanced(&bundle, &budget.with_most_work(work), &away).expect("drawn");
        assert_eq!(report.instructions(bundle.model_cost()), 0, "nothing is in view: {budget:?}");
        let error = advanced(&bundle, &budget.with_most_work(work - 1), &away).err();
        assert!(matches!(error, Some(DecodeError::TooMuchWork { .. })), "{error:?}: {budget:?}");
    }
    // The search for damage ends at the limit; the step behind it goes over the directory once.
    let in_slabs = of_strips.with_overflow(Overflow::Slabs).skipping_damage().with_most_work(3000);
    let error = advanced(&bundle, &in_slabs, &away).err();
    let Some(DecodeError::TooMuchWork { needed_so_far, .. }) = error else { panic!("{error:?}") };
    assert!(u64::from(needed_so_far) << 10 < 3300 + 601 * 300, "{needed_so_far} kilo-instructions");
}

/// What damaged chunks took is not in the report, but it is work.
#[test]
fn damage_that_is_left_out_is_work_all_the_same() {
    let mut draft = hostile(10, 1024);
    draft.edit_chunk = Some(|chunk, words| {
        if chunk > 0 {
            words.extend([1, 2])
        }
    });
    let bytes = draft.file();
    let bundle = Bundle::parse(&bytes).expect("chunks are not parsed");
    let camera = bundle.header().preview;
    let budget = Budget::for_frame(camera.width_px, camera.height_px)
        .with_max_splats(MaxSplats::AtMost(2000))
        .with_residency(Residency::Streamed)
        .skipping_damage();
    let (_, report, _) = advanced(&bundle, &budget, &camera).expect("damage is left out");
    assert_eq!(report.chunks_damaged, 9, "all but the first: {report:?}");
    let shown = report.instructions(bundle.model_cost());
    let error = advanced(&bundle, &budget.with_most_work(shown), &camera).err();
    assert!(matches!(error, Some(DecodeError::TooMuchWork { .. })), "{error:?} with the {shown} of its report");
}
