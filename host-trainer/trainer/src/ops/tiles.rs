//! Which splats each tile draws, in which order.

use pocketsplat_core::rules;
use rayon::prelude::*;

use super::project::{Footprint, Splat};
use crate::real::Real;

/// Edge of a tile, pixels; one row of a tile is one vector of the rasteriser.
pub const TILE_PX: usize = rules::TILE_PX as usize;

/// A splat in the list of one tile.
///
/// Lists of all tiles lie one after the other in [`TileLists::entries`]; the position there is also the slot of the
/// (tile, splat) gradients.
#[derive(Clone, Debug, Default)]
pub struct TileLists {
    /// Tiles across and down.
    pub grid: [usize; 2],
    /// `[n_tiles + 1]`: the entries of tile t are `starts[t]..starts[t + 1]`.
    pub starts: Vec<u32>,
    /// `[n_pairs]` splat indices, nearest first within a tile.
    pub entries: Vec<u32>,
    /// `[n_splats + 1]`: the slots of splat s are `slots[slot_starts[s]..slot_starts[s + 1]]`.
    pub slot_starts: Vec<u32>,
    /// `[n_pairs]` positions in `entries`, tiles ascending within a splat.
    pub slots: Vec<u32>,
}

/// Half-open tile rectangle `[x0, x1, y0, y1]` of the pixel centres within a footprint.
fn tile_rectangle<R: Real>(splat: &Splat<R>, footprint: &Footprint<R>, size_px: [usize; 2]) -> [usize; 4] {
    let mut rectangle = [0; 4];
    for i in 0..2 {
        let centre: f64 = splat.mean_px[i].into();
        let half: f64 = footprint.half_extent_px[i].into();
        // Pixel p has its centre at p + ½. One part in 10⁵ of slack, because the rasteriser compares alpha, not distance.
        let slack = 1e-5 * half + 1e-4;
        let first = (centre - half - slack - 0.5).ceil().max(0.0);
        let last = (centre + half + slack - 0.5).floor().min(size_px[i] as f64 - 1.0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "both lie in 0..=size")]
        let (first, end) = (first as usize, (last + 1.0).max(0.0) as usize);
        rectangle[2 * i] = first / TILE_PX;
        rectangle[2 * i + 1] = end.div_ceil(TILE_PX).max(first / TILE_PX);
    }
    rectangle
}

/// Sorts the splats by depth and lists them per tile.
///
/// Order: depth ascending, ties by splat index, that is by anchor and offset. Cost: one sort of n splats and two passes
/// over the (tile, splat) pairs.
pub fn build<R: Real>(splats: &[Splat<R>], footprints: &[Footprint<R>], size_px: [usize; 2]) -> TileLists {
    let grid = size_px.map(|s| s.div_ceil(TILE_PX));
    let rectangles: Vec<[usize; 4]> =
        splats.par_iter().zip(footprints).map(|(s, f)| tile_rectangle(s, f, size_px)).collect();
    let mut order: Vec<u64> = footprints
        .par_iter()
        .enumerate()
        .map(|(i, f)| {
            #[expect(clippy::cast_possible_truncation, reason = "the sort key is the f32 depth on purpose")]
            let depth: f32 = Into::<f64>::into(f.depth) as f32;
            // Depths are positive, so their bits order as they do.
            (u64::from(depth.to_bits()) << 32) | i as u64
        })
        .collect();
    order.par_sort_unstable();

    let n_tiles = grid[0] * grid[1];
    let mut starts = vec![0u32; n_tiles + 1];
    let mut slot_starts = Vec::with_capacity(splats.len() + 1);
    let mut n_pairs = 0u32;
    for [x0, x1, y0, y1] in &rectangles {
        slot_starts.push(n_pairs);
        for y in *y0..*y1 {
            for start in &mut starts[y * grid[0] + x0 + 1..=y * grid[0] + x1] {
                *start += 1;
            }
        }
        n_pairs += u32::try_from((x1 - x0) * (y1 - y0)).expect("a splat covers fewer than 2³² tiles");
    }
    slot_starts.push(n_pairs);
    for t in 0..n_tiles {
        starts[t + 1] += starts[t];
    }

    let mut next = starts.clone();
    let mut entries = vec![0u32; n_pairs as usize];
    let mut slots = vec![0u32; n_pairs as usize];
    for key in order {
        #[expect(clippy::cast_possible_truncation, reason = "the low half of the key is the index")]
        let splat = key as u32;
        let [x0, x1, y0, y1] = rectangles[splat as usize];
        let mut slot = slot_starts[splat as usize] as usize;
        for y in y0..y1 {
            for at in &mut next[y * grid[0] + x0..y * grid[0] + x1] {
                entries[*at as usize] = splat;
                slots[slot] = *at;
                *at += 1;
                slot += 1;
            }
        }
    }
    TileLists { grid, starts, entries, slot_starts, slots }
}

impl TileLists {
    /// Number of tiles.
    pub fn n_tiles(&self) -> usize {
        self.grid[0] * self.grid[1]
    }

    /// The splats of tile `t`, nearest first.
    pub fn tile(&self, t: usize) -> &[u32] {
        &self.entries[self.starts[t] as usize..self.starts[t + 1] as usize]
    }

    /// The gradient slots of splat `s`.
    pub fn slots_of(&self, s: usize) -> &[u32] {
        &self.slots[self.slot_starts[s] as usize..self.slot_starts[s + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::random;

    #[test]
    fn every_tile_lists_what_reaches_it_nearest_first() {
        let size = [70, 50];
        let n = 200;
        let x = random(3, n * 5);
        let (splats, footprints): (Vec<_>, Vec<_>) = x
            .chunks_exact(5)
            .map(|v| {
                let splat = Splat { mean_px: [35.0 + 45.0 * v[0], 25.0 + 35.0 * v[1]], ..Splat::default() };
                // A coarse depth, so that there are ties.
                let depth = 1.0 + (v[4] * 4.0).abs().floor();
                (splat, Footprint { depth, half_extent_px: [12.0 * v[2].abs(), 12.0 * v[3].abs()] })
            })
            .unzip();
        let lists = build(&splats, &footprints, size);
        for t in 0..lists.n_tiles() {
            let (tx, ty) = (t % lists.grid[0] * TILE_PX, t / lists.grid[0] * TILE_PX);
            let entries = lists.tile(t);
            for pair in entries.windows(2) {
                let key = |s: u32| (footprints[s as usize].depth, s);
                assert!(key(pair[0]) < key(pair[1]), "tile {t} out of order");
            }
            for s in 0..n {
                let covers = (tx..(tx + TILE_PX).min(size[0]))
                    .any(|px| (px as f64 + 0.5 - splats[s].mean_px[0]).abs() <= footprints[s].half_extent_px[0])
                    && (ty..(ty + TILE_PX).min(size[1]))
                        .any(|py| (py as f64 + 0.5 - splats[s].mean_px[1]).abs() <= footprints[s].half_extent_px[1]);
                let listed = entries.contains(&u32::try_from(s).expect("small"));
                assert!(!covers || listed, "splat {s} missing from tile {t}");
            }
        }
        for s in 0..n {
            for slot in lists.slots_of(s) {
                assert_eq!(lists.entries[*slot as usize] as usize, s);
            }
        }
        assert_eq!(lists.slots.len(), lists.entries.len());
    }
}
