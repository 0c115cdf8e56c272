//! The bundles of the pack.

use glam::DVec3;
use pocketsplat_core::bundle::{Effects, MAX_CHUNK_ANCHORS, MAX_FEATURE_DIM, MAX_OFFSETS, cut_after};
use pocketsplat_core::context::{GridFrame, LevelKind};
use pocketsplat_core::{Bundle, Camera};
use pocketsplat_trainer::manifest;

use super::contexts::{ContextDraft, ContextShape, level};
use super::draft::{CoderDraft, Draft, HeadCoding, group_of, n_channels, n_log_scales};
use super::heads::{UNIT, Widths};
use super::models::{Anchor, TableDraft};
use super::numbers::Numbers;
use super::sample::{NO_EFFECT, Sample};
use super::splats;
use crate::frame::to_core;
use crate::scenes::look_at;

const ANISOTROPIC: Effects = Effects { anisotropic: true, ..NO_EFFECT };
const ALL_EFFECTS: Effects = Effects {
    view_colour: true,
    view_geometry: true,
    view_distance: true,
    dilation_compensation: true,
    detail: true,
    anisotropic: true,
    background: true,
};
pub(super) const SMALL: Widths = Widths { features: 4, offsets: 2, colour_hidden: 5, detail_hidden: 0 };
const DETAILED: Widths = Widths { detail_hidden: 3, ..SMALL };

/// A view from `eye` at the origin.
pub(super) fn view(eye: [f64; 3], size_px: [u32; 2]) -> Camera {
    to_core(&look_at(eye.into(), DVec3::ZERO, 1.2, size_px))
}

pub(super) fn front() -> Camera {
    view([1.7, -1.1, 0.6], [48, 36])
}

/// A view of a size that tiles do not divide, with its principal point off the centre and pixels that are not square.
fn off_centre() -> Camera {
    let camera = view([-1.2, -1.3, 0.9], [61, 45]);
    let [fx, fy] = camera.focal_px;
    Camera { principal_px: [22.25, 30.5], focal_px: [fx, 1.25 * fy], ..camera }
}

fn inside() -> Camera {
    let camera = look_at(DVec3::new(0.1, -0.05, 0.02), DVec3::new(1.0, 0.4, -0.2), 0.6, [40, 33]);
    to_core(&camera)
}

/// `n` anchors within 32 cells of the origin, each in a cell of its own.
pub(super) fn anchors(n: usize, widths: Widths, effects: Effects, masks: bool, seed: u64) -> Vec<Anchor> {
    let mut numbers = Numbers::of(seed);
    let mut found: Vec<Anchor> = Vec::new();
    while found.len() < n {
        let cell = std::array::from_fn(|_| numbers.between(-32, 31));
        if found.iter().any(|anchor| anchor.cell == cell) {
            continue;
        }
        let all = u32::MAX.unbounded_shr(u32::BITS - widths.offsets as u32);
        let drawn = if masks { numbers.between(0, i32::MAX) as u32 & all } else { all };
        let symbol = |channel: usize| match group_of(widths, effects, channel) {
            0 => numbers.around_zero(8) as i16,
            1 => -16 + numbers.around_zero(3) as i16,
            _ => numbers.around_zero(5) as i16,
        };
        let symbols = (0..n_channels(widths, effects)).map(symbol).collect();
        found.push(with_drawn(Anchor { cell, drawn: all, symbols }, drawn, widths, effects));
    }
    found
}

/// The anchor with other drawn offsets; the symbols of the others become 0.
fn with_drawn(mut anchor: Anchor, drawn: u32, widths: Widths, effects: Effects) -> Anchor {
    let n_scalars = widths.features + n_log_scales(effects);
    for (k, offset) in anchor.symbols[n_scalars..].chunks_exact_mut(3).enumerate() {
        if drawn >> k & 1 == 0 {
            offset.fill(0);
        }
    }
    Anchor { drawn, ..anchor }
}

/// One tier of one chunk.
fn one_chunk(anchors: Vec<Anchor>) -> Vec<Vec<Vec<Anchor>>> {
    vec![vec![anchors]]
}

/// Tiers of chunks of at most `chunk` anchors; `ends` are the anchors up to each tier.
fn in_tiers(anchors: &[Anchor], ends: &[usize], chunk: usize) -> Vec<Vec<Vec<Anchor>>> {
    let starts = [0].iter().chain(ends);
    starts.zip(ends).map(|(&start, &end)| anchors[start..end].chunks(chunk).map(<[Anchor]>::to_vec).collect()).collect()
}

/// A sample of one tier.
fn sample(name: &str, about: &str, draft: Draft, views: &[Camera]) -> Sample {
    let n_tiers = draft.tiers.len() as u8;
    let views = views.iter().map(|camera| (n_tiers, *camera)).collect();
    let anchors = draft.clone().anchors();
    Sample { name: name.to_owned(), about: about.to_owned(), anchors, bytes: draft.file(), views }
}

/// All bundles of the pack.
pub fn samples() -> Vec<Sample> {
    let parts = [features(), contexts(), coding(), positions(), tiers(), sections(), baked(), splats::samples()];
    parts.into_iter().flatten().collect()
}

fn small(effects: Effects, widths: Widths, masks: bool, seed: u64) -> Draft {
    let anchors = anchors(14, widths, effects, masks, seed);
    Draft { masks, ..Draft::of(effects, widths, one_chunk(anchors), front(), seed) }
}

/// Each feature alone, then all together.
fn features() -> Vec<Sample> {
    let none = NO_EFFECT;
    let alone = [
        ("plain", "No feature: isotropic Gaussians on black, tables, plain heads.", none),
        ("view-colour", "Feature 0 alone: the colour head sees the direction.", Effects { view_colour: true, ..none }),
        ("view-distance", "Feature 1 alone: three heads see the distance.", Effects { view_distance: true, ..none }),
        ("dilation", "Feature 2 alone: dilation compensation.", Effects { dilation_compensation: true, ..none }),
        ("anisotropy", "Feature 7 alone: three deviations and a rotation.", Effects { anisotropic: true, ..none }),
        ("background", "Feature 8 alone: a colour behind the scene.", Effects { background: true, ..none }),
        (
            "view-geometry",
            "Feature 10 alone: the opacity and the covariance head see the direction.",
            Effects { view_geometry: true, ..none },
        ),
    ];
    let mut samples: Vec<Sample> = alone
        .into_iter()
        .zip(100..)
        .map(|((name, about, effects), seed)| sample(name, about, small(effects, SMALL, false, seed), &[front()]))
        .collect();
    let masks = small(none, SMALL, true, 110);
    samples.push(sample(
        "masks",
        "Feature 3 alone: offsets that are not drawn, all of an anchor's too.",
        masks,
        &[front()],
    ));
    let coded = Draft { head_coding: HeadCoding::Counted, ..small(none, SMALL, false, 111) };
    samples.push(sample("coded-heads", "Feature 5 alone: matrices of the heads are coded.", coded, &[front()]));
    let detail = small(Effects { detail: true, ..none }, DETAILED, false, 112);
    samples.push(sample("detail", "Feature 6 alone: a fourth head adds to colours.", detail, &[front(), off_centre()]));
    let mut wide = small(ALL_EFFECTS, DETAILED, true, 113);
    wide.head_coding = HeadCoding::Counted;
    wide.tiers = in_tiers(&anchors(40, DETAILED, ALL_EFFECTS, true, 113), &[12, 25, 40], 8);
    wide.max_chunk_anchors = 8;
    wide.count_tables([1.0 / 16.0, 1.0 / 8.0, 1.0 / 16.0]);
    let mut all = sample("everything-tables", "All features but the context, in three tiers.", wide, &[]);
    all.views = vec![(1, front()), (2, off_centre()), (3, front()), (3, off_centre()), (3, inside())];
    samples.push(all);
    samples
}

fn shape_of(widths: Widths, effects: Effects, hidden: usize) -> ContextShape {
    ContextShape {
        features: widths.features,
        log_scales: n_log_scales(effects),
        channels: n_channels(widths, effects),
        hidden,
    }
}

/// The frame of the grid around all cells but the outermost.
const FRAME_CELLS: [[i32; 3]; 2] = [[-28, -30, -32], [27, 31, 25]];

fn frame() -> GridFrame {
    let [min, max] = FRAME_CELLS;
    GridFrame::spanning(min, max)
}

fn with_context(effects: Effects, widths: Widths, masks: bool, n: usize, context: &ContextDraft, seed: u64) -> Draft {
    let mut draft = small(effects, widths, masks, seed);
    draft.tiers = one_chunk(anchors(n, widths, effects, masks, seed));
    draft.max_chunk_anchors = n as u16;
    draft.coder = CoderDraft::Context(context.section());
    draft
}

/// Feature 4 and everything in section 7.
fn contexts() -> Vec<Sample> {
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

/// A context whose outputs reach their limits: means of 512 base steps, scales and steps beyond their ranges.
fn limits() -> Sample {
    let shape = shape_of(SMALL, NO_EFFECT, 3);
    let mut context = ContextDraft::grid(shape, frame(), vec![level(LevelKind::Volume, 2, 8)], 0, 220);
    let network = &mut context.networks[0];
    // Hidden units: always 32767, always 0, and what the grid says, unshifted.
    network.shift1 = vec![0, 31, 0];
    network.b1 = vec![1 << 29, -(1 << 29), 0];
    network.w1 = [[127; 4], [-128; 4], [1, -1, 2, -2]].concat();
    let c = shape.channels;
    for output in 0..2 * c + 3 {
        network.w2[3 * output..][..3].copy_from_slice(&[0, 0, 1]);
        network.shift2[output] = 14;
        network.b2[output] = 0;
    }
    // Means of ±512 base steps, scales of ±32767 eighths of an octave, and steps from the smallest to the largest.
    for (output, bias, shift) in
        [(0, 1 << 29, 0), (1, -(1 << 29), 0), (2, 1 << 29, 31), (c, 1 << 29, 0), (c + 1, -(1 << 29), 0)]
    {
        (network.b2[output], network.shift2[output]) = (bias, shift);
    }
    network.w2[3 * (2 * c)..][..9].copy_from_slice(&[[0, 0, 40], [0, 0, 2], [-128, -128, 127]].concat());
    // In the middle of the scene's log-scales.
    for output in 4..8 {
        network.b2[output] = -(16 * 64) << 14;
    }
    let mut draft = with_context(NO_EFFECT, SMALL, false, 24, &context, 220);
    for (anchor, at) in draft.tiers[0][0].iter_mut().zip(0..) {
        // Near the means where the step is the smallest: ±4096.
        anchor.symbols[0] = 4090 + at;
        anchor.symbols[1] = -4101 + at;
    }
    let about = "Outputs of the context at their limits: biases of 2²⁹, shifts of 0 and 31, steps from −24 to 7, scales from 0 to 63.";
    sample("context-limits", about, draft, &[front()])
}

/// A context with a mean and a deviation that are known, and symbols at all distances from them.
fn near_and_far() -> Sample {
    let shape = shape_of(SMALL, NO_EFFECT, 1);
    let mut context = ContextDraft::grid(shape, frame(), vec![level(LevelKind::Xy, 2, 4)], 0, 221);
    let network = &mut context.networks[0];
    let c = shape.channels;
    network.w2.fill(0);
    network.shift2.fill(0);
    network.b2.fill(0);
    // Means of −4/8 to 3/8 of a step, deviations of 1/16: D is 3.
    for (channel, bias) in network.b2[..c].iter_mut().enumerate() {
        *bias = 8 * (channel as i32 % 8 - 4);
    }
    for bias in &mut network.b2[4..8] {
        *bias -= 16 * 64;
    }
    network.b2[c..2 * c].fill(-32);
    let distances = [0, 3, -3, 4, -4, 130, -130, 131, -131, 5, -6, 60, -77];
    let far = [i16::MIN, i16::MAX, 256, -257];
    let mut draft = with_context(NO_EFFECT, SMALL, false, 20, &context, 221);
    for (anchor, at) in draft.tiers[0][0].iter_mut().zip(0..) {
        for (channel, symbol) in anchor.symbols.iter_mut().enumerate() {
            let is_log_scale = (4..8).contains(&channel);
            let pick = at + 3 * channel;
            *symbol = match far.get(pick % 23) {
                Some(&far) if !is_log_scale => far,
                _ if is_log_scale => -16 + [0, 3, -3, 4, -4, 5, -6, 0][pick % 8],
                _ => distances[pick % distances.len()],
            };
        }
    }
    // Both bytes that announce a far symbol.
    draft.recode = Some(|anchor, _, mut usual| {
        if usual.len() == 4 && anchor % 2 == 1 {
            usual[1] = super::stream::raw(254);
        }
        usual
    });
    let about = "Symbols at all distances from their means: near escapes of both signs on both sides, the nearest and the farthest of \
                 them, far escapes after a byte of 254 and of 255.";
    sample("context-escapes", about, draft, &[front()])
}

/// Section 6, the coded heads of section 3, and widths.
fn coding() -> Vec<Sample> {
    let mut samples = Vec::new();
    let draft = small(NO_EFFECT, SMALL, false, 300);
    let table = |min_symbol: i16, bounds: &[u16], origin: f32, step: f32| TableDraft {
        origin,
        step,
        min_symbol,
        bounds: bounds.to_vec(),
    };
    let mut corners = draft.clone();
    let tables = vec![
        // Only the escape.
        table(0, &[0, 4096], 0.0, 1.0 / 32.0),
        // The lowest symbols, and entries without slots before, between and behind others.
        table(i16::MIN, &[0, 0, 100, 100, 4000, 4000, 4096], 512.0, 1.0 / 64.0),
        // The highest.
        table(i16::MAX - 3, &[0, 1, 2, 4000, 4095, 4096], -1023.0, 1.0 / 32.0),
        // An origin, and more slots for the escape than for any symbol.
        table(-20, &[0, 64, 128, 192, 256, 320, 384, 448, 512, 4096], -0.125, 1.0 / 8.0),
        // One symbol with all slots but one.
        table(-1, &[0, 4095, 4096], 0.0, 1.0 / 16.0),
    ];
    corners.coder = CoderDraft::Tables(tables, vec![0, 1, 2, 4, 3, 3, 3, 3, 4, 0, 4, 4, 4, 0]);
    for (anchor, at) in corners.tiers[0][0].iter_mut().zip(0_i16..) {
        let symbols = &mut anchor.symbols;
        symbols[0] = [0, 5, -9, i16::MAX / 512, -40][at as usize % 5];
        symbols[1] = i16::MIN + [1, 3, 0, 2, 400][at as usize % 5];
        symbols[2] = i16::MAX - at % 5;
        symbols[4..8].iter_mut().zip(0..).for_each(|(symbol, i)| *symbol = -20 + (at + 2 * i) % 11);
        [symbols[3], symbols[8], symbols[10]] = [-1, -1 - at % 2, 3 * (at % 3 - 1)];
    }
    // Of a symbol that has an entry.
    corners.recode = Some(|anchor, channel, usual| match (anchor % 4, channel, usual.as_slice()) {
        (1, 4, &[(start, _)]) => {
            vec![(512, 4096 - 512), super::stream::raw(0xFF), super::stream::raw((start / 64) as u8 + 0xEC)]
        }
        _ => usual,
    });
    let about = "Tables at their limits: only an escape, the lowest and the highest symbols, entries without slots, origins, an escape \
                 with most slots, and escapes of symbols that have an entry.";
    samples.push(sample("tables-limits", about, corners, &[front()]));

    let mut bits = draft.clone();
    for (anchor, at) in bits.tiers[0][0].iter_mut().zip(0..) {
        anchor.symbols.iter_mut().enumerate().for_each(|(c, symbol)| *symbol = -(((at + c) % 3 == 0) as i16));
    }
    bits.tiers[0][0].truncate(6);
    bits.count_tables([0.5, 2.0, 0.75]);
    samples.push(sample("symbols-of-1-bit", "Symbols of one bit: −1 and 0.", bits, &[front()]));

    let mut largest = draft.clone();
    largest.symbol_bits = Some([16; 3]);
    samples.push(sample(
        "symbols-of-16-bits",
        "Header bits of symbols that are larger than needed.",
        largest,
        &[front()],
    ));

    let widest = Widths {
        features: MAX_FEATURE_DIM.into(),
        offsets: MAX_OFFSETS.into(),
        colour_hidden: MAX_FEATURE_DIM.into(),
        detail_hidden: MAX_FEATURE_DIM.into(),
    };
    let effects = Effects { detail: true, anisotropic: true, background: true, ..NO_EFFECT };
    let mut wide = Draft::of(effects, widest, one_chunk(anchors(3, widest, effects, true, 301)), front(), 301);
    wide.masks = true;
    // Nearly all weights are 0, so that they take few bytes.
    let mut numbers = Numbers::of(302);
    for head in &mut wide.heads {
        for weights in [&mut head.w1, &mut head.w2] {
            let n = weights.len() as i32;
            weights.fill(0);
            for _ in 0..48 {
                weights[numbers.between(0, n - 1) as usize] = numbers.between(-90, 90) as i16;
            }
        }
    }
    wide.head_coding = HeadCoding::Counted;
    // A table a channel, and two that none uses.
    let one_each = (0..n_channels(widest, effects) as u16).collect();
    let CoderDraft::Tables(of_groups, groups) = &wide.coder else { unreachable!("drafts begin with tables") };
    let mut tables: Vec<TableDraft> = groups
        .iter()
        .enumerate()
        .map(|(channel, &group)| {
            let found = wide.tiers.iter().flatten().flatten().map(|anchor| anchor.symbols[channel]);
            let [least, most] = [found.clone().min(), found.clone().max()].map(|end| end.expect("anchors"));
            TableDraft::counting(of_groups[usize::from(group)].step, [least, most], found)
        })
        .collect();
    tables.extend([tables[0].clone(), tables[1].clone()]);
    wide.coder = CoderDraft::Tables(tables, one_each);
    let about = "The widest anchors, F = 256 and K = 32, the widest heads, and 360 tables.";
    samples.push(sample("widest", about, wide, &[front()]));

    let least = Widths { features: 1, offsets: 1, colour_hidden: 1, detail_hidden: 1 };
    let effects = Effects { detail: true, ..NO_EFFECT };
    let mut smallest = Draft::of(
        effects,
        least,
        one_chunk(anchors(1, least, effects, false, 303)),
        view([1.7, -1.1, 0.6], [1, 1]),
        303,
    );
    for head in &mut smallest.heads {
        head.w1.fill(40);
        head.w2.fill(70);
        head.b1.fill(9);
        head.b2.fill(30);
    }
    smallest.heads[1].b2.fill(-40);
    let certain =
        |symbol: i16, step: f32| TableDraft { origin: 0.0, step, min_symbol: symbol, bounds: vec![0, 4095, 4096] };
    smallest.head_coding = HeadCoding::Tables([certain(40, UNIT), certain(70, UNIT)]);
    smallest.tiers[0][0][0].symbols = vec![6; smallest.n_channels()];
    smallest.coder = CoderDraft::Tables(vec![certain(6, 1.0 / 128.0)], vec![0; smallest.n_channels()]);
    let about = "The smallest: widths of 1, one anchor in a lattice of one cell, a preview of one pixel, one table; the symbols of heads and \
                 chunk are certain, so that their streams have no words.";
    samples.push(sample("smallest", about, smallest, &[view([1.7, -1.1, 0.6], [1, 1]), front()]));
    samples
}

/// Section 4.
fn positions() -> Vec<Sample> {
    let mut samples = Vec::new();
    let effects = ANISOTROPIC;
    let mut one_cell = small(effects, SMALL, false, 400);
    let mut three = anchors(3, SMALL, effects, false, 400);
    three.iter_mut().for_each(|anchor| anchor.cell = [3, -2, 5]);
    one_cell.tiers = vec![three.into_iter().map(|anchor| vec![anchor]).collect()];
    one_cell.max_chunk_anchors = 1;
    one_cell.count_tables([1.0 / 16.0, 1.0 / 8.0, 1.0 / 16.0]);
    let about = "A lattice of one cell (b = 0) that an anchor of each of three chunks stands in; a chunk has one anchor at most.";
    samples.push(sample("lattice-of-one-cell", about, one_cell, &[front()]));

    let limit = 1 << 23;
    let mut wide = small(effects, SMALL, false, 401);
    let edge = (1 << 21) - 1;
    let min = [-limit, limit, -5];
    wide.lattice = Some((min, 21));
    wide.voxel_size = 1.0 / (1 << 21) as f32;
    let mut numbers = Numbers::of(401);
    let mut cells: Vec<[i32; 3]> =
        (0..8).map(|i| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { edge } else { 0 })).collect();
    cells.extend((0..6).map(|_| std::array::from_fn(|_| numbers.between(0, edge))));
    for (anchor, cell) in wide.tiers[0][0].iter_mut().zip(cells) {
        anchor.cell = std::array::from_fn(|axis| min[axis] + cell[axis]);
    }
    let target = DVec3::new(-3.5, 4.5, 0.5);
    let camera = to_core(&look_at(target + DVec3::new(1.9, -2.4, 1.1), target, 1.2, [48, 36]));
    wide.preview = camera;
    let about = "The widest lattice: 21 bits, its lowest cell at ±2²³, anchors in all of its corners.";
    samples.push(sample("lattice-of-21-bits", about, wide, &[camera]));

    let least = Widths { features: 1, offsets: 1, colour_hidden: 2, detail_hidden: 0 };
    let n = usize::from(MAX_CHUNK_ANCHORS);
    let mut full: Vec<Anchor> = anchors(n, least, NO_EFFECT, false, 402);
    for (anchor, at) in full.iter_mut().zip(0_i32..) {
        // A solid block in the first half of which a trie has both children everywhere.
        anchor.cell = [at % 8 - 4, at / 8 % 8 - 4, at / 64 - 8];
        anchor.symbols[1..5].fill(-22);
    }
    let draft = Draft::of(NO_EFFECT, least, one_chunk(full), front(), 402);
    samples.push(sample("chunk-of-1024", "A chunk of 1024 anchors, a solid block.", draft, &[front()]));

    let mut none = small(Effects { background: true, ..NO_EFFECT }, SMALL, false, 403);
    none.tiers = vec![Vec::new()];
    none.lattice = Some(([-2; 3], 2));
    none.count_tables([1.0 / 16.0, 1.0 / 8.0, 1.0 / 16.0]);
    samples.push(sample("no-anchors", "No anchor: a frame is its background.", none, &[front()]));
    samples
}

/// Tiers, files that end at one, and files with something behind them.
fn tiers() -> Vec<Sample> {
    let effects = Effects { view_colour: true, background: true, ..ANISOTROPIC };
    let some = anchors(36, SMALL, effects, true, 500);
    let mut draft = small(effects, SMALL, true, 500);
    // The first and the fifth tier are empty.
    draft.tiers = in_tiers(&some, &[0, 5, 11, 17, 17, 24, 30, 36], 4);
    draft.max_chunk_anchors = 4;
    draft.count_tables([1.0 / 16.0, 1.0 / 8.0, 1.0 / 16.0]);
    let all = draft.clone().anchors();
    let n_anchors: Vec<usize> = draft.tiers.iter().map(|tier| tier.iter().map(Vec::len).sum()).collect();
    let whole = draft.file();
    let mut samples = Vec::new();
    let mut push = |name: String, about: String, bytes: Vec<u8>, views: Vec<(u8, Camera)>| {
        let most = views.iter().map(|view| usize::from(view.0)).max().unwrap_or(0);
        let anchors = all[..n_anchors[..most].iter().sum()].to_vec();
        samples.push(Sample { name, about, bytes, anchors, views });
    };
    let about = "Eight tiers, the first and the fifth of which are empty.".to_owned();
    push("tiers-8".to_owned(), about, whole.clone(), vec![(8, front()), (3, front())]);
    for (tiers, end) in tier_ends(&whole) {
        if tiers < 8 {
            let about = format!("The same, ending where {tiers} tiers end.");
            push(format!("tiers-8-cut-{tiers}"), about, whole[..end].to_vec(), vec![(tiers, front())]);
        }
    }
    for (tiers, end) in tier_ends(&whole).into_iter().filter(|(tiers, _)| [1, 5, 7].contains(tiers)) {
        let mut written = whole.clone();
        assert_eq!(cut_after(&mut written, tiers), Ok(end), "a sound draft");
        let about = format!(
            "The same, cut by who wrote its length anew after {tiers} tiers; what was behind them lies in the partition still."
        );
        push(format!("tiers-8-cut-{tiers}-in-partition"), about, written, vec![(tiers, front())]);
    }
    let erased = [whole.clone(), vec![0xFF; 96]].concat();
    let about = "The same in a longer flash partition: bytes of someone else follow.".to_owned();
    push("tiers-8-in-partition".to_owned(), about, erased, vec![(8, front())]);
    samples
}

/// Tiers and length of each file that a bundle can be cut to; of tiers that end alike the last.
pub(super) fn tier_ends(file: &[u8]) -> Vec<(u8, usize)> {
    let bundle = Bundle::parse(file).expect("a sound draft");
    let mut ends: Vec<(u8, usize)> = (1..).zip(crate::bundles::tier_ends(&bundle)).collect();
    ends.reverse();
    ends.dedup_by_key(|(_, end)| *end);
    ends.reverse();
    ends
}

/// Sections that a decoder may skip, and everything else of the header that no pixel depends on.
fn sections() -> Vec<Sample> {
    let mut samples = Vec::new();
    let mut some = small(NO_EFFECT, SMALL, false, 600);
    some.protocol = Some(b"[[capture]]\nsize = [48, 36]\n".iter().copied().cycle().take(200).collect());
    some.unknown = vec![
        (0, 130, b"before the heads".to_vec()),
        (2, 255, Vec::new()),
        (4, 130, b"the same kind again".to_vec()),
        (6, 200, vec![0; 5]),
    ];
    some.optional_features = 0xFFFF_FFFF;
    some.training_px = [u16::MAX, 1];
    some.normalisation = ([-1e300, 1e-300, 0.0], f64::MIN_POSITIVE);
    let about = "Sections of unknown kinds, one of them twice and one empty, a protocol of 200 bytes, and all optional features.";
    samples.push(sample("sections-unknown", about, some, &[front()]));

    let mut most = small(NO_EFFECT, SMALL, false, 601);
    most.unknown = (0..249).map(|i| (i % 6, 131 + (i % 120) as u8, vec![i as u8; i % 2])).collect();
    most.unknown.sort_by_key(|section| section.0);
    most.protocol = None;
    samples.push(sample("sections-255", "A section table of 255 rows.", most, &[front()]));

    let mut unmeant = small(Effects { view_distance: true, ..NO_EFFECT }, SMALL, false, 602);
    unmeant.unknown = vec![(6, 128, 7_u32.to_le_bytes().to_vec())];
    unmeant.protocol = Some(Vec::new());
    let about =
        "A section gaussians in a scene whose heads see the view, where it means nothing, and an empty protocol.";
    // Before the chunks: heads, lattice, tables, manifest, directory.
    unmeant.unknown[0].0 = 5;
    samples.push(sample("gaussians-without-meaning", about, unmeant, &[front()]));
    for (level, size_px, seed) in [(1, [48, 36], 603), (5, [640, 480], 604)] {
        let mut measured = small(NO_EFFECT, SMALL, false, seed);
        measured.tiers = in_tiers(&anchors(20, SMALL, NO_EFFECT, false, seed), &[10, 20], 5);
        measured.max_chunk_anchors = 5;
        measured.training_px = size_px.map(|px| px as u16);
        let file = measured.clone().file();
        let bundle = Bundle::parse(&file).expect("a sound draft");
        let eyes = [[1.7, -1.1, 0.6], [-1.2, -1.3, 0.9]];
        let views = eyes.map(|eye| look_at(eye.into(), DVec3::ZERO, 1.2, size_px));
        measured.measures = manifest::measure(&bundle, &views, &[]).expect("sound chunks");
        measured.measures.iter_mut().for_each(|of_tier| of_tier.level = level);
        (measured.measures[1].psnr_db, measured.measures[1].n_views) = (Some(-3.25), 2);
        let about = format!(
            "A manifest with measures of {}×{} pixels, level {level}, and a PSNR below 0.",
            size_px[0], size_px[1]
        );
        samples.push(sample(&format!("manifest-level-{level}"), &about, measured, &[front()]));
    }
    samples
}

/// Scenes with a section gaussians: what section 10 rounds.
fn baked() -> Vec<Sample> {
    let effects = Effects { dilation_compensation: true, detail: true, background: true, ..ANISOTROPIC };
    let some = anchors(30, DETAILED, effects, true, 700);
    let mut draft = small(effects, DETAILED, true, 700);
    draft.tiers = in_tiers(&some, &[14, 30], 8);
    draft.max_chunk_anchors = 8;
    draft.gaussians = true;
    draft.count_tables([1.0 / 16.0, 1.0 / 8.0, 1.0 / 16.0]);
    let about = "A section gaussians: opacities, colours, scales and rotations are rounded, and there is no prefilter.";
    let mut all = sample("baked", about, draft, &[]);
    all.views = vec![(1, front()), (2, off_centre()), (2, inside())];
    let mut round = small(Effects { background: true, ..NO_EFFECT }, SMALL, false, 701);
    round.gaussians = true;
    round.tiers = one_chunk(anchors(30, SMALL, NO_EFFECT, false, 701));
    round.max_chunk_anchors = 30;
    round.count_tables([1.0 / 16.0, 1.0 / 8.0, 1.0 / 16.0]);
    vec![all, sample("baked-isotropic", "The same of isotropic Gaussians.", round, &[front(), inside()])]
}
