//! Feature 4 and what section 7 of FORMAT.md has.

use pocketsplat_format::bundle::Effects;
use pocketsplat_format::context::{GridFrame, LevelKind};

use super::context_limits::{limits, near_and_far};
use super::{
    ALL_EFFECTS, ANISOTROPIC, DETAILED, SMALL, anchors, front, in_tiers, inside, off_centre, one_chunk, sample, small,
};
use crate::pack::contexts::{ContextDraft, ContextShape, level};
use crate::pack::draft::{CoderDraft, Draft, HeadCoding, n_channels, n_log_scales};
use crate::pack::heads::Widths;
use crate::pack::sample::{NO_EFFECT, Sample};

pub(super) fn shape_of(widths: Widths, effects: Effects, hidden: usize) -> ContextShape {
    ContextShape {
        features: widths.features,
        log_scales: n_log_scales(effects),
        channels: n_channels(widths, effects),
        hidden,
    }
}

/// The frame of the grid around all cells but the outermost.
const FRAME_CELLS: [[i32; 3]; 2] = [[-28, -30, -32], [27, 31, 25]];

pub(super) fn frame() -> GridFrame {
    let [min, max] = FRAME_CELLS;
    GridFrame::spanning(min, max)
}

pub(super) fn with_context(
    effects: Effects,
    widths: Widths,
    masks: bool,
    n: usize,
    context: &ContextDraft,
    seed: u64,
) -> Draft {
    let mut draft = small(effects, widths, masks, seed);
    draft.tiers = one_chunk(anchors(n, widths, effects, masks, seed));
    draft.max_chunk_anchors = n as u16;
    draft.coder = CoderDraft::Context(context.section());
    draft
}

/// Feature 4 and everything in section 7.
pub(super) fn samples() -> Vec<Sample> {
    use LevelKind::{Volume, Xy, Xz, Yz};
    let mut samples = Vec::new();
    let simple = shape_of(SMALL, NO_EFFECT, 6);
    let volume = ContextDraft::grid(simple, frame(), vec![level(Volume, 4, 64)], 0, 200);
    let draft = with_context(NO_EFFECT, SMALL, false, 16, &volume, 200);
    samples.push(sample("grid-volume", "Feature 4 alone: one dense volume of the grid.", draft, &[front()]));

    let planes = vec![level(Xy, 5, 25), level(Xz, 3, 9), level(Yz, 7, 49), level(Volume, 2, 8)];
    let planes = ContextDraft::grid(simple, frame(), planes, 0, 201);
    let draft = with_context(NO_EFFECT, SMALL, false, 16, &planes, 201);
    samples.push(sample("grid-planes", "A plane of each kind; the rows are odd in number.", draft, &[front()]));

    let hashed = vec![
        level(Volume, 32768, 64),
        level(Xy, 50, 16),
        level(Xz, 32768, 1),
        level(Yz, 300, 128),
        level(Volume, 9, 1),
    ];
    let hashed = ContextDraft::grid(simple, frame(), hashed, 3, 202);
    let draft = with_context(NO_EFFECT, SMALL, false, 16, &hashed, 202);
    samples.push(sample("grid-hashed", "Hashed volumes and planes, of one row too; three taps.", draft, &[front()]));

    let most = (0..32).map(|i| level([Xy, Xz, Yz, Volume][i % 4], 2, if i % 4 == 3 { 8 } else { 4 })).collect();
    let most = ContextDraft::grid(
        shape_of(SMALL, NO_EFFECT, 1),
        GridFrame { min: [0; 3], scale: [0, 1 << 12, u32::MAX] },
        most,
        0,
        203,
    );
    let draft = with_context(NO_EFFECT, SMALL, false, 16, &most, 203);
    let about = "32 levels, one hidden unit, a frame without extent along x and of a cell along z.";
    samples.push(sample("grid-32-levels", about, draft, &[front()]));

    let least = Widths { features: 1, offsets: 1, colour_hidden: 1, detail_hidden: 0 };
    let widest = ContextDraft::grid(shape_of(least, NO_EFFECT, 256), frame(), vec![level(Volume, 3, 27)], 0, 204);
    let draft = with_context(NO_EFFECT, least, false, 16, &widest, 204);
    samples.push(sample("context-256-hidden", "256 hidden units, 27 rows.", draft, &[front()]));

    let many = Widths { features: 66, offsets: 1, colour_hidden: 3, detail_hidden: 0 };
    let taps = ContextDraft::grid(shape_of(many, NO_EFFECT, 2), frame(), vec![level(Xy, 2, 4)], 64, 205);
    let mut draft = with_context(NO_EFFECT, many, false, 6, &taps, 205);
    draft.head_coding = HeadCoding::Counted;
    // What they leave is limited, and so is what it moves.
    draft.tiers[0][0][2].symbols[3] = i16::MAX;
    draft.tiers[0][0][2].symbols[7] = i16::MIN;
    samples.push(sample("taps-64", "64 taps, which residuals beyond 16 bits go through.", draft, &[front()]));

    samples.push(limits());
    samples.push(near_and_far());

    let effects = ALL_EFFECTS;
    let shape = shape_of(DETAILED, effects, 6);
    let levels = vec![level(Volume, 4, 64), level(Volume, 40, 128), level(Xy, 9, 81), level(Yz, 30, 64)];
    let all = ContextDraft::grid(shape, frame(), levels, 2, 206);
    let mut draft = with_context(effects, DETAILED, true, 40, &all, 206);
    draft.tiers = in_tiers(&anchors(40, DETAILED, effects, true, 206), &[20, 30, 40], 9);
    draft.max_chunk_anchors = 9;
    draft.head_coding = HeadCoding::Counted;
    let mut all = sample("everything-grid", "All features, with a grid, in three tiers.", draft, &[]);
    all.views = vec![(1, front()), (2, front()), (3, off_centre()), (3, inside())];
    samples.push(all);

    let about = "Anchors follow anchors, with all features, in two tiers.";
    samples.push(following("everything-following", about, effects, DETAILED, [4, 5, 7], [-64, -64, -64], 207));
    let about = "Levels of single cells: every anchor is of level 2, and places are cut to their low 16 bits.";
    samples.push(following("following-finest", about, NO_EFFECT, SMALL, [0, 0, 0], [-40, 7, 1000], 208));
    let about = "The largest cells: one of level 2, then levels 1 and 0 by the signs of coordinates.";
    samples.push(following(
        "following-coarsest",
        about,
        ANISOTROPIC,
        SMALL,
        [15, 15, 25],
        [-(1 << 24), 0, 1 << 22],
        209,
    ));
    let about = "Cells of level 1 of one lattice cell, of level 2 of eight: no anchor is of level 0.";
    samples.push(following("following-pairs", about, ANISOTROPIC, SMALL, [0, 3, 6], [-33, -34, -35], 210));
    samples
}

fn following(
    name: &str,
    about: &str,
    effects: Effects,
    widths: Widths,
    shifts: [u8; 3],
    min: [i32; 3],
    seed: u64,
) -> Sample {
    let frame = GridFrame { min, scale: [0; 3] };
    let context = ContextDraft::following(shape_of(widths, effects, 5), frame, shifts, seed);
    let masks = effects.detail;
    let mut draft = with_context(effects, widths, masks, 40, &context, seed);
    let mut some = anchors(40, widths, effects, masks, seed);
    // Near enough for the smaller cells to hold several.
    for (anchor, at) in some.iter_mut().zip(0..).skip(20) {
        anchor.cell = [at % 5 - 2, at / 5 % 3 - 1, at / 15 - 1];
    }
    some.sort_by_key(|anchor| anchor.cell);
    some.dedup_by_key(|anchor| anchor.cell);
    let n = some.len();
    draft.tiers = in_tiers(&some, &[n / 2, n], 16);
    draft.max_chunk_anchors = 16;
    draft.lattice = Some(([-32; 3], 6));
    if masks {
        draft.head_coding = HeadCoding::Counted;
    }
    let mut sample = sample(name, about, draft, &[]);
    sample.views = vec![(2, front())];
    if masks {
        sample.views.extend([(1, front()), (2, off_centre())]);
    }
    sample
}
