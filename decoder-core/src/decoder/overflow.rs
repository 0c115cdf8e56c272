//! What a frame does where there may not be places for all of its splats.

use pocketsplat_format::bundle::{Chunk, ModelCost};
use pocketsplat_format::{DecodeError, saturate};

use super::first_come::FirstCome;
use super::slab_index::IndexState;
use super::source::{AnchorSource, Anchors, GaussianSource};
use super::strip::{Strip, StripLayout};
use super::strips_of_chunks::StripsOfChunks;
use super::{Decoder, FrameReport};
use crate::arithmetic::Arithmetic;
use crate::project::{Band, View};

/// Looks at chunks before a frame, each for a strip.
const MOST_LOOKED_AT: u64 = 2048;
/// Model instructions of a chunk whose place in the directory is looked at, and that is not drawn.
pub(super) const CHUNK_LOOKED_AT: u64 = 300;
/// Model instructions of a byte whose checksum is compared.
const CHECKSUM_BYTE: u64 = 8;

/// The current frame.
pub(super) struct Frame {
    pub(super) view: View,
    pub(super) strips: StripLayout,
    pub(super) policy: OverflowPolicy,
    pub(super) report: FrameReport,
    /// What the scene is worth in model instructions.
    pub(super) cost: ModelCost,
    /// Model instructions that the report does not have: of chunks looked at, damaged chunks, checksums, and making room for splats.
    pub(super) unreported: u64,
}

/// Which splats are drawn where there may not be places for all.
#[expect(clippy::large_enum_variant, reason = "a frame has one, and there is no allocator to box with")]
pub(super) enum OverflowPolicy {
    /// All: each strip surely has places enough.
    Fits,
    /// Those that have a place in every strip; the first strip goes over the whole scene to find out which, and which strips its chunks
    /// lie in.
    FirstCome { first_come: FirstCome, strips_of_chunks: StripsOfChunks },
    /// All, in slabs of depth, as many as it takes.
    Slabs { index: IndexState },
}

impl OverflowPolicy {
    /// Which splats were counted and admitted so far.
    pub(super) fn first_come(&self) -> Option<FirstCome> {
        match self {
            Self::FirstCome { first_come, .. } => Some(*first_come),
            Self::Fits | Self::Slabs { .. } => None,
        }
    }
}

/// A frame took no more model instructions than the budget allows.
pub(super) fn check_work(needed: u64, most: u64) -> Result<(), DecodeError> {
    if needed > most {
        let [needed_so_far, limit] = [needed, most].map(kilo);
        return Err(DecodeError::TooMuchWork { needed_so_far, limit });
    }
    Ok(())
}

/// Model instructions of comparing a chunk's checksum.
pub(super) fn checksum_work(chunk: &Chunk<'_>) -> u64 {
    u64::from(saturate(chunk.n_bytes())).saturating_mul(CHECKSUM_BYTE)
}

/// In units of 1,024.
fn kilo(instructions: u64) -> u32 {
    // A division of 64 bits would link a kilobyte of text.
    u32::try_from(instructions >> 10).unwrap_or(u32::MAX)
}

impl Frame {
    /// Model instructions so far.
    pub(super) fn instructions(&self) -> u64 {
        self.report.instructions(self.cost).saturating_add(self.unreported)
    }

    /// What the pass of a strip has to look at.
    pub(super) fn band(&self, strip: Strip) -> Option<Band> {
        let whole = strip.end_row - strip.first_row == self.strips.n_rows()
            || (strip.index == 0 && matches!(self.policy, OverflowPolicy::FirstCome { .. }));
        (!whole).then(|| self.view.band(self.strips.pixels(strip)))
    }

    /// Whether the pass of a strip needs a chunk.
    pub(super) fn needs(&self, strip: Strip, chunk: &Chunk<'_>) -> bool {
        self.band(strip).is_none_or(|band| band.sees_box(chunk.ink_box()))
    }
}

impl<'b, A: Arithmetic> Decoder<'b, '_, A> {
    /// Whether each strip surely has a place for all of its splats: all baked Gaussians, or all offsets of all anchors, of the
    /// chunks it sees. False for a scene of many chunks, whose first pass finds out.
    ///
    /// * `work`: takes in the model instructions.
    ///
    /// # Budget
    /// About 100 multiplications a chunk and strip, of [`MOST_LOOKED_AT`] at most; reads the directory alone.
    pub(super) fn surely_fits(&self, view: &View, strips: StripLayout, work: &mut u64) -> bool {
        let n_looks = u64::from(self.n_planned_chunks()).saturating_mul(strips.len().into());
        if n_looks > MOST_LOOKED_AT {
            return false;
        }
        *work = work.saturating_add(n_looks.saturating_mul(CHUNK_LOOKED_AT));
        let n_offsets = u64::from(self.bundle.header().n_offsets);
        strips.iter().all(|strip| {
            let band = view.band(strips.pixels(strip));
            let seen = self.planned_chunks().map(|(chunk, _)| chunk);
            let seen = seen.filter(|chunk| view.sees_box(chunk.ink_box()) && band.sees_box(chunk.ink_box()));
            let most_of = |chunk: Chunk<'_>| match &self.source {
                GaussianSource::Baked(baked) if cfg!(feature = "baked") => baked.n_of_chunk(chunk.index()).into(),
                _ => u64::from(chunk.n_anchors()).saturating_mul(n_offsets),
            };
            let most: u64 = seen.map(most_of).sum();
            most <= self.splats.places().into()
        })
    }

    /// Notes the damaged chunks in view, before strips are drawn in slabs, whose passes look at a chunk any number of times. Ends early
    /// where that takes more work than the budget allows, which is the frame's first error then.
    pub(super) fn note_damage(&self, frame: &mut Frame) {
        for (chunk, _) in self.planned_chunks() {
            let is_in_view = frame.view.sees_box(chunk.ink_box());
            let checksum = if is_in_view && self.source.is_streamed() { checksum_work(&chunk) } else { 0 };
            frame.unreported = frame.unreported.saturating_add(CHUNK_LOOKED_AT).saturating_add(checksum);
            if frame.unreported > self.plan.budget().most_work {
                return;
            }
            if is_in_view && !self.is_sound(&chunk) {
                frame.report.chunks_damaged += 1;
                frame.report.first_damaged = frame.report.first_damaged.or(Some(chunk.index()));
            }
        }
    }

    /// Whether a chunk is known to be undamaged, or damage is an error.
    pub(super) fn is_sound(&self, chunk: &Chunk<'b>) -> bool {
        match &self.source {
            GaussianSource::Baked(baked) => !(cfg!(feature = "baked") && baked.is_damaged(chunk.index())),
            GaussianSource::Anchors(Anchors { source: AnchorSource::Resident(records), .. }) => {
                !records.is_damaged(chunk.index())
            }
            GaussianSource::Anchors(_) => !self.skips_damage() || chunk.check().is_ok(),
        }
    }
}
