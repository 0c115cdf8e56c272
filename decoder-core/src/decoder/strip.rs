//! The horizontal strips of a frame.

use core::ops::RangeInclusive;

use pocketsplat_format::rules::TILE_PX;

use crate::project::TileRect;

/// How a frame is cut into strips of whole rows of tiles.
#[derive(Clone, Copy, Debug)]
pub(super) struct StripLayout {
    height_px: u16,
    rows_per_strip: u16,
}

/// The rows of tiles of one strip, or of several that are drawn together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Strip {
    pub(super) index: u8,
    /// The first that is not among them.
    pub(super) end_index: u8,
    pub(super) first_row: u16,
    pub(super) end_row: u16,
}

impl Strip {
    /// The one that the first comes after.
    pub(super) const BEFORE: Self = Self { index: 0, end_index: 0, first_row: 0, end_row: 0 };

    /// The bits of its strips.
    pub(super) fn bits(self) -> u32 {
        strip_bits(self.index.into()..=self.end_index.saturating_sub(1).into())
    }
}

/// Bit i for each strip i of some that lie one below the other; a frame has 8 at most.
pub(super) fn strip_bits(strips: RangeInclusive<usize>) -> u32 {
    let (first, last) = (*strips.start() as u32, *strips.end() as u32);
    2_u32.wrapping_shl(last).wrapping_sub(1_u32.wrapping_shl(first))
}

impl StripLayout {
    /// `n_strips` strips of ⌈tile rows / `n_strips`⌉ rows; fewer when the first ones hold all.
    pub(super) fn new(height_px: u16, n_strips: u8) -> Self {
        let rows_per_strip = height_px.div_ceil(TILE_PX).div_ceil(u16::from(n_strips).max(1)).max(1);
        Self { height_px, rows_per_strip }
    }

    /// Number of strips.
    pub(super) fn len(&self) -> u8 {
        // At most as many as asked for.
        self.n_rows().div_ceil(self.rows_per_strip.max(1)) as u8
    }

    /// The strip below another one.
    pub(super) fn after(self, strip: Strip) -> Option<Strip> {
        (strip.end_row < self.n_rows()).then(|| self.between(strip.end_index, strip.end_index + 1))
    }

    /// The strips from `index` up to `end_index`.
    pub(super) fn between(self, index: u8, end_index: u8) -> Strip {
        let row = |index: u8| (u16::from(index) * self.rows_per_strip).min(self.n_rows());
        Strip { index, end_index, first_row: row(index), end_row: row(end_index) }
    }

    /// From the top.
    pub(super) fn iter(self) -> impl Iterator<Item = Strip> {
        (0..self.len()).map(move |index| self.between(index, index + 1))
    }

    /// The strips that a splat lies in.
    pub(super) fn touched(&self, rect: TileRect) -> RangeInclusive<usize> {
        let strip = |row: u8| usize::from(u16::from(row) / self.rows_per_strip.max(1));
        strip(rect.first_row)..=strip(rect.last_row)
    }

    /// Rows of pixels of a strip: the first, and the one after the last.
    pub(super) fn pixels(&self, strip: Strip) -> [u16; 2] {
        [strip.first_row * TILE_PX, (strip.end_row * TILE_PX).min(self.height_px)]
    }

    /// Rows of tiles.
    pub(super) fn n_rows(&self) -> u16 {
        self.height_px.div_ceil(TILE_PX)
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::{StripLayout, strip_bits};
    use crate::project::TileRect;

    #[test]
    fn strips_fill_the_frame_from_the_top() {
        for height_px in [1, 16, 17, 120, 200, 4080] {
            for n_strips in 1..=8 {
                let layout = StripLayout::new(height_px, n_strips);
                let strips: Vec<_> = layout.iter().collect();
                assert!(strips.len() <= usize::from(n_strips), "{height_px} px in {n_strips}");
                let mut next_px = 0;
                for &strip in &strips {
                    let [first_px, end_px] = layout.pixels(strip);
                    assert!(first_px == next_px && end_px > first_px, "{height_px} px in {n_strips}: {strip:?}");
                    next_px = end_px;
                }
                assert_eq!(next_px, height_px, "in {n_strips}");
            }
        }
    }

    #[test]
    fn the_first_and_the_last_strip_are_among_the_bits() {
        assert_eq!((strip_bits(0..=7), strip_bits(3..=3)), (0xFF, 8));
    }

    #[test]
    fn a_splat_lies_in_the_strips_of_its_rows() {
        let layout = StripLayout::new(120, 4);
        let rect = TileRect { first_column: 0, last_column: 0, first_row: 1, last_row: 6 };
        assert_eq!(layout.touched(rect), 0..=3, "rows 1 to 6 of 8, two a strip");
        assert_eq!(layout.touched(TileRect { first_row: 2, last_row: 3, ..rect }), 1..=1, "the second strip");
    }
}
