//! What a plan says: from limits to a number of bytes.

mod places;
mod planner;

use pocketsplat_format::{Bundle, DecodeError, saturate};

use super::limits::{Budget, Residency};
use super::placement::{Part, PartMemory, Placement};
use super::shape::ScratchShape;
use super::work::Work;
use crate::mlp::HeadWeights;
use planner::Planner;

/// What a decoder of one bundle needs and does within a [`Budget`]; made by [`Plan::new`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Plan {
    budget: Budget,
    n_tiers: u8,
    n_strips: u8,
    n_slabs: u32,
    shape: ScratchShape,
    placement: Placement,
    scratch_len: usize,
    slow_len: usize,
    /// Places for splats that would do.
    least_splats: u32,
    pruning_rate: f32,
    work: Option<Work>,
}

impl Plan {
    /// Bytes of scratch memory, exactly so many, whatever their alignment; the fast ones, if some are slow.
    #[must_use]
    pub fn scratch_len(&self) -> usize {
        self.scratch_len
    }

    /// Bytes of slow scratch memory, exactly so many, whatever their alignment; 0 unless the budget has some.
    #[must_use]
    pub fn slow_scratch_len(&self) -> usize {
        self.slow_len
    }

    /// Bytes of both regions that would do: the same tiers in as many strips, with no more places for splats than a strip needs. What
    /// the plan takes beyond saves [passes](Self::new).
    #[must_use]
    pub fn least_len(&self) -> usize {
        self.len_with_splats(self.least_splats)
    }

    /// Where each part of the scratch memory lies and how many bytes it takes. The bytes of a region's parts, and 3 for alignment,
    /// are its length; where binding takes more than a frame, the length is greater.
    pub fn memory(&self) -> impl Iterator<Item = PartMemory> + use<> {
        let Self { shape, placement, .. } = *self;
        Part::ALL.into_iter().map(move |part| PartMemory {
            part,
            region: placement.region(part),
            n_bytes: shape.part_len(part),
        })
    }

    /// Bytes of both regions with places for so many splats.
    pub(crate) fn len_with_splats(&self, max_splats: u32) -> usize {
        let [fast, slow] = self.shape.with_splats(max_splats).lens(self.placement);
        fast.saturating_add(slow)
    }

    /// Bytes of both regions.
    pub(crate) fn len(&self) -> u32 {
        saturate(self.scratch_len.saturating_add(self.slow_len))
    }

    /// Whether a decoder of this plan does what one of `other` does, in the same memory.
    pub(crate) fn draws_as(&self, other: &Self) -> bool {
        // The rest is the budget, which the plan was made from, and what is said about it.
        let drawn = |plan: &Self| (plan.n_tiers, plan.n_strips, plan.placement, plan.scratch_len, plan.slow_len);
        drawn(self) == drawn(other) && self.shape == other.shape
    }

    /// Which parts lie where.
    pub(crate) fn placement(&self) -> Placement {
        self.placement
    }

    /// Tiers that are drawn.
    #[must_use]
    pub fn n_tiers(&self) -> u8 {
        self.n_tiers
    }

    /// The part of the scene's anchors that is not drawn, 0 to 1.
    #[must_use]
    pub fn pruning_rate(&self) -> f32 {
        self.pruning_rate
    }

    /// Whether anchors are decoded once when bound; if not, every frame decodes those in view.
    #[must_use]
    pub fn is_resident(&self) -> bool {
        self.shape.resident.is_anchors()
    }

    /// Whether the [sums](Residency::AutoWithSums) of resident anchors' features are in memory, for heads in f32.
    #[must_use]
    pub fn keeps_sums(&self) -> bool {
        self.shape.resident.has_sums()
    }

    /// Whether Gaussians are evaluated once when bound; if not, every frame runs the heads of the anchors in view.
    #[must_use]
    pub fn is_baked(&self) -> bool {
        self.shape.resident.is_gaussians()
    }

    /// How the weights of the heads are kept in memory: as halves where there is no room for f32. Frames of one differ from frames
    /// of the other by less than a step of 8 bits in most pixels, by a step where alpha is at its cut.
    #[must_use]
    pub fn head_weights(&self) -> HeadWeights {
        self.shape.model.head_weights
    }

    /// Horizontal strips of a frame.
    #[must_use]
    pub fn n_strips(&self) -> u8 {
        self.n_strips
    }

    /// Slabs of depth that the fullest strip of the measured views takes at most; 1 if there are places for all of its splats.
    /// Coincident depths may take more.
    #[must_use]
    pub fn n_slabs(&self) -> u32 {
        self.n_slabs
    }

    /// Splats that there is memory for at once; of [two painters](Budget::with_two_painters) for each.
    #[must_use]
    pub fn max_splats(&self) -> u32 {
        self.shape.frame.max_splats
    }

    /// What the size of the scratch memory follows from.
    #[must_use]
    pub fn shape(&self) -> &ScratchShape {
        &self.shape
    }

    /// A bound on the work of a frame: of the views in the manifest, for cameras of at most the budget's size; another
    /// view may need more. `None` when the manifest is not measured.
    ///
    /// With n strips, or slabs of them, heads and decoding count n times, because each may need every anchor; most need few. With
    /// [sums](Residency::AutoWithSums) it counts heads in f32, which alone go on from them.
    #[must_use]
    pub fn work(&self) -> Option<Work> {
        self.work
    }

    /// The limits it was made for.
    #[must_use]
    pub fn budget(&self) -> &Budget {
        &self.budget
    }
}

impl Plan {
    /// Finds the best scene that fits a budget: the lowest pruning rate, that is the most tiers, in `ram_bytes`; of these tiers
    /// [weights of the heads](Plan::head_weights) in f32 before halves, and among these plan variants the one of least predicted work.
    ///
    /// Work is predicted in multiply-adds. One strip goes over the scene once, several together about twice; going over it
    /// costs the heads' (from the manifest, else of all anchors; the share that [sums](Residency::AutoWithSums) leave at most), and
    /// decoding when anchors are streamed; or 150 a Gaussian when they are baked. Of equals the fewest strips are taken, or the most
    /// where they share passes, and sums are kept in one strip alone unless the caller says how many there are. The frame's size decides
    /// about memory only through the splats of a strip, because tiles leave one by one; a splat takes 40 bytes.
    ///
    /// When [slabs](crate::Overflow::Slabs) are allowed, fewer places than splats will do, down to 256: then nearly every scene fits
    /// whole, and going over it counts once more for each slab.
    ///
    /// Strips [share passes](crate::Strips::Auto) where the plan chose their number: a frame draws as many in a pass as there are places for.
    /// Such a plan gives its splats all of the budget that is left, which saves passes; [`Plan::least_len`] bytes would do.
    ///
    /// With [slow bytes](Budget::slow_bytes) each [part](Part) of the memory lies in one of two regions: of the equal plan variants
    /// the one is taken that has the first part in fast memory, of these the one with the second, and so on. No pixel depends on it.
    ///
    /// # Errors
    /// [`DecodeError::BudgetTooSmall`] names the bytes that the smallest plan within the other limits needs, of slow memory if there
    /// is some;
    /// [`DecodeError::NotBakeable`] for a residency that the scene does not have;
    /// [`DecodeError::OutOfRange`] for an empty or too large frame or number of strips, for no tiers, and for fewer than
    /// [`Budget::MIN_SLAB_PLACES`] splats a slab; [`DecodeError::PlanTooLarge`] beyond
    /// the address space.
    ///
    /// # Budget
    /// At most 192 sums, more where slabs are allowed, 64 times as many with slow memory; reads the manifest and the
    /// directory's tiers, no chunk.
    // Not inlined: a caller's stack frame would keep what only planning needs.
    #[inline(never)]
    pub fn new(bundle: &Bundle<'_>, budget: &Budget) -> Result<Self, DecodeError> {
        budget.check()?;
        if budget.residency == Residency::Baked && bundle.n_gaussians(0).is_none() {
            return Err(DecodeError::NotBakeable);
        }
        Planner { bundle, budget }.best()
    }
}
