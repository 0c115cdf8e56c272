//! What a frame took.

use pocketsplat_format::bundle::ModelCost;

use crate::budget::Work;

/// Model instructions of an anchor that is read from memory, in place of those of one that is decoded.
const FROM_MEMORY: u32 = 1100;
/// Those of a row of pixels of a tile that a splat reaches: a pair counts with 16.
const ROW: u32 = ModelCost::PAIR.div_ceil(16);

/// What a frame consisted of and what it cost.
///
/// With strips a chunk or an anchor counts once for each pass that needs it, and as many strips as fit in memory together take one pass;
/// splats and pixels do not depend on strips.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct FrameReport {
    /// Times the chunks in view were decoded: once a pass, or a slab of a strip, never when the anchors are resident.
    pub decode_passes: u8,
    /// Chunks decoded: those whose ink box the camera sees.
    pub chunks_decoded: u32,
    /// Different damaged chunks in view, which were left out; always 0 unless the budget is
    /// [`skipping_damage`](crate::Budget::skipping_damage).
    pub chunks_damaged: u32,
    /// The first of them.
    pub first_damaged: Option<u32>,
    /// Anchors gone over, decoded or from memory.
    pub anchors_read: u32,
    /// Anchors decoded.
    pub anchors_decoded: u32,
    /// Symbols of their channels, those of masked offsets not among them.
    pub symbols_decoded: u64,
    /// Anchors that passed the prefilter, so that their heads ran.
    pub anchors_visible: u32,
    /// Multiply-adds of the heads.
    pub head_macs: u64,
    /// Gaussians gone over, before they were projected: made by the heads, or [baked](crate::Residency::Baked).
    pub gaussians: u32,
    /// Splats drawn.
    pub splats: u32,
    /// Splats left out because there was no memory for them: all of the file's anchors and offsets from the first one on
    /// that some strip had no place for.
    pub splats_dropped: u32,
    /// Slabs of depth drawn, or passes where there were places for all splats of a strip.
    pub slabs: u32,
    /// Splats of the fullest strip, those left out included; the number to plan for. In slabs those drawn before nothing more could be seen.
    pub max_splats: u32,
    /// Splats of all passes together, one that lies in two counted twice.
    pub strip_splats: u32,
    /// Pairs of a tile and a splat blended into it.
    pub tile_splats: u32,
    /// Pairs of a row of a tile's pixels and a splat that reaches it.
    pub row_splats: u32,
    /// Pairs of a pixel and a splat evaluated for it.
    pub pixel_splats: u32,
    /// Bytes of the planned memory that this frame needed; no fewer would have drawn it in this way.
    pub scratch_used: u32,
}

impl FrameReport {
    /// What [`Plan::work`](crate::Plan::work) bounds.
    #[must_use]
    pub fn work(&self) -> Work {
        Work {
            head_macs: self.head_macs,
            decoded_anchors: self.anchors_decoded.into(),
            pixel_splats: self.pixel_splats.into(),
        }
    }

    /// What it took in [model instructions](pocketsplat_format::bundle::levels): those of section 5 of `MANIFEST.md`, with the frame's own
    /// counts in place of the most of all views, rows of pixels in place of pairs with all 16, Gaussians before they are projected in
    /// place of splats, 1,100 for an anchor that waits in memory, and without what lists and pixels take of every frame.
    // Not inlined: it has several callers.
    #[inline(never)]
    #[must_use]
    pub fn instructions(&self, cost: ModelCost) -> u64 {
        let from_memory = self.anchors_read.saturating_sub(self.anchors_decoded);
        let of = |n: u32, each: u32| u64::from(n) * u64::from(each);
        // A cost is below 2²¹, so that no sum comes near the end of 64 bits.
        of(self.anchors_decoded, cost.decoded)
            + of(from_memory, FROM_MEMORY)
            + of(self.anchors_visible, ModelCost::VISIBLE)
            + of(self.gaussians, ModelCost::GAUSSIAN)
            + of(self.row_splats, ROW)
            + of(self.pixel_splats, ModelCost::PIXEL)
            + self.head_macs.saturating_mul(ModelCost::HEAD_MAC.into()).min(1 << 62)
    }
}
