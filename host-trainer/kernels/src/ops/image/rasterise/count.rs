//! How much work the blending of an image is.

use rayon::prelude::*;

use super::row::{ALL_ROWS, LOOK_EVERY, SplatRows, live_rows, set_bits, step_row};
use super::{Tile, TileSplat};
use crate::ops::image::project::{Footprint, Splat};
use crate::ops::image::tiles::{TILE_PX, TileLists};
use crate::real::Real;

/// What [`forward`](super::forward()) does, in numbers of (pixel, splat).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BlendCounts {
    /// Whose alpha it evaluates: all pixels of every row that a splat reaches in a tile, until the row has stopped.
    pub evaluated: u64,
    /// Which change a pixel: where alpha is at the cutoff or above, and the pixel has not stopped.
    pub blended: u64,
}

/// Counts what [`forward`](super::forward()) does with these splats.
///
/// Cost: that of drawing them, several times over.
pub fn count<R: Real>(splats: &[Splat<R>], footprints: &[Footprint<R>], lists: &TileLists) -> BlendCounts {
    let of_tiles = (0..lists.n_tiles()).into_par_iter().map(|t| count_tile(&Tile::new(splats, footprints, lists, t)));
    of_tiles.reduce(BlendCounts::default, |a, b| BlendCounts {
        evaluated: a.evaluated + b.evaluated,
        blended: a.blended + b.blended,
    })
}

fn count_tile<R: Real>(tile: &Tile<R>) -> BlendCounts {
    let mut transmittance = [[R::ONE; TILE_PX]; TILE_PX];
    let mut live = ALL_ROWS;
    let mut counts = BlendCounts::default();
    for (n, TileSplat { splat, reach }) in tile.splats.iter().enumerate() {
        let rows = SplatRows::new(splat, *reach, tile.x, &tile.ys);
        for y in set_bits(rows.reached & live) {
            let (mut alpha, _, _) = rows.alpha(y, splat.opacity);
            let weight = step_row(&mut alpha, &mut transmittance[y]);
            counts.evaluated += TILE_PX as u64;
            counts.blended += weight.iter().filter(|weight| **weight > R::ZERO).count() as u64;
        }
        if n % LOOK_EVERY == 0 {
            live = live_rows(live, &transmittance);
            if live == 0 {
                break;
            }
        }
    }
    counts
}
