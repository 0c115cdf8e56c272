//! What no camera changes of the heads' first layers, kept of each anchor: `b₁ + W₁·feature`.
//!
//! Inputs begin with the feature and sums are ordered, so these are exact beginnings: what is added to them later gives the same bits as
//! the whole sum.

use super::shape::HeadShape;

/// The sums of all anchors.
pub(crate) struct FeatureSums<'s> {
    /// Memory that is not filled yet.
    empty: &'s mut [f32],
    sums: &'s [f32],
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
        Self { empty: sums, sums: &[], len }
    }

    /// Fills those of each anchor, as [`Heads::begin`](super::Heads::begin) does.
    pub(crate) fn fill<E>(&mut self, mut fill: impl FnMut(u32, &mut [f32]) -> Result<(), E>) -> Result<(), E> {
        let memory = core::mem::take(&mut self.empty);
        for (number, sums) in (0..).zip(memory.chunks_exact_mut(self.len.max(1))) {
            fill(number, sums)?;
        }
        self.sums = memory;
        Ok(())
    }

    /// The same for another painter, once they are filled.
    pub(crate) fn shared(&self) -> Self {
        Self { empty: &mut [], ..*self }
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
