//! Counting the Gaussians of a scene, for the writer of its bundle.

use pocketsplat_format::bundle::MAX_TIERS;
use pocketsplat_format::{Bundle, DecodeError};

use super::bind;
use crate::budget::{FrameShape, Placement, Regions, Resident, SceneMemory, ScratchShape};

/// Bytes of memory that [`count_gaussians`] takes.
#[must_use]
pub fn count_scratch_len(bundle: &Bundle<'_>) -> usize {
    shape(bundle).bind_len()
}

/// Counts the Gaussians of the scene of each tier and those before it, as they are when [baked](crate::Residency::Baked);
/// what a writer puts into the bundle. Of a scene whose heads see the view the numbers mean nothing.
///
/// # Errors
/// [`DecodeError::ScratchTooSmall`]; [`DecodeError::NotBakeable`] without the feature `baked`; [`DecodeError::ChunkChecksum`] or
/// [`DecodeError::ChunkStream`] for damage.
///
/// # Budget
/// [`count_scratch_len`] bytes of `scratch`. Decodes and evaluates every anchor.
pub fn count_gaussians(bundle: &Bundle<'_>, scratch: &mut [u8]) -> Result<[u32; MAX_TIERS as usize], DecodeError> {
    let shape = shape(bundle);
    let mut regions = Regions::new(scratch, &mut [], Placement::FAST);
    let SceneMemory::Baked { baked, anchor, models } = SceneMemory::take(&shape, &mut regions)? else {
        return Err(DecodeError::NotBakeable);
    };
    let baker = bind::evaluate_scene(bundle, &shape, baked, anchor, models, false)?;
    let mut counts = [0; MAX_TIERS as usize];
    for (tier, count) in (1..).zip(&mut counts) {
        *count = baker.n_of_first(bundle.up_to_tier(tier).n_chunks);
    }
    Ok(counts)
}

/// Memory that keeps no Gaussian.
fn shape(bundle: &Bundle<'_>) -> ScratchShape {
    let resident = Resident::Gaussians { n_gaussians: 0, n_chunks: bundle.n_chunks() };
    ScratchShape::of(bundle, resident, FrameShape { canvas_tiles: 1, max_splats: 0, shared_chunks: 0 })
}
