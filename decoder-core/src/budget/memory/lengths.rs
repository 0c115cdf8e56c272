//! How long the memory is: words of each part, by when they are needed.

use pocketsplat_format::Region;

use super::{
    anchor_words, baked_words, list_words, models_words, reader_words, record_words, splat_words, sums_words,
    tile_words,
};
use crate::arena::Arena;
use crate::budget::placement::{Part, Placement};
use crate::budget::shape::ScratchShape;

/// When a part is needed.
#[derive(Clone, Copy)]
enum When {
    /// From binding to the last frame.
    Kept,
    /// While binding.
    Bound,
    /// In a frame; lies where what was [bound](Self::Bound) lay before.
    Frame,
}

/// Words of several parts, by when they are needed.
#[derive(Clone, Copy)]
pub(super) struct Words {
    kept: usize,
    pub(super) bound: usize,
    pub(super) frame: usize,
}

impl Words {
    const NONE: Self = Self { kept: 0, bound: 0, frame: 0 };

    /// Words of memory.
    const fn most(self) -> usize {
        self.kept.saturating_add(if self.bound > self.frame { self.bound } else { self.frame })
    }
}

impl ScratchShape {
    /// Bytes of scratch memory, whatever their alignment; [`usize::MAX`] beyond the address space.
    #[must_use]
    pub const fn scratch_len(&self) -> usize {
        let [len, _] = self.lens(Placement::FAST);
        len
    }

    /// Bytes of fast and of slow memory, whatever their alignment, when the parts are placed so.
    pub(in crate::budget) const fn lens(&self, placement: Placement) -> [usize; 2] {
        let [fast, slow] = self.words(placement);
        [bytes_for(fast.most()), bytes_for(slow.most())]
    }

    /// Bytes that binding takes without a frame after it.
    pub(crate) const fn bind_len(&self) -> usize {
        let [fast, _] = self.words(Placement::FAST);
        bytes_for(fast.kept.saturating_add(fast.bound))
    }

    /// Bytes of a part while frames are drawn.
    pub(in crate::budget) const fn part_len(&self, part: Part) -> usize {
        let (when, words) = self.words_of(part);
        if matches!(when, When::Bound) { 0 } else { words.saturating_mul(4) }
    }

    /// The most splats, up to those of the shape, that `lens` bytes of fast and slow memory have places for when the parts are
    /// placed so; 0 if not even the rest fits.
    // Not inlined: each caller would have a copy.
    #[inline(never)]
    pub(in crate::budget) fn splats_within(&self, placement: Placement, lens: [usize; 2]) -> u32 {
        let [none, one] = [0, 1].map(|splats| self.with_splats(splats).words(placement));
        let mut most = self.frame.max_splats;
        for ((Words { kept, bound, frame }, one), len) in none.into_iter().zip(one).zip(lens) {
            let room = (len.saturating_sub(3) / 4).saturating_sub(kept);
            if bound > room || frame > room {
                return 0;
            }
            let places = room.saturating_sub(frame).checked_div(one.frame.saturating_sub(frame));
            most = places.and_then(|places| u32::try_from(places).ok()).map_or(most, |places| places.min(most));
        }
        most
    }

    /// The same with memory for so many splats.
    pub(crate) const fn with_splats(mut self, max_splats: u32) -> Self {
        self.frame.max_splats = max_splats;
        self
    }

    /// Words of fast and of slow memory when the parts are placed so.
    // Not inlined: each caller would have a copy.
    #[inline(never)]
    pub(super) const fn words(&self, placement: Placement) -> [Words; 2] {
        let ([mut fast, mut slow], mut parts) = ([Words::NONE; 2], Part::ALL.as_slice());
        while let [part, rest @ ..] = parts {
            let region = match placement.region(*part) {
                Region::Fast => &mut fast,
                Region::Slow => &mut slow,
            };
            let (when, words) = self.words_of(*part);
            let sum = match when {
                When::Kept => &mut region.kept,
                When::Bound => &mut region.bound,
                When::Frame => &mut region.frame,
            };
            *sum = sum.saturating_add(words);
            parts = rest;
        }
        [fast, slow]
    }

    /// Words of a part, as [`SceneMemory`](super::SceneMemory), [`FrameMemory`](super::FrameMemory) and
    /// [`PainterMemory`](super::PainterMemory) take them.
    // Into the loop above, which is unrolled.
    #[inline(always)]
    const fn words_of(&self, part: Part) -> (When, usize) {
        let (is_baked, is_resident) = (self.resident.is_gaussians(), self.resident.is_anchors());
        match part {
            Part::Heads => (if is_baked { When::Bound } else { When::Kept }, anchor_words(self)),
            Part::Models => (if is_baked || is_resident { When::Bound } else { When::Kept }, models_words(self)),
            Part::Scene if is_baked => (When::Kept, baked_words(self)),
            Part::Scene if is_resident => (When::Kept, record_words(self).saturating_add(sums_words(self))),
            Part::Scene => (When::Kept, 0),
            Part::Tiles => (When::Frame, tile_words(self)),
            Part::Splats => (When::Frame, splat_words(self)),
            Part::Lists => (When::Frame, list_words(self)),
            Part::SecondPainter if self.frame.shared_chunks == 0 => (When::Frame, 0),
            Part::SecondPainter => {
                let of_anchors = if is_baked { 0 } else { reader_words(self) };
                let of_frame = tile_words(self).saturating_add(splat_words(self)).saturating_add(list_words(self));
                (When::Frame, of_anchors.saturating_add(of_frame))
            }
        }
    }
}

const fn bytes_for(words: usize) -> usize {
    if words == 0 {
        return 0;
    }
    match Arena::bytes_for(words) {
        Some(len) if len < isize::MAX as usize => len,
        _ => usize::MAX,
    }
}
