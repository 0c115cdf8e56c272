//! The search for the plan that draws most of a scene within a budget, and of these the one of least work.

use core::slice;

use pocketsplat_format::bundle::{STRIPS, Tier, TierMeasures};
use pocketsplat_format::{Bundle, DecodeError, Region, saturate};

use super::Plan;
use super::places::{fullest_strip, half_with_reserve, tiles_of_strip, with_reserve};
use crate::budget::limits::{Budget, MaxSplats, Overflow, Residency, Strips};
use crate::budget::placement::Placement;
use crate::budget::shape::{FrameShape, Resident, ScratchShape};
use crate::budget::work::{Work, decoding_macs};
use crate::mlp::HeadWeights;

/// What reading a baked Gaussian is worth in multiply-adds.
const READING_MACS: u64 = 150;

/// Fewer splats to a slab are not planned.
const MIN_SLAB_SPLATS: u32 = 256;

/// [`STRIPS`] that share passes: the more there are to choose from, the fuller a pass.
const MOST_STRIPS_FIRST: [u8; STRIPS.len()] = [1, 8, 4, 2];

/// Compares the plans of one bundle within one budget.
pub(super) struct Planner<'p, 'b> {
    pub(super) bundle: &'p Bundle<'b>,
    pub(super) budget: &'p Budget,
}

impl Planner<'_, '_> {
    /// The plan of the most tiers that fits, and of least predicted work.
    pub(super) fn best(&self) -> Result<Plan, DecodeError> {
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
            pruning_rate: header.n_anchors.saturating_sub(tier.n_anchors) as f32 / header.n_anchors.max(1) as f32,
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
