//! Where splats lie, noted in a frame's first pass, so that later passes leave out chunks that they draw nothing of, and know in advance
//! where their slabs end.

use core::ops::{Range, RangeInclusive};

use bytemuck::{Pod, Zeroable};

use super::strip::Strip;

/// Whether a frame drawn in slabs has notes of its chunks, in the last places of its splats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Notes {
    /// Nothing is noted.
    None,
    /// The next pass takes them. It goes over the whole scene.
    Due,
    /// Every chunk has one.
    Taken,
}

/// Which strips each of the first chunks has splats in, of a frame whose splats leave no place for notes: as many as 256 bytes hold.
#[derive(Clone, Copy, Debug)]
pub(super) struct StripsOfChunks([u8; 256]);

impl StripsOfChunks {
    /// No splats.
    pub(super) const NONE: Self = Self([0; 256]);

    /// Takes in a splat.
    pub(super) fn add(&mut self, chunk: u32, strips: RangeInclusive<usize>) {
        if let Some(noted) = self.0.get_mut(chunk as usize) {
            *noted |= bits(*strips.start() as u32, *strips.end() as u32) as u8;
        }
    }

    /// Whether a chunk may have a splat in a strip, or in one of several.
    pub(super) fn may_lie_in(&self, chunk: u32, strip: Strip) -> bool {
        self.0.get(chunk as usize).is_none_or(|&noted| u32::from(noted) & bits_of(strip) != 0)
    }
}

/// Where the splats of a chunk lie.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct ChunkNote {
    /// The upper half of the bits of the least depth: a depth that is no larger.
    nearest: u16,
    /// That of a depth larger than all of them.
    end: u16,
    /// Bit i is set when one touches strip i; a frame has 8 at most.
    strips: u32,
}

impl ChunkNote {
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
        self.strips |= bits(*strips.start() as u32, *strips.end() as u32);
    }

    /// Whether a splat of the chunk may lie at these depths of a strip; true more often than needed, never false wrongly.
    pub(super) fn may_lie_in(&self, strip: Strip, depths: Range<f32>) -> bool {
        let depth = |upper: u16| f32::from_bits(u32::from(upper) << 16);
        self.strips & bits_of(strip) != 0 && depths.start < depth(self.end) && depth(self.nearest) < depths.end
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

/// The bits of a strip, or of several.
fn bits_of(strip: Strip) -> u32 {
    bits(strip.index.into(), strip.end_index.saturating_sub(1).into())
}

/// The bits from `first` to `last`, which are below 31.
fn bits(first: u32, last: u32) -> u32 {
    2_u32.wrapping_shl(last).wrapping_sub(1_u32.wrapping_shl(first))
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::{ChunkNote, DepthCounts, Strip, StripsOfChunks, bits};

    fn strip(index: u8) -> Strip {
        Strip { index, end_index: index + 1, first_row: index.into(), end_row: u16::from(index) + 1 }
    }

    #[test]
    fn a_note_says_where_splats_may_lie() {
        let mut note = ChunkNote::NOWHERE;
        let behind = |from: f32| from..f32::INFINITY;
        assert!((0..8).all(|index| !note.may_lie_in(strip(index), behind(0.0))), "no splat");
        note.add(3.3, 2..=3);
        note.add(1.7, 5..=5);
        let seen: std::vec::Vec<u8> = (0..8).filter(|&i| note.may_lie_in(strip(i), behind(0.0))).collect();
        assert_eq!(seen, [2, 3, 5], "the strips of either");
        assert!(note.may_lie_in(strip(2), behind(3.3)), "the farthest lies where the slab begins");
        assert!(!note.may_lie_in(strip(2), behind(3.4)), "both are nearer");
        assert!(!note.may_lie_in(strip(2), 0.2..1.6), "both are farther");
        assert!(note.may_lie_in(strip(2), 0.2..1.71), "the nearest lies before the end");
        assert_eq!((bits(0, 7), bits(3, 3)), (0xFF, 8), "first and last are among them");
    }

    #[test]
    fn chunks_without_a_note_may_lie_anywhere() {
        let mut chunks = StripsOfChunks::NONE;
        chunks.add(7, 1..=2);
        chunks.add(256, 1..=2);
        let several = Strip { end_index: 8, ..strip(2) };
        let found = [(6, strip(1)), (7, strip(1)), (7, strip(3)), (7, several), (256, strip(3))];
        let found = found.map(|(chunk, strip)| chunks.may_lie_in(chunk, strip));
        assert_eq!(found, [false, true, false, true, true], "of nothing, of itself, of another, of both, unknown");
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
