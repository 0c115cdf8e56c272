//! What no camera changes of the heads' first layers, kept of each anchor: `b₁ + W₁·feature`.
//!
//! Inputs begin with the feature and sums are ordered, so these are exact beginnings: what is added to them later gives the same bits as
//! the whole sum.

use super::shape::HeadShape;

/// The sums of all anchors.
pub(crate) struct FeatureSums<'s> {
    sums: &'s mut [f32],
    len: usize,
}

/// The sums of one anchor.
#[derive(Clone, Copy)]
pub(crate) struct AnchorSums<'p> {
    /// `[anchor_sums_len]`, see [`HeadShape`].
    sums: &'p [f32],
    shape: &'p HeadShape,
}

impl<'s> FeatureSums<'s> {
    /// * `sums`: memory of any content. * `len`: of an anchor.
    pub(crate) fn new(sums: &'s mut [f32], len: usize) -> Self {
        Self { sums, len }
    }

    /// Those of each anchor, to be filled by [`Heads::begin`](super::Heads::begin).
    pub(crate) fn each_mut(&mut self) -> impl Iterator<Item = &mut [f32]> {
        self.sums.chunks_exact_mut(self.len.max(1))
    }

    /// Those of anchor `number` of the file.
    pub(crate) fn of<'p>(&'p self, number: u32, shape: &'p HeadShape) -> Option<AnchorSums<'p>> {
        let (_, from) = self.sums.split_at_checked((number as usize).saturating_mul(self.len))?;
        Some(AnchorSums { sums: from.get(..self.len)?, shape })
    }
}

impl<'p> AnchorSums<'p> {
    /// Of the hidden units of head `number` and those behind it, and how many inputs are in them.
    pub(super) fn of_head(&self, number: usize) -> (&'p [f32], usize) {
        (self.from(number), self.shape.feature)
    }

    /// Of the detail head.
    pub(crate) fn of_detail(&self) -> &'p [f32] {
        self.from(3)
    }

    fn from(&self, number: usize) -> &'p [f32] {
        self.sums.get(self.shape.head_sums_at(number)..).unwrap_or_default()
    }
}
