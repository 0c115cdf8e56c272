//! The splats in memory.

use crate::project::{PackedSplat, Splat};
use crate::raster::TileRect;

/// The splats of the strip in work, in the order of the file.
pub(super) struct SplatStore<'s> {
    pub(super) splats: &'s mut [PackedSplat],
    pub(super) rects: &'s mut [TileRect],
    pub(super) n: u32,
}

impl SplatStore<'_> {
    /// Keeps a splat; the caller has counted that there is a place.
    pub(super) fn push(&mut self, splat: &Splat, rect: TileRect) {
        let slot = self.n as usize;
        if let (Some(splat_slot), Some(rect_slot)) = (self.splats.get_mut(slot), self.rects.get_mut(slot)) {
            *splat_slot = PackedSplat::new(splat);
            *rect_slot = rect;
            self.n = self.n.saturating_add(1);
        }
    }
}
