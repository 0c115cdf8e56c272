//! Which splats each tile draws, in which order.

use std::sync::atomic::{AtomicU32, Ordering};

use pocketsplat_format::rules;
use rayon::prelude::*;

use super::depth_order::by_depth;
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
fn tile_rectangle<R: Real>(splat: &Splat<R>, footprint: &Footprint<R>, size_px: [usize; 2]) -> [u16; 4] {
    let mut rectangle = [0; 4];
    for i in 0..2 {
        let centre: f64 = splat.mean_px[i].into();
        let half: f64 = footprint.half_extent_px[i].into();
        // Pixel p has its centre at p + ½. One part in 10⁵ of slack, because the rasteriser compares alpha, not distance.
        let slack = 1e-5 * half + 1e-4;
        // What begins beyond the last tile is in none.
        let (size, beyond) = (size_px[i] as f64, size_px[i].next_multiple_of(TILE_PX) as f64);
        let low = (centre - half - slack - 0.5).larger(0.0).smaller(beyond);
        let high = (centre + half + slack - 0.5).larger(-1.0).smaller(size - 1.0);
        // The first pixel from `low` on, and the one after the last up to `high`; truncation is floor for what is not negative.
        #[expect(clippy::cast_possible_truncation, reason = "both lie within the tiles")]
        let (below, end) = (low as i32, (high + 1.0) as i32);
        let first = below + i32::from(f64::from(below) < low);
        let tile = |pixel: i32| u16::try_from(pixel / TILE_PX as i32).expect("a frame has fewer than 2¹⁶ tiles a side");
        rectangle[2 * i] = tile(first);
        rectangle[2 * i + 1] = tile(end + TILE_PX as i32 - 1).max(rectangle[2 * i]);
    }
    rectangle
}

/// Sorts the splats by depth and lists them per tile.
///
/// Order: depth ascending, ties by splat index, that is by anchor and offset. Cost: one sort of n splats, and on all threads two passes over
/// the (tile, splat) pairs.
pub fn build<R: Real>(splats: &[Splat<R>], footprints: &[Footprint<R>], size_px: [usize; 2]) -> TileLists {
    let mut lists = TileLists::default();
    build_into(&mut lists, splats, footprints, size_px);
    lists
}

/// [`build`] into lists that are there.
pub fn build_into<R: Real>(
    lists: &mut TileLists,
    splats: &[Splat<R>],
    footprints: &[Footprint<R>],
    size_px: [usize; 2],
) {
    let grid = size_px.map(|s| s.div_ceil(TILE_PX));
    let rectangles: Vec<[u16; 4]> = splats
        .par_iter()
        .zip(footprints)
        .with_min_len(MIN_SPLATS)
        .map(|(s, f)| tile_rectangle(s, f, size_px))
        .collect();
    #[expect(clippy::cast_possible_truncation, reason = "the sort key is the f32 depth on purpose")]
    let order = by_depth(footprints.iter().map(|f| Into::<f64>::into(f.depth) as f32));

    let TileLists { starts, entries, slot_starts, slots, .. } = lists;
    slot_starts.clear();
    slot_starts.push(0);
    let mut n_pairs = 0u32;
    slot_starts.extend(rectangles.iter().map(|[x0, x1, y0, y1]| {
        n_pairs += u32::from(x1 - x0) * u32::from(y1 - y0);
        n_pairs
    }));
    let n_tiles = grid[0] * grid[1];
    let tiles_of = |splat: u32| {
        let [x0, x1, y0, y1] = rectangles[splat as usize].map(usize::from);
        (y0..y1).map(move |y| y * grid[0] + x0..y * grid[0] + x1)
    };
    // How many splats of each part lie in each tile; then where those of the part begin.
    let mut firsts: Vec<Vec<u32>> = order
        .par_chunks(PART)
        .map(|part| {
            let mut counts = vec![0; n_tiles];
            for tiles in part.iter().flat_map(|splat| tiles_of(*splat)) {
                counts[tiles].iter_mut().for_each(|count| *count += 1);
            }
            counts
        })
        .collect();
    starts.clear();
    let mut before = 0;
    for tile in 0..n_tiles {
        starts.push(before);
        for first in &mut firsts {
            before += std::mem::replace(&mut first[tile], before);
        }
    }
    starts.push(before);
    // What the parts write lies apart, but not one after the other; both ways the same memory serves, and every place is written over.
    let [listed, placed] = [&mut *entries, &mut *slots].map(|values| {
        let mut shared: Vec<AtomicU32> = std::mem::take(values).into_iter().map(AtomicU32::new).collect();
        shared.resize_with(n_pairs as usize, AtomicU32::default);
        shared
    });
    order.par_chunks(PART).zip(&mut firsts).for_each(|(part, next)| {
        for splat in part {
            let mut slot = slot_starts[*splat as usize] as usize;
            for tiles in tiles_of(*splat) {
                for at in &mut next[tiles] {
                    listed[*at as usize].store(*splat, Ordering::Relaxed);
                    placed[slot].store(*at, Ordering::Relaxed);
                    *at += 1;
                    slot += 1;
                }
            }
        }
    });
    [*entries, *slots] = [listed, placed].map(|values| values.into_iter().map(AtomicU32::into_inner).collect());
    lists.grid = grid;
}

/// Splats that one task takes at least.
const MIN_SPLATS: usize = 1024;

/// Splats, by depth, that one task lists.
const PART: usize = 8192;

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
    fn lists_of_many_parts_are_those_of_one() {
        let (size, n) = ([70, 50], 2 * PART + 100);
        let x = random(5, n * 3);
        let (splats, footprints): (Vec<_>, Vec<_>) = x
            .chunks_exact(3)
            .map(|v| {
                let splat = Splat { mean_px: [35.0 + 40.0 * v[0], 25.0 + 30.0 * v[1]], ..Splat::default() };
                // A coarse depth, so that there are ties across parts.
                (splat, Footprint { depth: 1.0 + (v[2] * 4.0).abs().floor(), half_extent_px: [2.0; 2] })
            })
            .unzip();
        let lists = build(&splats, &footprints, size);
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| footprints[*a].depth.total_cmp(&footprints[*b].depth));
        for t in 0..lists.n_tiles() {
            let covers = |s: &usize| {
                let [x0, x1, y0, y1] = tile_rectangle(&splats[*s], &footprints[*s], size).map(usize::from);
                (x0..x1).contains(&(t % lists.grid[0])) && (y0..y1).contains(&(t / lists.grid[0]))
            };
            let expected: Vec<u32> =
                order.iter().copied().filter(covers).map(|s| u32::try_from(s).expect("small")).collect();
            assert!(expected.len() > 100, "tile {t} shows little");
            assert_eq!(lists.tile(t), expected, "tile {t}");
        }
        for s in 0..n {
            assert!(lists.slots_of(s).iter().all(|slot| lists.entries[*slot as usize] as usize == s));
        }
    }

    #[test]
    fn every_tile_lists_what_reaches_it_nearest_first() {
        let size = [70, 50];
        let n = 200;
        let x = random(3, n * 5);
        let (splats, footprints): (Vec<_>, Vec<_>) = x
            .chunks_exact(5)
            .map(|v| {
                let splat = Splat { mean_px: [35.0 + 65.0 * v[0], 25.0 + 55.0 * v[1]], ..Splat::default() };
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
                let is_near = [tx, ty].iter().enumerate().all(|(i, start)| {
                    let (mean, reach) = (splats[s].mean_px[i], footprints[s].half_extent_px[i] + 1.0);
                    mean + reach >= *start as f64 && mean - reach <= (start + TILE_PX) as f64
                });
                assert!(is_near || !listed, "splat {s} is far from tile {t}");
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
