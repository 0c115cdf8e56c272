//! From splats to pixels.

use rayon::prelude::*;

use super::row::{ALL_ROWS, LOOK_EVERY, SplatRows, live_rows, set_bits, step_row};
use super::{TILE_VALUES, Tile, TileSplat, TiledImage};
use crate::ops::image::project::{Footprint, Splat};
use crate::ops::image::tiles::{TILE_PX, TileLists};
use crate::ops::simd::Level;
use crate::real::Real;

/// Draws all tiles.
///
/// * `splats`, `footprints`: `[n]`. * `background`: RGB. * returns the colour in tile order; pixels beyond the image's
///   edge are drawn like any other and dropped by [`TiledImage::to_planes`].
pub fn forward<R: Real>(
    level: Level,
    splats: &[Splat<R>],
    footprints: &[Footprint<R>],
    lists: &TileLists,
    background: [R; 3],
) -> TiledImage<R> {
    let mut image = TiledImage::default();
    forward_into(&mut image, level, splats, footprints, lists, background);
    image
}

/// [`forward`] into an image that is there.
pub fn forward_into<R: Real>(
    image: &mut TiledImage<R>,
    level: Level,
    splats: &[Splat<R>],
    footprints: &[Footprint<R>],
    lists: &TileLists,
    background: [R; 3],
) {
    image.fit(lists.grid);
    let tiles = image.colour.par_chunks_mut(3 * TILE_VALUES).zip(image.transmittance.par_chunks_mut(TILE_VALUES));
    tiles.enumerate().for_each(|(t, (out, through))| {
        let tile = Tile::new(splats, footprints, lists, t);
        level.run(
            #[inline(always)]
            || forward_tile(&tile, background, out, through),
        );
    });
}

#[inline(always)]
fn forward_tile<R: Real>(tile: &Tile<R>, background: [R; 3], out: &mut [R], through: &mut [R]) {
    let mut transmittance = [[R::ONE; TILE_PX]; TILE_PX];
    let mut colour = [[[R::ZERO; TILE_PX]; TILE_PX]; 3];
    let mut live = ALL_ROWS;
    for (n, TileSplat { splat, reach }) in tile.splats.iter().enumerate() {
        let rows = SplatRows::new(splat, *reach, tile.x, &tile.ys);
        for y in set_bits(rows.reached & live) {
            let (mut alpha, _, _) = rows.alpha(y, splat.opacity);
            let weight = step_row(&mut alpha, &mut transmittance[y]);
            for (plane, c) in colour.iter_mut().zip(splat.colour) {
                for (out, w) in plane[y].iter_mut().zip(&weight) {
                    *out += *w * c;
                }
            }
        }
        if n % LOOK_EVERY == 0 {
            live = live_rows(live, &transmittance);
            if live == 0 {
                break;
            }
        }
    }
    for (o, t) in through.iter_mut().zip(transmittance.as_flattened()) {
        *o = t.abs();
    }
    for ((plane, bg), out) in colour.iter().zip(background).zip(out.chunks_exact_mut(TILE_VALUES)) {
        for ((c, t), o) in plane.as_flattened().iter().zip(&*through).zip(out) {
            *o = *c + *t * bg;
        }
    }
}
