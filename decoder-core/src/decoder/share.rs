//! Which part of a scene each of two painters goes over.

use core::ops::Range;

use pocketsplat_format::bundle::Chunk;

use super::splats::SplatStore;

/// What of the scene a pass goes over. A type, so that one painter alone pays nothing for it.
pub(super) trait Share {
    /// Whether the pass goes over some of a chunk; both painters ask for the same chunks in the same order.
    fn takes(&mut self, chunk: &Chunk<'_>, is_streamed: bool) -> bool;

    /// Its part of what waits in memory of a chunk.
    fn of(&self, numbers: Range<u32>, chunk: u32) -> Range<u32>;

    /// Notes where the splats of a chunk end.
    fn end_chunk(&self, splats: &mut SplatStore<'_>, chunk: u32);
}

/// The whole scene.
pub(super) struct All;

/// Half of it: of each chunk whose anchors or Gaussians wait in memory; else of the chunks. Chunks hold anchors that are near one another, so that
/// halves of chunks are halves of what is seen.
pub(super) struct Half {
    painter: Painter,
    /// Anchors that the first painter was to decode so far, less those of the second.
    ahead: i32,
}

/// One of two painters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Painter {
    First,
    Second,
}

impl Painter {
    /// Whose splats of a chunk that both went over come first in the file.
    pub(super) fn ahead_in(chunk: u32) -> Self {
        // By turns: of a chunk whose anchors follow a curve one half may be nearer.
        if chunk.is_multiple_of(2) { Self::First } else { Self::Second }
    }
}

impl Share for All {
    #[inline(always)]
    fn takes(&mut self, _: &Chunk<'_>, _: bool) -> bool {
        true
    }

    #[inline(always)]
    fn of(&self, numbers: Range<u32>, _: u32) -> Range<u32> {
        numbers
    }

    #[inline(always)]
    fn end_chunk(&self, _: &mut SplatStore<'_>, _: u32) {}
}

impl Half {
    pub(super) fn of(painter: Painter) -> Self {
        Self { painter, ahead: 0 }
    }
}

impl Share for Half {
    fn takes(&mut self, chunk: &Chunk<'_>, is_streamed: bool) -> bool {
        if !is_streamed {
            return true;
        }
        let n = i32::from(chunk.n_anchors());
        let whose = if self.ahead <= 0 { Painter::First } else { Painter::Second };
        self.ahead = self.ahead.saturating_add(if whose == Painter::First { n } else { -n });
        whose == self.painter
    }

    fn of(&self, numbers: Range<u32>, chunk: u32) -> Range<u32> {
        let middle = numbers.start.saturating_add(numbers.end.saturating_sub(numbers.start) / 2);
        if self.painter == Painter::ahead_in(chunk) { numbers.start..middle } else { middle..numbers.end }
    }

    fn end_chunk(&self, splats: &mut SplatStore<'_>, chunk: u32) {
        splats.end_chunk(chunk);
    }
}

#[cfg(test)]
mod tests {
    use super::{All, Half, Painter, Share};

    #[test]
    fn two_halves_are_all_of_a_chunk() {
        let halves =
            |chunk| [Painter::First, Painter::Second].map(|painter| Share::of(&Half::of(painter), 10..17, chunk));
        assert_eq!((halves(0), halves(1)), ([10..13, 13..17], [13..17, 10..13]), "by turns");
        assert_eq!(All.of(10..17, 0), 10..17);
    }
}
