//! Binding: the caller's memory taken apart, and the scene put into it.

use pocketsplat_format::bundle::{AnchorRecords, RecordMemory};
use pocketsplat_format::{Bundle, DecodeError, Region, saturate};

use super::Decoder;
use super::scratch::Scratch;
use super::source::{AnchorSource, Anchors, GaussianSource};
use super::splats::SplatStore;
use crate::arena::Arena;
use crate::arithmetic::Arithmetic;
use crate::bake::{BakedGaussians, BakedMemory, Baker, bake};
use crate::budget::{
    AnchorMemory, FrameMemory, ListMemory, ModelMemory, PainterMemory, Part, Plan, Regions, SceneMemory, ScratchShape,
    SumsMemory, TileMemory,
};
use crate::mlp::{F32, FeatureSums, HeadFormat, Heads};
use crate::scene::{Evaluator, Pair, Workspace};

impl<'b, 's, A: Arithmetic> Decoder<'b, 's, A> {
    /// Takes as much of the fast and the slow memory as the plan says, and prepares the scene in it.
    pub(super) fn bind_regions(
        bundle: &Bundle<'b>,
        plan: Plan,
        Scratch { fast, slow }: Scratch<'s>,
    ) -> Result<Self, DecodeError> {
        check_plan(bundle, &plan)?;
        let fast = front(fast, plan.scratch_len(), Region::Fast)?;
        let slow = front(slow, plan.slow_scratch_len(), Region::Slow)?;
        // Before anything else, in memory that is taken again after it: the deepest calls come while no result waits on the stack.
        read_chunks(bundle, &plan, [&mut *fast, &mut *slow])?;
        Self::prepare(bundle, plan, [fast, slow])
    }

    /// The same of two painters.
    pub(super) fn bind_two_regions(
        bundle: &Bundle<'b>,
        plan: Plan,
        Scratch { fast, slow }: Scratch<'s>,
    ) -> Result<[Self; 2], DecodeError> {
        check_plan_of_two(bundle, &plan)?;
        let fast = front(fast, plan.scratch_len(), Region::Fast)?;
        let slow = front(slow, plan.slow_scratch_len(), Region::Slow)?;
        read_chunks(bundle, &plan, [&mut *fast, &mut *slow])?;
        Self::prepare_two(bundle, plan, [fast, slow])
    }

    /// The decoder, after resident anchors were decoded.
    // Not inlined, here and below: a caller's stack frame would keep what only one of the steps needs.
    #[inline(never)]
    fn prepare(bundle: &Bundle<'b>, plan: Plan, [fast, slow]: [&'s mut [u8]; 2]) -> Result<Self, DecodeError> {
        let mut regions = Regions::new(fast, slow, plan.placement());
        let mut source = bind_scene(bundle, &plan, &mut regions);
        if let Ok(GaussianSource::Anchors(anchors)) = &mut source {
            anchors.fill_sums()?;
        }
        Self::of_parts(bundle, plan, source, regions)
    }

    /// The same of two painters.
    #[inline(never)]
    fn prepare_two(bundle: &Bundle<'b>, plan: Plan, [fast, slow]: [&'s mut [u8]; 2]) -> Result<[Self; 2], DecodeError> {
        let mut regions = Regions::new(fast, slow, plan.placement());
        let mut source = bind_scene(bundle, &plan, &mut regions)?;
        if let GaussianSource::Anchors(anchors) = &mut source {
            anchors.fill_sums()?;
        }
        let PainterMemory { anchors, frame } = PainterMemory::take(plan.shape(), &mut regions)?;
        let second = Self::of_memory(bundle, plan, source.shared(anchors)?, frame);
        Ok([Self::of_parts(bundle, plan, Ok(source), regions)?, second])
    }

    /// The decoder of a scene; what is left of `regions` is for frames.
    ///
    /// * `source`: not unpacked by the caller, whose stack frame would hold it twice.
    #[inline(never)]
    fn of_parts(
        bundle: &Bundle<'b>,
        plan: Plan,
        source: Result<GaussianSource<'b, 's, A::Heads>, DecodeError>,
        mut regions: Regions<'s>,
    ) -> Result<Self, DecodeError> {
        let source = source?;
        Ok(Self::of_memory(bundle, plan, source, FrameMemory::take(plan.shape(), &mut regions)?))
    }

    #[inline(always)]
    fn of_memory(
        bundle: &Bundle<'b>,
        plan: Plan,
        source: GaussianSource<'b, 's, A::Heads>,
        FrameMemory { tiles, splats, lists }: FrameMemory<'s>,
    ) -> Self {
        let (TileMemory { pixels, rgb, counts }, ListMemory { rects, order, spare, ends }) = (tiles, lists);
        let splats = SplatStore::new(splats.splats, rects, [order, spare, ends], counts);
        Self { bundle: *bundle, plan, source, pixels, rgb, splats }
    }
}

/// Whether `plan` is one of this bundle.
#[inline(never)]
fn check_plan(bundle: &Bundle<'_>, plan: &Plan) -> Result<(), DecodeError> {
    let needed = Plan::new(bundle, plan.budget())?;
    if !needed.draws_as(plan) {
        let [needed, planned] = [&needed, plan].map(Plan::len);
        return Err(DecodeError::PlanMismatch { needed, planned });
    }
    Ok(())
}

/// Whether it is one of two painters, in one strip.
fn check_plan_of_two(bundle: &Bundle<'_>, plan: &Plan) -> Result<(), DecodeError> {
    let budget = plan.budget();
    if *budget == budget.with_two_painters() {
        return check_plan(bundle, plan);
    }
    let needed = Plan::new(bundle, &budget.with_two_painters())?;
    let [needed, planned] = [&needed, plan].map(Plan::len);
    Err(DecodeError::PlanMismatch { needed, planned })
}

/// Compares the checksum of every chunk of the first `n_tiers`.
#[inline(never)]
fn check_chunks(bundle: &Bundle<'_>, n_tiers: u8) -> Result<(), DecodeError> {
    let n_chunks = bundle.up_to_tier(n_tiers).n_chunks;
    bundle.chunks().take(n_chunks as usize).try_for_each(|chunk| chunk.check())
}

/// The first `len` bytes of a region.
fn front(memory: &mut [u8], len: usize, region: Region) -> Result<&mut [u8], DecodeError> {
    let available = saturate(memory.len());
    memory.get_mut(..len).ok_or(DecodeError::ScratchTooSmall { region, needed: saturate(len), available })
}

/// Puts the scene into memory of `regions`, as far as `plan` keeps it there; resident anchors are there already.
#[inline(never)]
fn bind_scene<'b, 's, N: HeadFormat>(
    bundle: &Bundle<'b>,
    plan: &Plan,
    regions: &mut Regions<'s>,
) -> Result<GaussianSource<'b, 's, N>, DecodeError> {
    let (shape, skip_damage) = (plan.shape(), plan.budget().skips_damage);
    let (anchor, kept, sums) = match SceneMemory::take(shape, regions)? {
        // Unreachable without the feature; this arm drops the code.
        SceneMemory::Baked { .. } if !cfg!(feature = "baked") => return Err(DecodeError::Internal),
        SceneMemory::Baked { baked, anchor, models } => {
            return bind_baked(bundle, shape, baked, anchor, models, skip_damage).map(GaussianSource::Baked);
        }
        SceneMemory::Streamed { anchor, models } => (anchor, AnchorStorage::Models(models), None),
        SceneMemory::Resident { anchor, records, sums, .. } => (anchor, AnchorStorage::Anchors(records), Some(sums)),
    };
    let evaluator = evaluator(bundle, shape, anchor, sums, regions.of(Part::Tiles).borrow());
    anchors(bundle, shape, kept, evaluator)
}

/// What of anchors is in memory.
enum AnchorStorage<'s> {
    /// Nothing but what decodes them.
    Models(ModelMemory<'s>),
    /// They.
    Anchors(RecordMemory<'s>),
}

/// What evaluates anchors, and `[n_channels]` of one.
type EvaluatorAndRow<'s, N> = (Evaluator<'s, N>, &'s mut [f32]);

/// Anchors with the heads that make Gaussians of them.
///
/// * `evaluator`: not unpacked by the caller, whose stack frame would hold it twice.
#[inline(never)]
fn anchors<'b, 's, N: HeadFormat>(
    bundle: &Bundle<'b>,
    shape: &ScratchShape,
    kept: AnchorStorage<'s>,
    evaluator: Result<EvaluatorAndRow<'s, N>, DecodeError>,
) -> Result<GaussianSource<'b, 's, N>, DecodeError> {
    let (evaluator, row) = evaluator?;
    let source = match kept {
        AnchorStorage::Models(models) => AnchorSource::Streamed(bundle.anchor_models(models.words)?),
        AnchorStorage::Anchors(records) => {
            AnchorSource::Resident(AnchorRecords::new(bundle, shape.record_layout(), records)?)
        }
    };
    Ok(GaussianSource::Anchors(Anchors { source, row, evaluator }))
}

/// Gaussians that are evaluated once.
#[inline(never)]
fn bind_baked<'s>(
    bundle: &Bundle<'_>,
    shape: &ScratchShape,
    baked: BakedMemory<'s>,
    anchor: AnchorMemory<'_>,
    models: ModelMemory<'_>,
    skip_damage: bool,
) -> Result<BakedGaussians<'s>, DecodeError> {
    evaluate_scene(bundle, shape, baked, anchor, models, skip_damage)?.finish()
}

/// Converts the heads into memory of the anchor, and returns what evaluates anchors and `[n_channels]` of one.
///
/// * `free`: memory that is needed later, to work in.
#[inline(never)]
fn evaluator<'s, N: HeadFormat>(
    bundle: &Bundle<'_>,
    shape: &ScratchShape,
    memory: AnchorMemory<'s>,
    sums: Option<SumsMemory<'s>>,
    mut free: Arena<'_>,
) -> Result<EvaluatorAndRow<'s, N>, DecodeError> {
    let AnchorMemory { heads, row, inputs, hidden, detail_sums, outputs } = memory;
    let mut arena = Arena::of_words(heads);
    let heads = Heads::convert(&mut arena, &mut free, shape.model.head_weights, bundle.heads(), shape.heads());
    let work = Workspace { hidden, detail_sums, outputs };
    let sums = sums.filter(|_| N::READS_SUMS && shape.resident.has_sums());
    let sums = sums.map(|memory| FeatureSums::new(memory.sums, shape.heads().anchor_sums_len()));
    evaluator_of(heads, arena, shape, (inputs, row), (work, sums))
}

/// * `heads`: not unpacked by the caller, whose stack frame would hold it twice. * `arena`: what they left.
#[inline(never)]
fn evaluator_of<'s, N: HeadFormat>(
    heads: Result<Heads<'s, N>, DecodeError>,
    mut arena: Arena<'s>,
    shape: &ScratchShape,
    (inputs, row): (&'s mut [f32], &'s mut [f32]),
    (work, sums): (Workspace<'s>, Option<FeatureSums<'s>>),
) -> Result<EvaluatorAndRow<'s, N>, DecodeError> {
    let heads = heads?;
    let pair = if heads.takes_two() { Pair::take(&mut arena, shape.heads()) } else { None };
    Ok((Evaluator { heads, inputs, work, pair, sums }, row))
}

/// Decodes the planned tiers if they are resident, and if they are streamed compares their checksums; Gaussians are baked later.
#[inline(never)]
fn read_chunks(bundle: &Bundle<'_>, plan: &Plan, [fast, slow]: [&mut [u8]; 2]) -> Result<(), DecodeError> {
    let (shape, skip_damage) = (plan.shape(), plan.budget().skips_damage);
    let mut regions = Regions::new(fast, slow, plan.placement());
    match SceneMemory::take(shape, &mut regions)? {
        SceneMemory::Resident { anchor, mut records, models, .. } => {
            let n_chunks = shape.resident.n_chunks();
            records.decode(bundle, n_chunks, &shape.record_layout(), anchor.row, models.words, skip_damage)
        }
        SceneMemory::Streamed { .. } if !skip_damage => check_chunks(bundle, plan.n_tiers()),
        _ => Ok(()),
    }
}

/// Evaluates the Gaussians of the planned tiers into `baked`.
#[inline(never)]
pub(super) fn evaluate_scene<'s>(
    bundle: &Bundle<'_>,
    shape: &ScratchShape,
    baked: BakedMemory<'s>,
    anchor: AnchorMemory<'_>,
    models: ModelMemory<'_>,
    skip_damage: bool,
) -> Result<Baker<'s>, DecodeError> {
    let (mut evaluator, row) = evaluator::<F32>(bundle, shape, anchor, None, Arena::of_words(&mut []))?;
    let mut models = bundle.anchor_models(models.words)?;
    bake(bundle, shape.resident.n_chunks(), baked, &mut models, (&mut evaluator, row), skip_damage)
}
