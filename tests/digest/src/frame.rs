//! One number for the pixels of a frame, drawn with weights of either width, and without an FPU.

use core::convert::Infallible;

use pocketsplat_core::{
    Arithmetic, Budget, Bundle, DecodeError, Decoder, HeadWeights, MaxSplats, Plan, ReferenceArithmetic, Residency,
    Strips, Tile, TileSink, WithoutFpu,
};

use super::digest::Digest;

/// Digests of the frame that a bundle's preview camera sees, tile by tile: with weights of the heads in f32, in halves, and by [`WithoutFpu`].
///
/// Gaussians are baked if they are the same in every frame, otherwise anchors are streamed. Halves come by the plan for one byte fewer;
/// baked Gaussians are evaluated with f32 in any case, and the second number repeats the first.
///
/// * `scratch`: as many bytes as a plan of that, of one strip and every splat takes.
///
/// # Errors
/// The decoder's; [`DecodeError::Internal`] where one byte fewer does not plan for halves.
pub fn frame_digests(bundle: &Bundle<'_>, scratch: &mut [u8]) -> Result<[Digest; 3], DecodeError> {
    let camera = bundle.header().preview;
    let residency = if bundle.n_gaussians(0).is_some() { Residency::Baked } else { Residency::Streamed };
    let budget = Budget::for_frame(camera.width_px, camera.height_px)
        .with_max_splats(MaxSplats::Worst)
        .with_residency(residency)
        .with_strips(Strips::Exactly(1));
    let whole = Plan::new(bundle, &budget)?;
    let single = digest_of::<ReferenceArithmetic>(bundle, whole, scratch)?;
    let without_fpu = digest_of::<WithoutFpu>(bundle, whole, scratch)?;
    if whole.is_baked() {
        return Ok([single, single, without_fpu]);
    }
    let halves = Plan::new(bundle, &budget.in_bytes(whole.scratch_len() - 1))?;
    if halves.head_weights() != HeadWeights::F16 || halves.n_tiers() != whole.n_tiers() {
        return Err(DecodeError::Internal);
    }
    Ok([single, digest_of::<ReferenceArithmetic>(bundle, halves, scratch)?, without_fpu])
}

fn digest_of<A: Arithmetic>(bundle: &Bundle<'_>, plan: Plan, scratch: &mut [u8]) -> Result<Digest, DecodeError> {
    let mut tiles = Tiles(Digest::EMPTY);
    Decoder::bind_in::<A>(bundle, plan, scratch)?.render(&bundle.header().preview, &mut tiles)?;
    Ok(tiles.0)
}

struct Tiles(Digest);

impl TileSink for Tiles {
    type Error = Infallible;

    fn tile(&mut self, Tile { x_px, y_px, width, height, rgb, .. }: Tile<'_>) -> Result<(), Infallible> {
        self.0.add([x_px, y_px, width, height].into_iter().flat_map(u16::to_le_bytes));
        self.0.add(rgb.as_flattened().iter().copied());
        Ok(())
    }
}
