//! Which strips the chunks of a frame lie in, noted in its first pass, so that later passes leave out chunks that they draw nothing of.

use core::ops::RangeInclusive;

use super::strip::{Strip, strip_bits};

/// Which strips each of the first chunks has splats in, of a frame that draws those that come first: as many as 256 bytes hold.
#[derive(Clone, Copy, Debug)]
pub(super) struct StripsOfChunks([u8; 256]);

impl StripsOfChunks {
    /// No splats.
    pub(super) const NONE: Self = Self([0; 256]);

    /// Takes in a splat.
    pub(super) fn add(&mut self, chunk: u32, strips: RangeInclusive<usize>) {
        if let Some(noted) = self.0.get_mut(chunk as usize) {
            *noted |= strip_bits(strips) as u8;
        }
    }

    /// Whether a chunk may have a splat in a strip, or in one of several.
    pub(super) fn may_lie_in(&self, chunk: u32, strip: Strip) -> bool {
        self.0.get(chunk as usize).is_none_or(|&noted| u32::from(noted) & strip.bits() != 0)
    }
}

#[cfg(test)]
mod tests {
    use super::{Strip, StripsOfChunks};

    fn strip(index: u8) -> Strip {
        Strip { index, end_index: index + 1, first_row: index.into(), end_row: u16::from(index) + 1 }
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
}
