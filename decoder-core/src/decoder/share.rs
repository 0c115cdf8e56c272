//! Which part of a scene each of two painters goes over.

use core::ops::Range;

use pocketsplat_format::bundle::Chunk;

/// What of the scene a pass goes over. Chunks hold anchors that are near one another, so that halves of chunks are halves of what is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Share {
    /// All.
    All,
    /// One half: of each chunk whose anchors or Gaussians wait in memory; else of the chunks.
    Half {
        painter: Painter,
        /// Anchors that the first painter was to decode so far, less those of the second.
        ahead: i32,
    },
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

impl Share {
    /// A painter's half.
    pub(super) fn half(painter: Painter) -> Self {
        Self::Half { painter, ahead: 0 }
    }

    /// Whether the pass goes over some of a chunk; both painters ask for the same chunks in the same order.
    pub(super) fn takes(&mut self, chunk: &Chunk<'_>, is_streamed: bool) -> bool {
        let Self::Half { painter, ahead } = self else { return true };
        if !is_streamed {
            return true;
        }
        let n = i32::from(chunk.n_anchors());
        let whose = if *ahead <= 0 { Painter::First } else { Painter::Second };
        *ahead = ahead.saturating_add(if whose == Painter::First { n } else { -n });
        whose == *painter
    }

    /// Its part of what waits in memory of a chunk.
    pub(super) fn of(self, numbers: Range<u32>, chunk: u32) -> Range<u32> {
        let Self::Half { painter, .. } = self else { return numbers };
        let middle = numbers.start.saturating_add(numbers.end.saturating_sub(numbers.start) / 2);
        if painter == Painter::ahead_in(chunk) { numbers.start..middle } else { middle..numbers.end }
    }
}

#[cfg(test)]
mod tests {
    use super::{Painter, Share};

    #[test]
    fn two_halves_are_all_of_a_chunk() {
        let halves = |chunk| [Painter::First, Painter::Second].map(|painter| Share::half(painter).of(10..17, chunk));
        assert_eq!((halves(0), halves(1)), ([10..13, 13..17], [13..17, 10..13]), "by turns");
        assert_eq!(Share::All.of(10..17, 0), 10..17);
    }
}
