//! Going over a scene once, when it is bound.

use pocketsplat_format::bundle::{AnchorModels, Chunk};
use pocketsplat_format::{Bundle, DecodeError};

use super::store::{BakedMemory, Baker};
use crate::functions::Reference;
use crate::mlp::F32;
use crate::scene::{Anchor, Evaluator, Gaussian, GaussianSink};

/// Evaluates the Gaussians of the first `n_chunks` chunks into `memory`.
///
/// * `models`, `evaluator`, `row`: not needed afterwards. Of the reference arithmetic, whatever frames are computed with: it runs
///   once, and the bundle's counts are of it. * `skip_damage`: leaves damaged chunks out and remembers which.
///
/// # Errors
/// [`DecodeError::ChunkChecksum`] or [`DecodeError::ChunkStream`] for damage that is not left out.
// Not inlined: a caller's stack frame would keep what only baking needs.
#[inline(never)]
pub(crate) fn bake<'b, 's>(
    bundle: &Bundle<'b>,
    n_chunks: usize,
    memory: BakedMemory<'s>,
    models: &mut AnchorModels<'b, '_>,
    (evaluator, row): (&mut Evaluator<'_, F32>, &mut [f32]),
    skip_damage: bool,
) -> Result<Baker<'s>, DecodeError> {
    let mut baker = Baker::new(memory);
    for chunk in bundle.chunks().take(n_chunks) {
        let first = baker.n;
        let is_damaged = match evaluate(bundle, &chunk, models, (evaluator, row), &mut baker) {
            Err(DecodeError::ChunkChecksum { .. } | DecodeError::ChunkStream { .. }) if skip_damage => true,
            result => result.map(|()| false)?,
        };
        baker.end_chunk(first, is_damaged);
    }
    Ok(baker)
}

fn evaluate<'b>(
    bundle: &Bundle<'b>,
    chunk: &Chunk<'b>,
    models: &mut AnchorModels<'b, '_>,
    (evaluator, row): (&mut Evaluator<'_, F32>, &mut [f32]),
    baker: &mut Baker<'_>,
) -> Result<(), DecodeError> {
    chunk.check()?;
    let header = bundle.header();
    let mut anchors = chunk.anchors(models);
    for _ in 0..chunk.n_anchors() {
        let site = anchors.site();
        anchors.values(row);
        let position = bundle.position(site.lattice);
        let anchor = Anchor::from_row::<Reference>(header, position, site.mask, row).ok_or(DecodeError::Internal)?;
        // Seen from anywhere.
        let eye = [0.0; 3];
        evaluator.visit::<Reference>(0, &anchor, (header.features.effects, eye), &mut (), baker);
    }
    anchors.finish()
}

impl GaussianSink for Baker<'_> {
    fn gaussian(&mut self, _: u32, _: usize, gaussian: &Gaussian) {
        self.push(gaussian);
    }
}
