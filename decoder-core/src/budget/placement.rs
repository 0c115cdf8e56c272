//! Which parts of the scratch memory lie in fast memory, and which in slow.

use pocketsplat_format::Region;

use crate::arena::Arena;

/// A part of the scratch memory that lies in one piece; those whose bytes a frame touches most often come first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Part {
    /// Weights of the heads, and the current anchor: all of it for each anchor in view.
    Heads,
    /// What the models of the symbols work in: all of it for each anchor that is decoded.
    Models,
    /// The pixels of the current tile, or of a strip in slabs: some of it for each splat of a tile.
    Tiles,
    /// Order and tiles of the splats, 12 bytes each: several times when they are sorted, then once for each tile of their strip.
    Lists,
    /// The splats, 28 bytes each: once for each tile that they touch.
    Splats,
    /// Anchors, with their sums, or Gaussians in memory: once for each strip.
    Scene,
    /// What the second of [two painters](crate::Budget::with_two_painters) has of its own: the current anchor, a context's numbers, tiles, lists
    /// and splats; it lies where the first one's [splats](Self::Splats) lie. Heads, tables and the scene it reads where the first does.
    SecondPainter,
}

/// Where one part of the scratch memory lies, and how many bytes it takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct PartMemory {
    /// Which part.
    pub part: Part,
    /// Where.
    pub region: Region,
    /// Bytes while frames are drawn; what binding alone needs lies where the frame's memory lies later.
    pub n_bytes: usize,
}

impl Part {
    /// All, in this order.
    pub const ALL: [Self; 7] =
        [Self::Heads, Self::Models, Self::Tiles, Self::Lists, Self::Splats, Self::Scene, Self::SecondPainter];

    /// Its bit in a [`Placement`]: the first part has the highest; that of the splats is the second painter's too.
    const fn bit(self) -> u8 {
        let place = if matches!(self, Self::SecondPainter) { Self::Splats } else { self };
        0b10_0000 >> place as u8
    }
}

/// The region of each part, a bit each. Compared as numbers: the earlier a part, the more it counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Placement(u8);

impl Placement {
    /// Everything in fast memory.
    pub(crate) const FAST: Self = Self(0b11_1111);

    /// Those to choose from, the largest first: all of them, or [`FAST`](Self::FAST) alone where nothing is slow.
    pub(super) fn to_try(has_slow: bool) -> impl Iterator<Item = Self> {
        let last = if has_slow { 0 } else { Self::FAST.0 };
        (last..=Self::FAST.0).rev().map(Self)
    }

    /// Where a part lies.
    pub(super) const fn region(self, part: Part) -> Region {
        if self.0 & part.bit() == 0 { Region::Slow } else { Region::Fast }
    }
}

/// The caller's memory in both regions, as far as it is not yet handed out.
pub(crate) struct Regions<'s> {
    fast: Arena<'s>,
    slow: Arena<'s>,
    placement: Placement,
}

impl<'s> Regions<'s> {
    /// Memory for a placement.
    pub(crate) fn new(fast: &'s mut [u8], slow: &'s mut [u8], placement: Placement) -> Self {
        Self { fast: Arena::new(fast), slow: Arena::new(slow), placement }
    }

    /// The memory that a part lies in.
    pub(crate) fn of(&mut self, part: Part) -> &mut Arena<'s> {
        match self.placement.region(part) {
            Region::Fast => &mut self.fast,
            Region::Slow => &mut self.slow,
        }
    }

    /// The same memory for a while.
    pub(super) fn borrow(&mut self) -> Regions<'_> {
        Regions { fast: self.fast.borrow(), slow: self.slow.borrow(), placement: self.placement }
    }

    /// Words not yet handed out.
    #[cfg(test)]
    pub(super) fn n_words(&self) -> [usize; 2] {
        [self.fast.n_words(), self.slow.n_words()]
    }
}

#[cfg(test)]
mod tests {
    use super::{Part, Placement};
    use pocketsplat_format::Region;

    #[test]
    fn placements_prefer_the_parts_that_come_first_in_fast_memory() {
        let all: std::vec::Vec<_> = Placement::to_try(true).collect();
        assert_eq!((all.len(), all.first()), (64, Some(&Placement::FAST)), "every one, all fast first");
        let fast = |placement: &Placement| Part::ALL.map(|part| placement.region(part) == Region::Fast);
        assert!(all.is_sorted_by(|a, b| fast(a) > fast(b)), "then without the last part, then without the one before");
        assert_eq!(Placement::to_try(false).collect::<std::vec::Vec<_>>(), [Placement::FAST]);
    }
}
