//! Front-to-back compositing of one tile.

use pocketsplat_format::rules::TILE_PX;

use super::blending::{Blending, Pixel, TileRegion};
use crate::project::{PackedSplat, TileRect};

/// Splats and their tiles, each by the number that lists have of it.
pub(crate) trait Splats: Copy {
    /// Splat `number`, if there is one.
    fn splat(&self, number: u32) -> Option<(&TileRect, &PackedSplat)>;

    /// Its tiles.
    fn rect(&self, number: u32) -> Option<&TileRect>;
}

/// Numbered as they lie in memory.
impl Splats for (&[PackedSplat], &[TileRect]) {
    #[inline(always)]
    fn splat(&self, number: u32) -> Option<(&TileRect, &PackedSplat)> {
        let (Some(rect), Some(splat)) = (self.1.get(number as usize), self.0.get(number as usize)) else { return None };
        Some((rect, splat))
    }

    #[inline(always)]
    fn rect(&self, number: u32) -> Option<&TileRect> {
        self.1.get(number as usize)
    }
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
/// * `list`: numbers of `splats`, nearest first; entries beside the tile's columns are skipped.
/// * `pixels`: `[TILE_PIXELS]`, [empty](Blending::EMPTY) at first.
///
/// # Budget
/// As [`Blending::blend`] for at most [`SPLATS_OF_STEP`] splats.
pub(crate) fn blend_tile<B: Blending>(
    place: TileRegion,
    splats: impl Splats,
    list: &[u32],
    rule: &B::Rule,
    pixels: &mut [Pixel],
) -> TileWork {
    let rows = pixels.chunks_exact(TILE_PX.into()).take(place.height.into());
    let in_tile = rows.flat_map(|row| row.iter().take(place.width.into()));
    let mut alive = in_tile.filter(|pixel| B::is_alive(**pixel)).count() as u32;
    let mut work = TileWork::default();
    let at = [place.column, place.row].map(|index| f32::from(u16::from(index) * TILE_PX));
    let mut entries = list.iter();
    let n_left = list.len().saturating_sub(ENTRIES_OF_STEP);
    while alive > 0 && work.splats < SPLATS_OF_STEP && entries.len() > n_left {
        let Some(&index) = entries.next() else { break };
        let Some((rect, splat)) = splats.splat(index) else { continue };
        if place.column < rect.first_column || place.column > rect.last_column {
            continue;
        }
        let splat = B::blend(place, at, splat, rule, pixels);
        alive = alive.saturating_sub(splat.finished);
        work.splats += 1;
        work.rows += splat.rows;
        work.pixels = work.pixels.saturating_add(splat.pixels);
    }
    let listed = if alive > 0 { list.len() - entries.len() } else { list.len() };
    TileWork { alive, listed, ..work }
}

/// Puts the background behind a tile, if there is one, and rounds to bytes, `[height, width]` row by row.
// Not inlined: that saves text, and a frame calls it once a tile.
#[inline(never)]
pub(crate) fn finish_tile<B: Blending>(
    place: TileRegion,
    pixels: &[Pixel],
    background: Option<[f32; 3]>,
    rgb: &mut [[u8; 3]],
) {
    match background.map(B::background) {
        Some(background) => finish(place, pixels, rgb, |pixel| B::rgb_before(pixel, background)),
        None => finish(place, pixels, rgb, B::rgb),
    }
}

/// Rounds each pixel to bytes.
fn finish(place: TileRegion, pixels: &[Pixel], rgb: &mut [[u8; 3]], rounded: impl Fn(Pixel) -> [u8; 3]) {
    let (rows, _) = pixels.as_chunks::<{ TILE_PX as usize }>();
    let out_rows = rgb.chunks_exact_mut(usize::from(place.width).max(1));
    for (out_row, row) in out_rows.zip(rows).take(place.height.into()) {
        for (out, pixel) in out_row.iter_mut().zip(row) {
            *out = rounded(*pixel);
        }
    }
}
