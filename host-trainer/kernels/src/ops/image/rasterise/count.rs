//! How much work the blending of an image is.

use rayon::prelude::*;

use super::row::{ALL_ROWS, LOOK_EVERY, SplatRows, live_rows, set_bits, step_row};
use super::{Tile, TileSplat};
use crate::ops::image::project::{Footprint, Splat};
use crate::ops::image::tiles::{TILE_PX, TileLists};
use crate::real::Real;

/// What [`forward`](super::forward()) does, pixels beyond the image's edge included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawCounts {
    /// Splats.
    pub splats: usize,
    /// Of a tile and a splat.
    pub pairs: usize,
    /// Of a pixel and a splat whose alpha it evaluates: all pixels of every row that a splat reaches in a tile, until the row has stopped.
    pub evaluated: u64,
    /// Of a pixel and a splat that changes it: where alpha is at the cutoff or above, and the pixel has not stopped.
    pub blended: u64,
}

/// Counts what [`forward`](super::forward()) does with these splats.
///
/// Cost: that of drawing them, several times over.
pub fn count<R: Real>(splats: &[Splat<R>], footprints: &[Footprint<R>], lists: &TileLists) -> DrawCounts {
    let of_tiles = (0..lists.n_tiles()).into_par_iter().map(|t| count_tile(&Tile::new(splats, footprints, lists, t)));
    let [evaluated, blended] = of_tiles.reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    DrawCounts { splats: splats.len(), pairs: lists.entries.len(), evaluated, blended }
}

/// Evaluated and blended.
fn count_tile<R: Real>(tile: &Tile<R>) -> [u64; 2] {
    let mut transmittance = [[R::ONE; TILE_PX]; TILE_PX];
    let mut live = ALL_ROWS;
    let [mut evaluated, mut blended] = [0; 2];
    for (n, TileSplat { splat, reach }) in tile.splats.iter().enumerate() {
        let rows = SplatRows::new(splat, *reach, tile.x, &tile.ys);
        for y in set_bits(rows.reached & live) {
            let (mut alpha, _, _) = rows.alpha(y, splat.opacity);
            let weight = step_row(&mut alpha, &mut transmittance[y]);
            evaluated += TILE_PX as u64;
            blended += weight.iter().filter(|weight| **weight > R::ZERO).count() as u64;
        }
        if n % LOOK_EVERY == 0 {
            live = live_rows(live, &transmittance);
            if live == 0 {
                break;
            }
        }
    }
    [evaluated, blended]
}
