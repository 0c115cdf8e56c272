//! The splats in memory, and their order.

use core::ops::RangeInclusive;

use pocketsplat_format::saturate;

use super::slab_index::{ChunkExtent, DepthCounts};
use super::strip::Strip;
use crate::project::{PackedSplat, Splat, TileRect};
use crate::raster::{DIGITS, order_by_digit};

/// Model instructions of sorting a splat, and of going over one to let go of some.
const SORT: u32 = 130;
const LET_GO: u32 = 30;

/// The splats of the current strip, or of a slab of its depth, in the order of the file.
pub(super) struct SplatStore<'s> {
    pub(super) splats: &'s mut [PackedSplat],
    pub(super) rects: &'s mut [TileRect],
    pub(super) n: u32,
    /// The most that there were in this pass, before it let go of some.
    pub(super) most: u32,
    /// The depth of all splats, where there is no place left and they have but one.
    pub(super) full_at: Option<f32>,
    /// Model instructions of making room, which no report has.
    pub(super) work: u64,
    /// Chunks in the index, and the last places, which the index takes.
    pub(super) n_indexed: u32,
    pub(super) places_of_index: u32,
    pub(super) order: &'s mut [u32],
    pub(super) spare: &'s mut [u32],
    pub(super) counts: &'s mut [u32],
    /// Of two painters: where the splats of each chunk end, 0 for none; empty where there is one painter.
    pub(super) ends: &'s mut [u32],
}

/// A slab of depth: what lies at its beginning or behind it, and before its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slab {
    pub(super) from: f32,
    pub(super) end: f32,
    /// Splats in it that have no place, because too many lie at exactly one depth; and that depth.
    pub(super) n_left_out: u32,
    pub(super) left_out_at: f32,
}

impl Slab {
    /// Everything from a depth on.
    pub(super) const fn behind(from: f32) -> Self {
        Self { from, end: f32::INFINITY, n_left_out: 0, left_out_at: 0.0 }
    }

    /// Whether something is left behind it.
    pub(super) fn ends(&self) -> bool {
        self.end < f32::INFINITY
    }
}

impl<'s> SplatStore<'s> {
    /// No splats yet; as many places as there are `splats`, and one entry of `rects`, `order` and `spare` for each.
    ///
    /// * `counts`: [`N_RADIX`](crate::raster::N_RADIX) entries.
    #[inline(always)]
    pub(super) fn new(
        splats: &'s mut [PackedSplat],
        rects: &'s mut [TileRect],
        [order, spare, ends]: [&'s mut [u32]; 3],
        counts: &'s mut [u32],
    ) -> Self {
        let (n, most, n_indexed, places_of_index) = (0, 0, 0, 0);
        Self { splats, rects, n, most, full_at: None, work: 0, n_indexed, places_of_index, order, spare, counts, ends }
    }

    /// Splats that there is memory for.
    pub(super) fn places(&self) -> u32 {
        saturate(self.splats.len()).saturating_sub(self.places_of_index)
    }

    /// Makes room for an index of so many chunks, without any splat, where that takes few places; returns whether it did.
    // Not inlined, here and below: few calls, or next to much else.
    #[inline(never)]
    pub(super) fn begin_index(&mut self, n_chunks: u32) -> bool {
        let len = (n_chunks as usize).saturating_mul(size_of::<ChunkExtent>()).saturating_add(size_of::<DepthCounts>());
        let places = len.div_ceil(size_of::<PackedSplat>());
        if places > self.splats.len() / 4 {
            return false;
        }
        (self.n_indexed, self.places_of_index) = (n_chunks, saturate(places));
        let Some((counts, extents)) = self.index() else { return false };
        counts.clear();
        extents.fill(ChunkExtent::NOWHERE);
        true
    }

    /// Takes a splat of a chunk into the index.
    #[inline(never)]
    pub(super) fn add_to_index(&mut self, chunk: u32, depth: f32, strips: RangeInclusive<usize>) {
        let Some((counts, extents)) = self.index() else { return };
        counts.add(depth, strips.clone());
        if let Some(extent) = extents.get_mut(chunk as usize) {
            extent.add(depth, strips);
        }
    }

    /// Whether a chunk may have a splat in a slab of a strip.
    #[inline(never)]
    pub(super) fn may_lie_in(&mut self, chunk: u32, strip: Strip, slab: &Slab) -> bool {
        let extent = self.index().and_then(|(_, extents)| extents.get(chunk as usize));
        extent.is_none_or(|extent| extent.may_lie_in(strip, slab.from..slab.end))
    }

    /// Where a slab of a strip from depth `from` on ends, so that there is a place for each of its splats.
    #[inline(never)]
    pub(super) fn end_of_slab(&mut self, strip: Strip, from: f32) -> f32 {
        let places = self.places();
        self.index().map_or(f32::INFINITY, |(counts, _)| counts.end_of_slab(strip, from, places))
    }

    /// How many splats there are at which depth, and `[n_chunks]` extents; where there are such.
    #[inline(never)]
    fn index(&mut self) -> Option<(&mut DepthCounts, &mut [ChunkExtent])> {
        let places = self.places() as usize;
        let words: &mut [u32] = bytemuck::try_cast_slice_mut(self.splats.get_mut(places..)?).ok()?;
        let (counts, words) = words.split_at_mut_checked(size_of::<DepthCounts>() / size_of::<u32>())?;
        let extents =
            words.get_mut(..(self.n_indexed as usize).checked_mul(size_of::<ChunkExtent>() / size_of::<u32>())?)?;
        let counts: &mut [DepthCounts] = bytemuck::try_cast_slice_mut(counts).ok()?;
        Some((counts.first_mut()?, bytemuck::try_cast_slice_mut(extents).ok()?))
    }

    /// Notes where the splats of a chunk end, for another painter.
    pub(super) fn end_chunk(&mut self, chunk: u32) {
        if let Some(end) = self.ends.get_mut(chunk as usize) {
            *end = self.n;
        }
    }

    /// Keeps a splat; the caller has counted that there is a place.
    pub(super) fn push(&mut self, splat: &Splat, rect: TileRect) {
        let slot = self.n as usize;
        if let (Some(splat_slot), Some(rect_slot)) = (self.splats.get_mut(slot), self.rects.get_mut(slot)) {
            *splat_slot = PackedSplat::new(splat);
            *rect_slot = rect;
            self.n = self.n.saturating_add(1);
        }
    }

    /// Keeps a splat of finite depth if it lies in `slab`; when there is no place, the slab ends earlier, and what lies behind its end then
    /// makes room: about the farthest eighth.
    ///
    /// # Budget
    /// When there is no place a sort, which as a rule an eighth of the places pay for: a slab less saves far more. None where all lie at
    /// one depth.
    pub(super) fn push_into(&mut self, slab: &mut Slab, splat: &Splat, rect: TileRect) {
        let lies_in = |slab: &Slab| slab.from <= splat.depth && splat.depth < slab.end;
        if !lies_in(slab) {
            return;
        }
        if self.n >= self.places() {
            match self.earlier_end(splat.depth) {
                Some(end) => self.end_slab(slab, end),
                None => {
                    slab.n_left_out = slab.n_left_out.saturating_add(1);
                    slab.left_out_at = splat.depth;
                    return;
                }
            }
            if !lies_in(slab) {
                return;
            }
        }
        self.push(splat, rect);
    }

    /// Puts the indices of the splats into the `order` of one of the [`DIGITS`] of their depths; after the last the nearest is first.
    pub(super) fn order_by(&mut self, shift: u32) {
        let n = self.n as usize;
        let (Some(splats), Some(order)) = (self.splats.get(..n), self.order.get_mut(..n)) else { return };
        let Some(spare) = self.spare.get_mut(..n) else { return };
        if order_by_digit(splats, order, spare, self.counts, shift) {
            core::mem::swap(&mut self.order, &mut self.spare);
        }
    }

    /// A depth before which some of the splats in memory and one more at `depth` lie, and some not; `None` if all lie at one.
    // Not inlined, here and below: rare, in the middle of a loop that is not.
    #[inline(never)]
    fn earlier_end(&mut self, depth: f32) -> Option<f32> {
        if let Some(at) = self.full_at {
            return if depth == at { None } else { Some(if depth > at { depth } else { at }) };
        }
        DIGITS.into_iter().for_each(|shift| self.order_by(shift));
        self.work = self.work.saturating_add(u64::from(self.n) * u64::from(SORT));
        let n = self.n as usize;
        let (splats, order) = (self.splats.get(..n)?, self.order.get(..n)?);
        let depth_of = |index: &u32| splats.get(*index as usize).map_or(0.0, PackedSplat::depth);
        let nearest = order.first().map_or(depth, depth_of);
        self.full_at = order.last().map(depth_of).filter(|farthest| *farthest == nearest);
        let nearest = if depth < nearest { depth } else { nearest };
        let mut later = order.get(n - n.div_ceil(8)..).unwrap_or_default().iter().map(depth_of);
        later.find(|&end| end > nearest).or((depth > nearest).then_some(depth))
    }

    /// Lets go of what does not lie before `end`.
    #[inline(never)]
    fn end_slab(&mut self, slab: &mut Slab, end: f32) {
        slab.end = end;
        if end <= slab.left_out_at {
            slab.n_left_out = 0;
        }
        self.retain(|splat, _| splat.depth() < end);
    }

    /// Lets go of what does not begin above a row of tiles.
    #[inline(never)]
    pub(super) fn end_above(&mut self, row: u16) {
        self.retain(|_, rect| u16::from(rect.first_row) < row);
    }

    /// Keeps some of the splats, in their order.
    fn retain(&mut self, keeps: impl Fn(&PackedSplat, &TileRect) -> bool) {
        self.most = self.most.max(self.n);
        self.work = self.work.saturating_add(u64::from(self.n) * u64::from(LET_GO));
        let mut n_kept = 0;
        for i in 0..self.n as usize {
            let Some((before, [splat, ..])) = self.splats.split_at_mut_checked(i) else { break };
            let Some(&rect) = self.rects.get(i) else { break };
            if keeps(splat, &rect) {
                // Swapped: to copy within a slice would link a routine of 1.6 KB, for parts that overlap.
                if let Some(slot) = before.get_mut(n_kept) {
                    core::mem::swap(slot, splat);
                }
                if let Some(slot) = self.rects.get_mut(n_kept) {
                    *slot = rect;
                }
                n_kept += 1;
            }
        }
        if n_kept as u32 != self.n {
            (self.n, self.full_at) = (n_kept as u32, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use bytemuck::Zeroable;

    use super::{LET_GO, SORT, Slab, SplatStore};
    use crate::project::{PackedSplat, Splat, TileRect};
    use crate::raster::N_RADIX;

    const RECT: TileRect = TileRect { first_column: 0, last_column: 0, first_row: 0, last_row: 0 };

    fn splat(depth: f32) -> Splat {
        Splat {
            mean: [0.0; 2],
            shear: 0.0,
            row_precision: 1.0,
            column_precision: 1.0,
            log_opacity: 0.0,
            colour: [0.0; 3],
            depth,
        }
    }

    /// The depths that each slab draws, with places for `n_places`, and how many found no room.
    fn slabs(depths: &[f32], n_places: usize) -> (Vec<Vec<f32>>, u32) {
        let (mut slabs, mut n_dropped, mut from) = (Vec::new(), 0, 0.0);
        loop {
            let mut splats = std::vec![PackedSplat::zeroed(); n_places];
            let (mut rects, mut order, mut spare) =
                (std::vec![RECT; n_places], std::vec![0; n_places], std::vec![0; n_places]);
            let mut counts = [0; N_RADIX];
            let mut store = SplatStore::new(&mut splats, &mut rects, [&mut order, &mut spare, &mut []], &mut counts);
            let mut slab = Slab::behind(from);
            for &depth in depths {
                store.push_into(&mut slab, &splat(depth), RECT);
            }
            n_dropped += slab.n_left_out;
            if slab.ends() {
                assert_eq!(store.most as usize, n_places, "it was full when it let go of some");
            }
            slabs.push(store.splats.iter().take(store.n as usize).map(PackedSplat::depth).collect());
            if !slab.ends() {
                return (slabs, n_dropped);
            }
            from = slab.end;
        }
    }

    #[test]
    fn slabs_hold_every_splat_once_from_near_to_far() {
        let mut state = 7_u32;
        let depths: Vec<f32> = (0..500)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                0.2 + (state >> 25) as f32 * 0.125
            })
            .collect();
        let mut sorted = depths.clone();
        sorted.sort_by(f32::total_cmp);
        for n_places in [16, 40, 499, 500] {
            let (slabs, n_dropped) = slabs(&depths, n_places);
            assert_eq!(n_dropped, 0, "{n_places} places, at most 13 splats at one depth");
            for pair in slabs.windows(2) {
                let [near, far] = pair else { unreachable!("pairs") };
                let (farthest, nearest) =
                    (near.iter().copied().fold(0.0, f32::max), far.iter().copied().fold(99.0, f32::min));
                assert!(farthest < nearest, "{farthest} before {nearest}");
            }
            let mut drawn = slabs.concat();
            drawn.sort_by(f32::total_cmp);
            assert_eq!(drawn, sorted, "{n_places} places");
        }
    }

    #[test]
    fn slabs_hold_the_farthest_depth_that_there_is() {
        let (slabs, n_dropped) = slabs(&[f32::MAX, 2.0, 1.0], 2);
        assert_eq!((slabs, n_dropped), (std::vec![std::vec![2.0, 1.0], std::vec![f32::MAX]], 0));
    }

    /// Else each of the many that find no place would sort all that have one.
    #[test]
    fn splats_at_one_depth_are_sorted_once() {
        const N: usize = 40;
        let (mut splats, mut rects, mut counts) = ([PackedSplat::zeroed(); N], [RECT; N], [0; N_RADIX]);
        let (mut order, mut spare) = ([0; N], [0; N]);
        let mut store = SplatStore::new(&mut splats, &mut rects, [&mut order, &mut spare, &mut []], &mut counts);
        let mut slab = Slab::behind(0.0);
        (0..1000).for_each(|_| store.push_into(&mut slab, &splat(2.0), RECT));
        assert_eq!((store.work, slab.n_left_out), (u64::from(SORT) * N as u64, 960), "one sort");
        // What lies farther ends the slab, each time nearer, and makes no place.
        (0..100).for_each(|i| store.push_into(&mut slab, &splat(4.0 - 0.01 * i as f32), RECT));
        assert!((slab.end - 3.01).abs() < 1e-6 && store.n == 40, "{slab:?}");
        assert!(store.work <= u64::from(SORT + 101 * LET_GO) * N as u64, "no sort more: {}", store.work);
        store.push_into(&mut slab, &splat(1.0), RECT);
        assert_eq!((slab.end, store.n, slab.n_left_out), (2.0, 1, 0), "those behind a nearer one let go");
    }

    #[test]
    fn splats_at_one_depth_that_have_no_room_are_said() {
        let depths = [3.0, 2.0, 2.0, 2.0, 1.0, 2.0, 4.0];
        let (slabs, n_dropped) = slabs(&depths, 2);
        assert_eq!((slabs.concat(), n_dropped), (std::vec![1.0, 2.0, 2.0, 3.0, 4.0], 2), "two of the four at 2");
    }
}
