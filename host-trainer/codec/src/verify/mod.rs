//! The memory contract as laws that any bundle can be held to.
//!
//! The conformance suite holds synthetic bundles to them, `pocketsplat verify` a user's own.

mod trial;

use pocketsplat_core::{
    Budget, Bundle, Camera, DecodeError, Decoder, FrameReport, HeadWeights, MaxSplats, Overflow, Plan, Region,
    Residency, Strips, Work,
};
use pocketsplat_format::bundle::STRIPS;

use pocketsplat_instructions::level::Level;

pub use trial::{Breach, Trial};

/// Content of the memory and bytes that it begins behind a word.
const FILLS: [(u8, usize); 5] = [(0x00, 0), (0xFF, 0), (0x5A, 1), (0x11, 2), (0xC3, 3)];

/// Every plan variant that draws what `budget` says that `bundle` has: residency and strips, whatever its limit of memory.
pub fn plan_variants(bundle: &Bundle<'_>, budget: Budget) -> impl Iterator<Item = Budget> + use<> {
    let strips = STRIPS.map(Strips::Exactly);
    let baked = bundle.n_gaussians(0).map(|_| Residency::Baked);
    baked
        .into_iter()
        .chain([Residency::AutoWithSums, Residency::Resident, Residency::Streamed])
        .flat_map(move |residency| strips.map(|strips| budget.with_residency(residency).with_strips(strips)))
        .map(|budget| budget.in_bytes(usize::MAX))
}

/// The plan of `variant` whose heads are halves, if that saves memory: with a byte too little for f32.
pub fn halves(bundle: &Bundle<'_>, variant: &Budget) -> Option<Plan> {
    let whole = Plan::new(bundle, variant).ok()?;
    let halves = Plan::new(bundle, &variant.in_bytes(whole.scratch_len().saturating_sub(1))).ok()?;
    (halves.head_weights() == HeadWeights::F16 && halves.n_tiers() == whole.n_tiers()).then_some(halves)
}

/// How much of its memory a frame used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Touched {
    /// Bytes that it wrote to.
    pub bytes: usize,
    /// Bytes that the decoder says it needed.
    pub mark: usize,
}

/// A law that does not hold, in words.
pub type Violation = String;

/// The planned bytes suffice, and fewer are refused with their number, whether or not damage is to be skipped.
///
/// # Errors
/// A sentence that says what happened instead.
pub fn exact_bytes(bundle: &Bundle<'_>, plan: Plan) -> Result<(), Violation> {
    let needed = plan.scratch_len();
    let mut scratch = vec![0; needed];
    let skipping = Plan::new(bundle, &plan.budget().skipping_damage()).map_err(|error| error.to_string())?;
    for plan in [plan, skipping] {
        let mut bind = |len: usize| Decoder::bind(bundle, plan, &mut scratch[..len]).err();
        if let Some(error) = bind(needed) {
            return Err(format!("{needed} bytes do not suffice: {error}"));
        }
        for available in [needed.saturating_sub(1), needed / 2, 0] {
            let [needed, len] = [needed, available].map(|n| n as u32);
            let (found, expected) =
                (bind(available), DecodeError::ScratchTooSmall { region: Region::Fast, needed, available: len });
            if found.as_ref() != Some(&expected) {
                return Err(format!("{available} bytes: expected {expected:?}, found {found:?}"));
            }
        }
    }
    Ok(())
}

/// Neither content nor alignment of the memory shows, nothing beside it is touched, and the decoder's mark of what it used
/// covers what it wrote and is no more than planned.
///
/// # Errors
/// A sentence that says what happened instead.
pub fn memory_does_not_show(bundle: &Bundle<'_>, plan: Plan, camera: &Camera) -> Result<Touched, Violation> {
    let trials = FILLS.map(|(fill, start)| Trial::run(bundle, plan, camera, fill, start));
    let mut sound = Vec::new();
    for trial in trials {
        sound.push(trial.map_err(|breach| breach.to_string())?);
    }
    let [zeros, ones, ..] = &sound[..] else { unreachable!("there are fills") };
    for ((fill, start), other) in FILLS.iter().zip(&sound) {
        if (&other.rgb, other.report) != (&zeros.rgb, zeros.report) {
            return Err(format!("memory filled with {fill:#04x} at {start} draws another frame"));
        }
    }
    // A byte that a frame writes has the same value after both; one that it leaves alone has the fill's.
    let n_touched = zeros.memory.iter().zip(&ones.memory).filter(|&(&a, &b)| (a, b) != (0x00, 0xFF)).count();
    let mark = zeros.report.scratch_used as usize;
    if n_touched > mark || mark > plan.scratch_len() {
        return Err(format!("{n_touched} bytes touched, {mark} reported, {} planned", plan.scratch_len()));
    }
    Ok(Touched { bytes: n_touched, mark })
}

/// Where anchors wait, in how many strips a frame is drawn and in how many slabs of depth changes no pixel.
///
/// # Errors
/// A sentence that says what happened instead.
pub fn variants_match(bundle: &Bundle<'_>, budget: Budget, camera: &Camera) -> Result<(), Violation> {
    let draw =
        |budget: &Budget| -> Result<Trial, Breach> { Trial::run(bundle, Plan::new(bundle, budget)?, camera, 0, 0) };
    let scene = |r: &FrameReport| (r.splats, r.tile_splats, r.pixel_splats);
    // With less memory for splats than the view has, what a strip has no place for differs between variants.
    let both_whole = |a: &Trial, b: &Trial| a.report.splats_dropped == 0 && b.report.splats_dropped == 0;
    let differ = |a: &Trial, b: &Trial| both_whole(a, b) && (&a.rgb, scene(&a.report)) != (&b.rgb, scene(&b.report));
    let expected = draw(&budget.in_bytes(usize::MAX)).map_err(|breach| breach.to_string())?;
    let mut expected_of_halves: Option<Trial> = None;
    for variant in plan_variants(bundle, budget) {
        let Budget { residency, strips, .. } = variant;
        let drawn = draw(&variant).map_err(|breach| format!("{residency:?}, {strips:?}: {breach}"))?;
        if differ(&drawn, &expected) {
            return Err(format!("{residency:?}, {strips:?}: another frame"));
        }
        if drawn.report.anchors_decoded > 0 && residency != Residency::Streamed {
            return Err(format!("{residency:?}, {strips:?}: decoded anchors that wait in memory"));
        }
        // A third of the places that the fullest strip asks for, or the fewest that there may be.
        let few = MaxSplats::AtMost((drawn.report.max_splats / 3).max(Budget::MIN_SLAB_PLACES));
        let in_slabs = draw(&variant.with_max_splats(few).with_overflow(Overflow::Slabs));
        let in_slabs = in_slabs.map_err(|breach| format!("{residency:?}, {strips:?}, slabs: {breach}"))?;
        if both_whole(&drawn, &expected) && both_whole(&drawn, &in_slabs) && in_slabs.rgb != expected.rgb {
            return Err(format!("{residency:?}, {strips:?}, {} slabs: another frame", in_slabs.report.slabs));
        }
        let Some(plan) = halves(bundle, &variant) else { continue };
        let drawn = Trial::run(bundle, plan, camera, 0, 0)
            .map_err(|breach| format!("{residency:?}, {strips:?}, heads in halves: {breach}"))?;
        let expected = expected_of_halves.get_or_insert_with(|| drawn.clone());
        if differ(&drawn, expected) {
            return Err(format!("{residency:?}, {strips:?}, heads in halves: another frame"));
        }
    }
    Ok(())
}

/// The scene up to tier number `tier` keeps every bound of a level.
///
/// # Errors
/// A sentence with the bounds that it does not keep.
pub fn keeps_level(bundle: &Bundle<'_>, tier: u8, number: u8) -> Result<(), Violation> {
    let Some(level) = Level::numbered(number) else { return Err(format!("there is no level {number}")) };
    let Some(needs) = level.needs(bundle, tier) else {
        return Err(format!("level {number}, tiers up to {tier}: the manifest is not measured"));
    };
    let over: Vec<String> = needs.iter().filter(|need| !need.is_kept()).map(ToString::to_string).collect();
    if over.is_empty() { Ok(()) } else { Err(format!("level {number}, tiers up to {tier}: {}", over.join("; "))) }
}

/// Every level that a tier in the file declares is kept by it, one result a declared level.
pub fn declared_levels(bundle: &Bundle<'_>) -> impl Iterator<Item = Result<(), Violation>> {
    let declared = (0..bundle.n_tiers()).filter_map(|tier| Some((tier, bundle.measures(tier)?.level)));
    declared.filter(|(_, level)| *level != 0).map(|(tier, level)| keeps_level(bundle, tier, level))
}

/// No frame takes more work than the plan says, if the plan says anything.
///
/// # Errors
/// A sentence that says what happened instead.
pub fn work_is_bounded(plan: Plan, work: &Work) -> Result<(), Violation> {
    let Some(bound) = plan.work() else { return Ok(()) };
    for (what, found, bound) in [
        ("multiply-adds of the heads", work.head_macs, bound.head_macs),
        ("decoded anchors", work.decoded_anchors, bound.decoded_anchors),
        ("pixel evaluations", work.pixel_splats, bound.pixel_splats),
    ] {
        if found > bound {
            return Err(format!("{found} {what}, at most {bound} were predicted"));
        }
    }
    Ok(())
}
