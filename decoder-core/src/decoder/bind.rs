//! Binding: the caller's memory taken apart, and the scene put into it.

use super::Decoder;
use super::source::{AnchorSource, Anchors, GaussianSource};
use super::splats::SplatStore;
use crate::arena::Arena;
use crate::arithmetic::Arithmetic;
use crate::bake::{BakedMemory, Baker, bake};
use crate::budget::{
    AnchorMemory, FrameMemory, ListMemory, ModelMemory, Part, Plan, Regions, SceneMemory, ScratchShape, TileMemory,
};
use crate::bundle::{AnchorRecords, Bundle, RecordMemory};
use crate::error::{DecodeError, Region, saturate};
use crate::mlp::{F32, HeadFormat, Heads};
use crate::project::Packed28;
use crate::scene::{Evaluator, Pair, Workspace};

impl<'b, 's, A: Arithmetic> Decoder<'b, 's, A> {
    /// Takes as much of the fast and the slow memory as the plan says, and prepares the scene in it.
    // Not inlined, here and below: a caller's stack frame would keep what only one of the steps needs.
    #[inline(never)]
    pub(super) fn bind_with(
        bundle: &Bundle<'b>,
        plan: Plan,
        [fast, slow]: [&'s mut [u8]; 2],
        skip_damage: bool,
    ) -> Result<Self, DecodeError> {
        let needed = bundle.plan(plan.budget())?;
        if needed != plan {
            return Err(DecodeError::PlanMismatch {
                needed: saturate(needed.scratch_len()),
                planned: saturate(plan.scratch_len()),
            });
        }
        let fast = front(fast, plan.scratch_len(), Region::Fast)?;
        let slow = front(slow, plan.slow_scratch_len(), Region::Slow)?;
        let mut regions = Regions::new(fast, slow, plan.placement());
        let source = bind_scene(bundle, plan.shape(), &mut regions, skip_damage)?;
        let FrameMemory { tiles, splats, lists } = FrameMemory::take(plan.shape(), &mut regions)?;
        let (TileMemory { pixels, rgb, counts }, ListMemory { rects, order, spare }) = (tiles, lists);
        let splats = SplatStore { splats: records_in(splats.splats)?, rects, n: 0, order, spare, counts };
        Ok(Self { bundle: *bundle, plan, skip_damage, source, pixels, rgb, splats })
    }
}

/// The first `len` bytes of a region.
fn front(memory: &mut [u8], len: usize, region: Region) -> Result<&mut [u8], DecodeError> {
    let available = saturate(memory.len());
    memory.get_mut(..len).ok_or(DecodeError::ScratchTooSmall { region, needed: saturate(len), available })
}

/// Puts the scene into memory of `regions`, as far as `shape` keeps it there.
#[inline(never)]
fn bind_scene<'b, 's, N: HeadFormat>(
    bundle: &Bundle<'b>,
    shape: &ScratchShape,
    regions: &mut Regions<'s>,
    skip_damage: bool,
) -> Result<GaussianSource<'b, 's, N>, DecodeError> {
    match SceneMemory::take(shape, regions)? {
        // Unreachable without the feature; this arm drops the code.
        SceneMemory::Baked { .. } if !cfg!(feature = "baked") => Err(DecodeError::Internal),
        SceneMemory::Baked { baked, anchor, models } => {
            evaluate_scene(bundle, shape, baked, anchor, models, skip_damage)?.finish().map(GaussianSource::Baked)
        }
        SceneMemory::Streamed { anchor, models } => {
            let source = AnchorSource::Streamed(bundle.anchor_models(models.words)?);
            with_heads(bundle, shape, source, anchor, regions.of(Part::Tiles).borrow())
        }
        SceneMemory::Resident { anchor, records, models } => {
            let records = decode_anchors(bundle, shape, records, anchor.row, models, skip_damage)?;
            with_heads(bundle, shape, AnchorSource::Resident(records), anchor, regions.of(Part::Tiles).borrow())
        }
    }
}

/// Anchors with the heads that make Gaussians of them.
#[inline(never)]
fn with_heads<'b, 's, N: HeadFormat>(
    bundle: &Bundle<'b>,
    shape: &ScratchShape,
    source: AnchorSource<'b, 's>,
    anchor: AnchorMemory<'s>,
    free: Arena<'_>,
) -> Result<GaussianSource<'b, 's, N>, DecodeError> {
    let (evaluator, row) = evaluator(bundle, shape, anchor, free)?;
    Ok(GaussianSource::Anchors(Anchors { source, row, evaluator }))
}

/// Converts the heads into memory of the anchor, and returns what evaluates anchors and `[n_channels]` of one.
///
/// * `free`: memory that is needed later, to work in.
#[inline(never)]
fn evaluator<'s, N: HeadFormat>(
    bundle: &Bundle<'_>,
    shape: &ScratchShape,
    memory: AnchorMemory<'s>,
    mut free: Arena<'_>,
) -> Result<(Evaluator<'s, N>, &'s mut [f32]), DecodeError> {
    let AnchorMemory { heads, row, inputs, hidden, detail_sums, outputs } = memory;
    let mut arena = Arena::of_words(heads);
    let kept_as = N::KEPT_AS.unwrap_or(shape.model.head_weights);
    let heads = Heads::convert(&mut arena, &mut free, kept_as, bundle.heads(), shape.heads())?;
    let pair = if heads.takes_two() { Pair::take(&mut arena, shape.heads()) } else { None };
    let work = Workspace { hidden, detail_sums, outputs };
    Ok((Evaluator { heads, inputs, work, pair }, row))
}

/// Decodes the planned tiers into `records`.
///
/// * `row`: `[n_channels]`, for the symbols of the current anchor.
#[inline(never)]
fn decode_anchors<'b, 's>(
    bundle: &Bundle<'b>,
    shape: &ScratchShape,
    records: RecordMemory<'s>,
    row: &mut [f32],
    models: ModelMemory<'_>,
    skip_damage: bool,
) -> Result<AnchorRecords<'b, 's>, DecodeError> {
    let n_chunks = shape.resident.n_chunks();
    AnchorRecords::decode(bundle, n_chunks, shape.record_layout(), records, row, models.words, skip_damage)
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
    let (mut evaluator, row) = evaluator::<F32>(bundle, shape, anchor, Arena::of_words(&mut []))?;
    let mut models = bundle.anchor_models(models.words)?;
    bake(bundle, shape.resident.n_chunks(), baked, &mut models, (&mut evaluator, row), skip_damage)
}

/// The memory of splats as records of another size: as many as fit.
fn records_in<S: bytemuck::Pod>(splats: &mut [Packed28]) -> Result<&mut [S], DecodeError> {
    let words: &mut [u32] = bytemuck::try_cast_slice_mut(splats).map_err(|_| DecodeError::Internal)?;
    let words_each = size_of::<S>().div_ceil(4).max(1);
    let n_words = words.len() / words_each * words_each;
    bytemuck::try_cast_slice_mut(words.get_mut(..n_words).unwrap_or_default()).map_err(|_| DecodeError::Internal)
}
