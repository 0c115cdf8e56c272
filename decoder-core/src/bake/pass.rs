//! Going over a scene once, when it is bound.

use super::store::{BakedMemory, Baker};
use crate::arithmetic::{Exact, F32, Precise};
use crate::budget::{Arena, ScratchShape};
use crate::bundle::{AnchorModels, Bundle, Chunk, MAX_TIERS};
use crate::error::DecodeError;
use crate::mlp::{HeadShape, Heads};
use crate::scene::{Anchor, Workspace, for_each_gaussian};

/// What evaluates anchors, in memory that is free again afterwards.
struct Evaluator<'b, 's> {
    bundle: Bundle<'b>,
    models: AnchorModels<'b, 's>,
    // Exact, whatever frames are computed with: it runs once, and the bundle's counts are of it.
    heads: Heads<'s, F32>,
    row: &'s mut [f32],
    work: Workspace<'s>,
}

/// Evaluates the Gaussians of the first `n_chunks` chunks into `memory`.
///
/// * `shape`: of the heads. * `arena`: memory to work in: heads, the anchor in work, models. * `skip_damage`: leaves damaged
///   chunks out and remembers which.
///
/// # Errors
/// [`DecodeError::ChunkChecksum`] or [`DecodeError::ChunkStream`] for damage that is not left out.
// Not inlined: a caller's stack frame would keep what only baking needs.
#[inline(never)]
pub(crate) fn bake<'s>(
    bundle: &Bundle<'_>,
    n_chunks: u32,
    memory: BakedMemory<'s>,
    shape: HeadShape,
    arena: &mut Arena<'_>,
    skip_damage: bool,
) -> Result<Baker<'s>, DecodeError> {
    let mut arena = arena.borrow();
    let mut evaluator = Evaluator {
        bundle: *bundle,
        heads: Heads::convert(&mut arena, bundle.heads(), shape)?,
        row: arena.take(bundle.header().n_channels())?,
        work: Workspace::take(&mut arena, shape)?,
        models: bundle.anchor_models(arena.take(bundle.anchor_scratch_words())?)?,
    };
    let mut baker = Baker::new(memory);
    for chunk in bundle.chunks().take(n_chunks as usize) {
        let first = baker.n;
        let is_damaged = match evaluator.evaluate(&chunk, &mut baker) {
            Err(DecodeError::ChunkChecksum { .. } | DecodeError::ChunkStream { .. }) if skip_damage => true,
            result => result.map(|()| false)?,
        };
        baker.end_chunk(first, is_damaged);
    }
    Ok(baker)
}

impl<'b> Evaluator<'b, '_> {
    fn evaluate(&mut self, chunk: &Chunk<'b>, baker: &mut Baker<'_>) -> Result<(), DecodeError> {
        chunk.check()?;
        let Self { bundle, models, heads, row, work } = self;
        let header = bundle.header();
        let mut anchors = chunk.anchors(models);
        for _ in 0..chunk.n_anchors() {
            let site = anchors.site();
            anchors.values(row);
            let position = bundle.position(site.lattice);
            let anchor = Anchor::from_row::<Precise>(header, position, site.mask, row).ok_or(DecodeError::Internal)?;
            // Seen from anywhere.
            let eye = [0.0; 3];
            for_each_gaussian::<Exact>(&anchor, header.features.effects, eye, heads, work, &mut (), |_, gaussian| {
                baker.push(gaussian);
            });
        }
        anchors.finish()
    }
}

impl Bundle<'_> {
    /// Bytes of memory that [`count_gaussians`](Self::count_gaussians) takes.
    #[must_use]
    pub fn count_scratch_len(&self) -> usize {
        let shape = ScratchShape::of_heads(self);
        Arena::bytes_for(shape.words_to_evaluate().saturating_add(self.n_starts())).unwrap_or(usize::MAX)
    }

    /// Counts the Gaussians of the scene of each tier and those before it, as they are when [baked](crate::Residency::Baked);
    /// what a writer puts into the bundle. Of a scene whose heads see the view the numbers mean nothing.
    ///
    /// # Errors
    /// [`DecodeError::ScratchTooSmall`]; [`DecodeError::ChunkChecksum`] or [`DecodeError::ChunkStream`] for damage.
    ///
    /// # Budget
    /// Decodes and evaluates every anchor.
    pub fn count_gaussians(&self, scratch: &mut [u8]) -> Result<[u32; MAX_TIERS as usize], DecodeError> {
        let mut arena = Arena::new(scratch);
        let memory = BakedMemory { records: &mut [], starts: arena.take(self.n_starts())? };
        let shape = ScratchShape::of_heads(self).heads();
        let baker = bake(self, self.n_chunks(), memory, shape, &mut arena, false)?;
        let mut counts = [0; MAX_TIERS as usize];
        for (tier, count) in (1..).zip(&mut counts) {
            *count = baker.n_of_first(self.up_to_tier(tier).n_chunks);
        }
        Ok(counts)
    }

    fn n_starts(&self) -> usize {
        (self.n_chunks() as usize).saturating_add(1)
    }
}
