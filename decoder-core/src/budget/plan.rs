//! From limits to a number of bytes.

use core::slice;

use pocketsplat_format::bundle::{STRIPS, Tier, TierMeasures};
use pocketsplat_format::rules::TILE_PX;
use pocketsplat_format::{Bundle, DecodeError, Region, saturate};

use super::limits::{Budget, MaxSplats, Overflow, Residency, Strips};
use super::placement::{Part, PartMemory, Placement};
use super::shape::{FrameShape, Resident, ScratchShape};
use super::work::{Work, decoding_macs};
use crate::mlp::HeadWeights;

/// What reading a baked Gaussian is worth in multiply-adds.
const READING_MACS: u64 = 150;

/// Fewer splats to a slab are not planned.
const MIN_SLAB_SPLATS: u32 = 256;

/// [`STRIPS`] that share passes: the more there are to choose from, the fuller a pass.
const MOST_STRIPS_FIRST: [u8; STRIPS.len()] = [1, 8, 4, 2];

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
    /// When [slabs](Overflow::Slabs) are allowed, fewer places than splats will do, down to 256: then nearly every scene fits
    /// whole, and going over it counts once more for each slab.
    ///
    /// Strips [share passes](Strips::Auto) where the plan chose their number: a frame draws as many in a pass as there are places for.
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

/// Compares the plans of one bundle within one budget.
struct Planner<'p, 'b> {
    bundle: &'p Bundle<'b>,
    budget: &'p Budget,
}

impl Planner<'_, '_> {
    /// The plan of the most tiers that fits, and of least predicted work.
    fn best(&self) -> Result<Plan, DecodeError> {
        let budget = self.budget;
        let most_tiers = budget.tiers.min(self.bundle.n_tiers());
        let has_slow = budget.slow_bytes > 0;
        // The memory that decides: whatever is too much for the fast one can lie in the slow one, if there is any.
        let (region, available) =
            if has_slow { (Region::Slow, budget.slow_bytes) } else { (Region::Fast, budget.ram_bytes) };
        let (mut least_needed, mut n_strips_then, mut tiers_then, mut splats_then) = (usize::MAX, 0, most_tiers, 0);
        let tiers = (1..=most_tiers).rev();
        // Halves before fewer tiers.
        for (n_tiers, weights) in tiers.flat_map(|n| [(n, HeadWeights::F32), (n, HeadWeights::F16)]) {
            let mut best: Option<(u64, Plan)> = None;
            for placement in Placement::to_try(has_slow) {
                for (n_strips, residency) in self.variants() {
                    let (cost, plan) = self.variant(n_tiers, n_strips, residency, weights, placement);
                    let needed = match region {
                        Region::Fast => plan.scratch_len,
                        Region::Slow if plan.scratch_len <= budget.ram_bytes => plan.slow_len,
                        Region::Slow => usize::MAX,
                    };
                    if needed < least_needed || n_strips_then == 0 {
                        (least_needed, n_strips_then) = (needed, plan.n_strips);
                        (tiers_then, splats_then) = (n_tiers, plan.shape.frame.max_splats);
                    }
                    let fits = needed <= available && needed < usize::MAX;
                    if fits && best.is_none_or(|(least, _)| cost < least) {
                        best = Some((cost, plan));
                    }
                }
            }
            if let Some((_, plan)) = &mut best {
                self.give_places(plan);
                return Ok(*plan);
            }
        }
        if least_needed == usize::MAX {
            return Err(DecodeError::PlanTooLarge { max_splats: splats_then });
        }
        let [needed, available] = [least_needed, available].map(saturate);
        Err(DecodeError::BudgetTooSmall { region, needed, available, n_tiers: tiers_then, n_strips: n_strips_then })
    }

    /// Gives splats all that a plan leaves of the budget, where strips share passes. That is less than one strip would need: that
    /// plan, of less work, did not fit.
    fn give_places(&self, plan: &mut Plan) {
        let budget = self.budget;
        // Who asks for a number of strips wants the memory that it takes; slabs are of one strip each.
        if plan.n_strips > 1 && budget.strips == Strips::Auto && budget.overflow == Overflow::LeaveOut {
            let Plan { shape, placement, .. } = plan;
            shape.frame.max_splats = u32::MAX;
            shape.frame.max_splats = shape.splats_within(*placement, [budget.ram_bytes, budget.slow_bytes]);
            [plan.scratch_len, plan.slow_len] = shape.lens(*placement);
        }
    }

    /// The numbers of strips and the residencies that the budget leaves open, one strip first.
    fn variants(&self) -> impl Iterator<Item = (u8, Residency)> {
        let strips = match &self.budget.strips {
            Strips::Exactly(given) => slice::from_ref(given),
            Strips::Auto if self.budget.overflow == Overflow::Slabs => &STRIPS,
            Strips::Auto => &MOST_STRIPS_FIRST,
        };
        let bakeable = self.bundle.n_gaussians(0).is_some();
        let residencies = match &self.budget.residency {
            Residency::Auto if bakeable => &[Residency::Baked, Residency::Resident, Residency::Streamed][..],
            Residency::Auto => &[Residency::Resident, Residency::Streamed],
            Residency::AutoWithSums if bakeable => {
                &[Residency::Baked, Residency::AutoWithSums, Residency::Resident, Residency::Streamed]
            }
            Residency::AutoWithSums => &[Residency::AutoWithSums, Residency::Resident, Residency::Streamed],
            given => slice::from_ref(given),
        };
        // Sums go before one strip: what strips repeat beside the heads is not counted.
        let may_sum = move |n_strips| n_strips == 1 || strips.len() == 1;
        strips
            .iter()
            .flat_map(move |&n_strips| residencies.iter().map(move |&residency| (n_strips, residency)))
            .filter(move |&(n_strips, residency)| residency != Residency::AutoWithSums || may_sum(n_strips))
    }

    /// A plan with its predicted cost.
    // Not inlined: a plan is too long to be moved by halves.
    #[inline(never)]
    fn variant(
        &self,
        n_tiers: u8,
        n_strips: u8,
        residency: Residency,
        weights: HeadWeights,
        placement: Placement,
    ) -> (u64, Plan) {
        let Self { bundle, budget } = *self;
        let header = bundle.header();
        let tier = bundle.up_to_tier(n_tiers);
        let measures = self.measures(n_tiers);
        let in_slabs = budget.overflow == Overflow::Slabs;
        let canvas_tiles = if in_slabs { tiles_of_strip([budget.width_px, budget.height_px], n_strips) } else { 1 };
        let resident = self.resident(residency, n_tiers, tier, weights);
        // Gaussians are evaluated once, with weights in f32.
        let weights = if resident.is_gaussians() { HeadWeights::F32 } else { weights };
        let wanted = self.splats_to_hold(budget.max_splats, n_tiers, n_strips, weights);
        let mut shape =
            ScratchShape::of(bundle, resident, FrameShape { canvas_tiles, max_splats: wanted, shared_chunks: 0 });
        if budget.two_painters {
            shape.frame.shared_chunks = tier.n_chunks.max(1);
            // What was measured is shared; what is always enough for one may be needed by either.
            if budget.max_splats == MaxSplats::Measured && measures.is_some() {
                // Chunks that are decoded are shared out whole, of others an anchor is.
                let of_a_chunk = wanted.checked_div(tier.n_chunks).unwrap_or(wanted);
                let whole = if resident == Resident::Nothing { of_a_chunk } else { header.n_offsets.into() };
                shape.frame.max_splats = half_with_reserve(wanted, whole);
            }
        }
        shape.model.head_weights = weights;
        if !budget.quality.detail {
            shape.model.detail_hidden = 0;
        }
        if in_slabs {
            shape.frame.max_splats =
                shape.splats_within(placement, [budget.ram_bytes, budget.slow_bytes]).max(wanted.min(MIN_SLAB_SPLATS));
        }
        // Each slab but the last keeps at least half of the places.
        let fullest = match budget.max_splats {
            MaxSplats::AtMost(_) => self.splats_to_hold(MaxSplats::Measured, n_tiers, n_strips, weights),
            MaxSplats::Measured | MaxSplats::Worst => wanted,
        };
        let places = shape.frame.max_splats.max(1);
        let n_slabs = if !in_slabs || fullest <= places { 1 } else { fullest.saturating_mul(2).div_ceil(places) };
        let passes = u64::from(n_strips).saturating_mul(n_slabs.into());
        let [scratch_len, slow_len] = shape.lens(placement);
        let plan = Plan {
            budget: *budget,
            n_tiers,
            n_strips,
            n_slabs,
            shape,
            placement,
            scratch_len,
            slow_len,
            least_splats: shape.frame.max_splats,
            pruning_rate: 1.0 - tier.n_anchors as f32 / header.n_anchors.max(1) as f32,
            work: measures.map(|m| Work::most(&m, header.training_px, budget, passes, &shape)),
        };
        let (head_macs, n_decoded) = match measures {
            Some(measures) => {
                (u64::from(measures.max_head_kilo_macs).saturating_mul(1024), measures.max_decoded_anchors)
            }
            None => {
                let (heads, k) = (shape.heads(), usize::from(header.n_offsets));
                let per_anchor = heads.opacity_macs(k).saturating_add(heads.open_macs(k)) as u64;
                (per_anchor.saturating_mul(tier.n_anchors.into()), tier.n_anchors)
            }
        };
        let decoding = decoding_macs(bundle).saturating_mul(n_decoded.into());
        let once = match resident {
            Resident::Gaussians { n_gaussians, .. } if cfg!(feature = "baked") => {
                READING_MACS.saturating_mul(n_gaussians.into())
            }
            Resident::Gaussians { .. } | Resident::Anchors { .. } => shape.evaluated_macs(head_macs),
            Resident::Nothing => head_macs.saturating_add(decoding),
        };
        let times = u64::from(n_slabs).saturating_mul(if n_strips > 1 { 2 } else { 1 });
        (once.saturating_mul(times), plan)
    }

    /// What a residency keeps in memory of the first `n_tiers` tiers, which `tier` sums up.
    fn resident(&self, residency: Residency, n_tiers: u8, tier: Tier, weights: HeadWeights) -> Resident {
        let Tier { n_anchors, n_chunks, .. } = tier;
        match residency {
            _ if n_chunks == 0 => Resident::Nothing,
            Residency::Baked if cfg!(feature = "baked") => {
                let n_gaussians = self.bundle.n_gaussians(n_tiers).unwrap_or_default();
                Resident::Gaussians { n_gaussians, n_chunks }
            }
            Residency::AutoWithSums | Residency::Resident => {
                let with_sums =
                    cfg!(feature = "baked") && residency == Residency::AutoWithSums && weights == HeadWeights::F32;
                Resident::Anchors { n_anchors, n_chunks, with_sums }
            }
            _ => Resident::Nothing,
        }
    }

    /// What the manifest says about the first `n_tiers` tiers, if they were measured.
    fn measures(&self, n_tiers: u8) -> Option<TierMeasures> {
        self.bundle.measures(n_tiers.checked_sub(1)?).filter(|measures| measures.n_cameras > 0)
    }

    /// Splats of a strip to have memory for.
    fn splats_to_hold(&self, max_splats: MaxSplats, n_tiers: u8, n_strips: u8, weights: HeadWeights) -> u32 {
        let header = self.bundle.header();
        // At most 2²⁴ anchors of 32 offsets.
        let offsets = self.bundle.up_to_tier(n_tiers).n_anchors.saturating_mul(header.n_offsets.into());
        // Counted with weights in f32; halves may open another offset.
        let counted = self.bundle.n_gaussians(n_tiers).filter(|_| weights == HeadWeights::F32);
        let worst = counted.unwrap_or(offsets);
        match max_splats {
            MaxSplats::Worst => worst,
            MaxSplats::AtMost(most) => most.min(worst),
            MaxSplats::Measured => match self.measures(n_tiers) {
                None => worst,
                Some(measures) => {
                    let [_, training_height_px] = header.training_px;
                    let most = fullest_strip(&measures, training_height_px, self.budget.height_px, n_strips);
                    with_reserve(most).min(worst)
                }
            },
        }
    }
}

/// Places for so many measured splats and a sixteenth more; a manifest may have measured views without any.
fn with_reserve(n_splats: u32) -> u32 {
    n_splats.saturating_add(n_splats.div_ceil(16)).max(Budget::MIN_SLAB_PLACES)
}

/// Places of one of two painters that share so many splats, `whole` of which they cannot divide.
fn half_with_reserve(n_splats: u32, whole: u32) -> u32 {
    // At most 2²⁴ anchors of 32 offsets.
    n_splats.div_ceil(2).wrapping_add(n_splats / 16).wrapping_add(whole).wrapping_add(1).min(n_splats)
}

/// Tiles of a strip.
fn tiles_of_strip([width_px, height_px]: [u16; 2], n_strips: u8) -> u32 {
    let rows = height_px.div_ceil(TILE_PX).div_ceil(u16::from(n_strips).max(1));
    u32::from(rows).saturating_mul(width_px.div_ceil(TILE_PX).into())
}

/// Splats of the fullest strip of the finest cut that was measured whose strips are as high a part of their frame as those of
/// `n_strips` strips of a frame of `height_px`: whole rows of tiles make up different parts of different frames. At the
/// training size that is the cut itself, which matters because finer strips can be fuller where they straddle a border of
/// coarser ones.
fn fullest_strip(measures: &TierMeasures, training_height_px: u16, height_px: u16, n_strips: u8) -> u32 {
    let rows = |height_px: u16, n_strips: u8| height_px.div_ceil(TILE_PX).div_ceil(u16::from(n_strips).max(1));
    let part = |height_px: u16, n_strips: u8| {
        let strip_px = u32::from(rows(height_px, n_strips)).saturating_mul(TILE_PX.into()).min(height_px.into());
        (strip_px, u32::from(height_px).max(1))
    };
    let (strip_px, frame_px) = part(height_px, n_strips);
    let as_high = |&(measured_strips, _): &(u8, u32)| {
        let (measured_px, measured_frame_px) = part(training_height_px, measured_strips);
        // As products of two 16-bit numbers, the parts compare without rounding.
        measured_px.saturating_mul(frame_px) >= strip_px.saturating_mul(measured_frame_px)
    };
    let measured = STRIPS.into_iter().zip(measures.max_strip_splats);
    // The last one counts. (Going backwards through pairs would link a panic.)
    measured.filter(as_high).fold(measures.max_splats, |_, (_, splats)| splats)
}

#[cfg(test)]
mod tests {
    use super::{TierMeasures, fullest_strip, with_reserve};

    #[test]
    fn strips_count_as_those_measured_that_are_as_high() {
        let measures = TierMeasures {
            psnr_db: None,
            n_views: 0,
            n_cameras: 1,
            max_visible_anchors: 0,
            max_splats: 100,
            max_strip_splats: [100, 60, 70, 30],
            max_strip_pairs: [0; 4],
            max_head_kilo_macs: 0,
            max_kilo_pixels: 0,
            max_decoded_anchors: 0,
            level: 0,
        };
        let splats = |height_px, n_strips| fullest_strip(&measures, 200, height_px, n_strips);
        assert_eq!([1, 2, 4, 8].map(|n| splats(200, n)), [100, 60, 70, 30], "each cut at the size measured");
        assert_eq!(splats(200, 3), 60, "a third fits in a half");
        // 13 rows of tiles in eight strips are two a strip, 16 % of the frame; of 112 pixels one row is 14 %, of 96 17 %.
        assert_eq!([splats(112, 8), splats(96, 8)], [30, 70], "one row of few is a larger part");
        assert_eq!(splats(16, 8), 100, "a frame of one row is one strip");
    }

    #[test]
    fn there_are_places_to_draw_in_slabs_whatever_was_measured() {
        assert_eq!([0, 1, 16, 17, u32::MAX].map(with_reserve), [2, 2, 17, 19, u32::MAX]);
    }
}
