//! The bundles of the pack.

mod baked;
mod coding;
mod context_limits;
mod contexts;
mod features;
mod positions;
mod sections;
mod tiers;

use glam::DVec3;
use pocketsplat_format::Camera;
use pocketsplat_format::bundle::Effects;

use super::draft::{Draft, group_of, n_channels, n_log_scales};
use super::heads::Widths;
use super::models::Anchor;
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
    let parts = [
        features::samples(),
        contexts::samples(),
        coding::samples(),
        positions::samples(),
        tiers::samples(),
        sections::samples(),
        baked::samples(),
        splats::samples(),
    ];
    parts.into_iter().flatten().collect()
}

fn small(effects: Effects, widths: Widths, masks: bool, seed: u64) -> Draft {
    let anchors = anchors(14, widths, effects, masks, seed);
    Draft { masks, ..Draft::of(effects, widths, one_chunk(anchors), front(), seed) }
}
