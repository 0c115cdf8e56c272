//! Where splats lie, noted in the first pass of a frame drawn in slabs, so that later passes leave out chunks that they draw nothing of,
//! and know in advance where their slabs end.

use core::ops::{Range, RangeInclusive};

use bytemuck::{Pod, Zeroable};

use super::strip::{Strip, strip_bits};

/// Whether a frame drawn in slabs has an index of its chunks, in the last places of its splats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum IndexState {
    /// There is none.
    None,
    /// The next pass makes it. It goes over the whole scene.
    Due,
    /// Every chunk is in it.
    Made,
}

/// Where the splats of a chunk lie.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct ChunkExtent {
    /// The upper half of the bits of the least depth: a depth that is no larger.
    nearest: u16,
    /// That of a depth larger than all of them.
    end: u16,
    /// Bit i is set when one touches strip i; a frame has 8 at most.
    strips: u32,
}

impl ChunkExtent {
    /// That of a chunk without splats.
    pub(super) const NOWHERE: Self = Self { nearest: u16::MAX, end: 0, strips: 0 };

    /// Takes in a splat.
    ///
    /// * `depth`: positive.
    pub(super) fn add(&mut self, depth: f32, strips: RangeInclusive<usize>) {
        // The bits of positive floats ascend as they do.
        let upper = (depth.to_bits() >> 16) as u16;
        self.nearest = self.nearest.min(upper);
        self.end = self.end.max(upper.saturating_add(1));
        self.strips |= strip_bits(strips);
    }

    /// Whether a splat of the chunk may lie at these depths of a strip; true more often than needed, never false wrongly.
    pub(super) fn may_lie_in(&self, strip: Strip, depths: Range<f32>) -> bool {
        let depth = |upper: u16| f32::from_bits(u32::from(upper) << 16);
        self.strips & strip.bits() != 0 && depths.start < depth(self.end) && depth(self.nearest) < depths.end
    }
}

/// How many splats of each strip lie in each interval of depth.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct DepthCounts {
    /// `[strip][interval]`, an interval in the place of its number, as a remainder: one shares it with those of four times its depth.
    counts: [[u16; N_INTERVALS as usize]; N_STRIPS],
    nearest: u32,
    farthest: u32,
}

/// Most strips of a frame.
const N_STRIPS: usize = 8;
/// Intervals that have a count.
const N_INTERVALS: u32 = 128;
/// A factor of two has 64 of them.
const INTERVAL_BITS: u32 = 23 - 6;

impl DepthCounts {
    /// Forgets all splats.
    // A constant of this size would lie in flash.
    pub(super) fn clear(&mut self) {
        self.counts.as_flattened_mut().fill(0);
        (self.nearest, self.farthest) = (u32::MAX, 0);
    }

    /// Takes in a splat.
    ///
    /// * `depth`: positive.
    pub(super) fn add(&mut self, depth: f32, strips: RangeInclusive<usize>) {
        let interval = depth.to_bits() >> INTERVAL_BITS;
        self.nearest = self.nearest.min(interval);
        self.farthest = self.farthest.max(interval);
        for counts in self.counts.get_mut(strips).unwrap_or_default() {
            if let Some(count) = counts.get_mut((interval % N_INTERVALS) as usize) {
                *count = count.saturating_add(1);
            }
        }
    }

    /// Where a slab of a strip from depth `from` on ends, so that there is a place for each of its splats; infinite where that is
    /// all of the rest. An interval that has more is a slab by itself.
    pub(super) fn end_of_slab(&self, strip: Strip, from: f32, places: u32) -> f32 {
        let Some(counts) = self.counts.get(usize::from(strip.index)) else { return f32::INFINITY };
        let first = (from.to_bits() >> INTERVAL_BITS).max(self.nearest);
        let mut n_splats = 0_u32;
        for (interval, _) in (first..=self.farthest).zip(0..N_INTERVALS) {
            let count = counts.get((interval % N_INTERVALS) as usize).copied().unwrap_or_default();
            n_splats = n_splats.saturating_add(count.into());
            if n_splats > places {
                let end = interval.max(first.saturating_add(1));
                let is_all = end > self.farthest;
                return if is_all { f32::INFINITY } else { f32::from_bits(end << INTERVAL_BITS) };
            }
        }
        f32::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::{ChunkExtent, DepthCounts, Strip};

    fn strip(index: u8) -> Strip {
        Strip { index, end_index: index + 1, first_row: index.into(), end_row: u16::from(index) + 1 }
    }

    #[test]
    fn an_extent_says_where_splats_may_lie() {
        let mut extent = ChunkExtent::NOWHERE;
        let behind = |from: f32| from..f32::INFINITY;
        assert!((0..8).all(|index| !extent.may_lie_in(strip(index), behind(0.0))), "no splat");
        extent.add(3.3, 2..=3);
        extent.add(1.7, 5..=5);
        let seen: std::vec::Vec<u8> = (0..8).filter(|&i| extent.may_lie_in(strip(i), behind(0.0))).collect();
        assert_eq!(seen, [2, 3, 5], "the strips of either");
        assert!(extent.may_lie_in(strip(2), behind(3.3)), "the farthest lies where the slab begins");
        assert!(!extent.may_lie_in(strip(2), behind(3.4)), "both are nearer");
        assert!(!extent.may_lie_in(strip(2), 0.2..1.6), "both are farther");
        assert!(extent.may_lie_in(strip(2), 0.2..1.71), "the nearest lies before the end");
    }

    #[test]
    fn slabs_end_where_their_splats_have_places() {
        let mut counts = DepthCounts::zeroed();
        counts.clear();
        assert_eq!(counts.end_of_slab(strip(0), 0.0, 1), f32::INFINITY, "no splat");
        let depths: std::vec::Vec<f32> = (0..200).map(|i| 2.0 + 0.02 * i as f32).collect();
        depths.iter().for_each(|&depth| counts.add(depth, 1..=2));
        assert_eq!(counts.end_of_slab(strip(0), 0.0, 1), f32::INFINITY, "another strip");
        assert_eq!(counts.end_of_slab(strip(1), 0.0, 200), f32::INFINITY, "places for all");
        let (mut from, mut n_drawn) = (0.0, 0);
        while from < f32::INFINITY {
            let end = counts.end_of_slab(strip(2), from, 30);
            let n = depths.iter().filter(|&&depth| from <= depth && depth < end).count();
            assert!(n <= 30 && (n >= 20 || end == f32::INFINITY), "{n} from {from} to {end}");
            (from, n_drawn) = (end, n_drawn + n);
        }
        assert_eq!(n_drawn, 200, "every splat in one slab");
        (0..50).for_each(|_| counts.add(2.0, 1..=1));
        assert_eq!(counts.end_of_slab(strip(1), 0.0, 30), 2.03125, "an interval with too many");
    }
}
