//! Which splats of a frame there is memory for, the same for all of its strips.

use core::ops::RangeInclusive;

use crate::budget::Budget;

/// Counts the splats of all strips in the order of the file, until one strip is full.
///
/// The first splat that some strip has no place for, and all after it, are left out of all strips: so what is drawn does
/// not depend on which strip is drawn, and the tiers that come first in the file are the last to suffer.
#[derive(Clone, Copy, Debug)]
pub(super) struct FirstCome {
    /// Splats that a strip has places for.
    capacity: u32,
    /// Splats of each strip, those left out included.
    demand: [u32; Budget::MAX_STRIPS as usize],
    /// The order of the first splat left out.
    end: u32,
    n_dropped: u32,
}

/// A number that ascends with the splats in the order of the file.
pub(super) fn splat_order(anchor: u32, offset: usize) -> u32 {
    // 2²⁴ anchors of 32 offsets.
    anchor << 5 | (offset as u32 & 31)
}

impl FirstCome {
    /// Everything has a place so far.
    pub(super) fn new(capacity: u32) -> Self {
        Self { capacity, demand: [0; Budget::MAX_STRIPS as usize], end: u32::MAX, n_dropped: 0 }
    }

    /// Counts a splat that lies in `strips`, and says whether it is drawn; orders ascend from call to call.
    pub(super) fn admit(&mut self, order: u32, strips: RangeInclusive<usize>) -> bool {
        let mut fits = self.admits(order);
        for demand in self.demand.get_mut(strips).unwrap_or_default() {
            fits &= *demand < self.capacity;
            *demand = demand.saturating_add(1);
        }
        if !fits {
            self.end = self.end.min(order);
            self.n_dropped = self.n_dropped.saturating_add(1);
        }
        fits
    }

    /// Whether a splat counted before is drawn.
    pub(super) fn admits(&self, order: u32) -> bool {
        order < self.end
    }

    /// The strips from number `first` on that there is memory for together, once all splats are counted; at least one.
    pub(super) fn end_of_those_with_room(&self, first: u8) -> u8 {
        let mut n_left = self.capacity;
        let rest = self.demand.get(first.into()..).unwrap_or_default();
        let fitting = rest.iter().take_while(|&&demand| {
            let fits = demand <= n_left;
            n_left = n_left.saturating_sub(demand);
            fits
        });
        first + fitting.count().max(1) as u8
    }

    /// Splats left out.
    pub(super) fn n_dropped(&self) -> u32 {
        self.n_dropped
    }

    /// Splats of the fullest strip, those left out included.
    pub(super) fn max_demand(&self) -> u32 {
        self.demand.into_iter().max().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::{FirstCome, splat_order};

    #[test]
    fn what_comes_after_the_first_without_a_place_is_left_out_everywhere() {
        let mut first_come = FirstCome::new(2);
        let splats = [(1, 0..=0), (2, 0..=1), (3, 1..=1), (4, 1..=2), (5, 2..=2)];
        let drawn = splats.map(|(anchor, strips)| first_come.admit(splat_order(anchor, 0), strips));
        assert_eq!(drawn, [true, true, true, false, false], "strip 1 is full at the fourth");
        assert_eq!(
            (first_come.n_dropped(), first_come.max_demand()),
            (2, 3),
            "the fourth and the fifth; strip 1 would have three"
        );
    }

    #[test]
    fn splats_are_ordered_by_anchors_then_offsets() {
        assert!(splat_order(0, 31) < splat_order(1, 0) && splat_order(1, 0) < splat_order(1, 1), "anchor first");
        assert!(splat_order((1 << 24) - 1, 31) < u32::MAX, "the last splat there can be");
    }
}
