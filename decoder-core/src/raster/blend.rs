//! Front-to-back compositing of one tile.

use pocketsplat_format::math::EXPONENTIAL;
use pocketsplat_format::rules::{self, TILE_PX};
use pocketsplat_half::{BlendConstants, ROW_LEN, RowSplat, SLACK_PX, span, sqrt_above};

use crate::functions::Functions;
use crate::project::{PackedSplat, Splat, TileRect, log_cut};

const TRANSMITTANCE_MIN: f32 = rules::TRANSMITTANCE_MIN as f32;
/// One per cent below the logarithm of the largest alpha.
const LOG_OPACITY_BELOW_MAX: f32 = -0.0201;
static CONSTANTS: BlendConstants =
    BlendConstants::new(EXPONENTIAL, rules::ALPHA_MAX as f32, LOG_OPACITY_BELOW_MAX, TRANSMITTANCE_MIN);
const _: () = assert!(rules::ALPHA_MAX > 0.99 - 1e-9 && ROW_LEN == TILE_PX as usize);

/// Which contributions are left out.
pub(crate) struct BlendRule {
    /// −ln of the least alpha.
    log_cut: f32,
}

impl BlendRule {
    /// * `alpha_cut`: the least alpha, in 255ths.
    pub(crate) fn new(alpha_cut: u8) -> Self {
        Self { log_cut: log_cut(alpha_cut) }
    }
}

/// Red, green, blue and transmittance of a pixel while it is drawn; the transmittance of a finished one is negated, so that it fails
/// every later test without a flag of its own.
pub(crate) type Pixel = [f32; 4];

/// Nothing drawn yet.
pub(crate) const EMPTY: Pixel = [0.0, 0.0, 0.0, 1.0];

/// Where a tile lies; it ends early at the frame's right and lower border.
#[derive(Clone, Copy)]
pub(crate) struct TileRegion {
    pub(crate) column: u8,
    pub(crate) row: u8,
    pub(crate) width: u16,
    pub(crate) height: u16,
}

/// What a tile cost.
#[derive(Clone, Copy, Default)]
pub(crate) struct TileWork {
    /// Splats blended into it.
    pub(crate) splats: u32,
    /// Rows of pixels that a splat reaches.
    pub(crate) rows: u32,
    /// Pixels for which a splat was evaluated.
    pub(crate) pixels: u32,
    /// Pixels that are not finished.
    pub(crate) alive: u32,
    /// Entries of the list that it has seen to; all when no pixel is left.
    pub(crate) listed: usize,
}

/// Splats that one call blends at most, and entries of a list that it looks at.
const SPLATS_OF_STEP: u32 = 64;
const ENTRIES_OF_STEP: usize = 8192;

/// Draws the first splats of `list` that lie in a tile, in its order, behind what is in it.
///
/// * `list`: indices into `splats` and `rects`, nearest first; entries beside the tile's columns are skipped.
/// * `pixels`: `[TILE_PIXELS]`, [`EMPTY`] at first.
///
/// # Budget
/// Per splat and row of pixels two exponentials, per pixel two multiplications and the blend; at most [`SPLATS_OF_STEP`] splats.
pub(crate) fn blend_tile<F: Functions>(
    place: TileRegion,
    splats: &[PackedSplat],
    rects: &[TileRect],
    list: &[u32],
    rule: &BlendRule,
    pixels: &mut [Pixel],
) -> TileWork {
    let rows = pixels.chunks_exact(TILE_PX.into()).take(place.height.into());
    let in_tile = rows.flat_map(|row| row.iter().take(place.width.into()));
    let mut alive = in_tile.filter(|[.., transmittance]| *transmittance > 0.0).count() as u32;
    let mut work = TileWork::default();
    let at = [place.column, place.row].map(|index| f32::from(u16::from(index) * TILE_PX));
    let mut entries = list.iter();
    let n_left = list.len().saturating_sub(ENTRIES_OF_STEP);
    while alive > 0 && work.splats < SPLATS_OF_STEP && entries.len() > n_left {
        let Some(&index) = entries.next() else { break };
        let (Some(rect), Some(splat)) = (rects.get(index as usize), splats.get(index as usize)) else { continue };
        if place.column < rect.first_column || place.column > rect.last_column {
            continue;
        }
        let [rows, evaluated] = blend_splat::<F>(place, at, &splat.unpack(), rule, pixels, &mut alive);
        work.splats += 1;
        work.rows += rows;
        work.pixels = work.pixels.saturating_add(evaluated);
    }
    let listed = if alive > 0 { list.len() - entries.len() } else { list.len() };
    TileWork { alive, listed, ..work }
}

/// Puts the background behind a tile, if there is one, and rounds to bytes, `[height, width]` row by row.
// Not inlined: that saves text, and a frame calls it once a tile.
#[inline(never)]
pub(crate) fn finish_tile(place: TileRegion, pixels: &[Pixel], background: Option<[f32; 3]>, rgb: &mut [[u8; 3]]) {
    match background {
        Some(background) => finish(place, pixels, rgb, |pixel| behind(pixel, background)),
        None => finish(place, pixels, rgb, |[red, green, blue, _]| [red, green, blue]),
    }
}

/// Rounds what `colour` makes of each pixel to bytes.
fn finish(place: TileRegion, pixels: &[Pixel], rgb: &mut [[u8; 3]], colour: impl Fn(Pixel) -> [f32; 3]) {
    let (rows, _) = pixels.as_chunks::<{ TILE_PX as usize }>();
    let out_rows = rgb.chunks_exact_mut(usize::from(place.width).max(1));
    for (out_row, row) in out_rows.zip(rows).take(place.height.into()) {
        for (out, pixel) in out_row.iter_mut().zip(row) {
            // A float cast saturates: negative becomes 0, and so does NaN; 255.5 and more become 255.
            *out = colour(*pixel).map(|channel| (channel * 255.0 + 0.5) as u8);
        }
    }
}

/// Blends one splat into the rows of the tile that begins at (`tile_x`, `tile_y`) pixels; returns how many rows it reaches and how many pixels it was evaluated for.
#[inline(always)]
fn blend_splat<F: Functions>(
    place: TileRegion,
    [tile_x, tile_y]: [f32; 2],
    splat: &Splat,
    rule: &BlendRule,
    pixels: &mut [Pixel],
    alive: &mut u32,
) -> [u32; 2] {
    let [mean_x, mean_y] = splat.mean;
    // In pixels of the tile, measured from the centre of its first one.
    let centre_x = mean_x - tile_x - 0.5;
    let centre_y = mean_y - tile_y - 0.5;
    let reach = 2.0 * (splat.log_opacity + rule.log_cut);
    // Rounded, the opacity may lie below the cut. Written so that NaN leaves as well.
    if !(reach >= 0.0) {
        return [0; 2];
    }
    let half_height = sqrt_above(reach / splat.column_precision) + SLACK_PX;
    let Some((first, last)) = span(centre_y, half_height, place.height) else { return [0; 2] };
    let (rows, _) = pixels.as_chunks_mut::<ROW_LEN>();
    let Some(rows) = rows.get_mut(first..=last) else { return [0; 2] };
    let n_rows = rows.len() as u32;
    let mut row_splat = RowSplat {
        dy: first as f32 - centre_y,
        shear: splat.shear,
        row_precision: splat.row_precision,
        column_precision: splat.column_precision,
        log_opacity: splat.log_opacity,
        reach,
        row_variance: 1.0 / splat.row_precision,
        centre_x,
        colour: splat.colour,
        // Whatever the functions: its error grows with the square of a pixel's distance.
        ratio_step: EXPONENTIAL.near(-splat.row_precision),
        transmittance_stop: TRANSMITTANCE_MIN,
        free: [0; 4],
    };
    let work = F::blend_rows(&mut row_splat, &CONSTANTS, rows, place.width);
    *alive = alive.saturating_sub(work.finished);
    [n_rows, work.pixels]
}

/// The colour with the background behind it.
#[inline]
fn behind([r, g, b, transmittance]: Pixel, [back_r, back_g, back_b]: [f32; 3]) -> [f32; 3] {
    let through = transmittance.abs();
    [r + through * back_r, g + through * back_g, b + through * back_b]
}
