//! One number for the pixels of a frame, drawn with weights of either width.

use core::convert::Infallible;

use pocketsplat_core::{
    Budget, Bundle, DecodeError, Decoder, HeadWeights, MaxSplats, Plan, Residency, Strips, Tile, TileSink,
};

use super::digest::Digest;

/// Digests of the frame that a bundle's preview camera sees, tile by tile: with weights of the heads in f32, and in halves.
///
/// Gaussians are baked if they are the same in every frame, otherwise anchors are streamed. Halves come by the plan for one byte fewer;
/// baked Gaussians are evaluated with f32 in any case, and the second number repeats the first.
///
/// * `scratch`: as many bytes as a plan of that, of one strip and every splat takes.
///
/// # Errors
/// The decoder's; [`DecodeError::Internal`] where one byte fewer does not plan for halves.
pub fn frame_digests(bundle: &Bundle<'_>, scratch: &mut [u8]) -> Result<[Digest; 2], DecodeError> {
    let camera = bundle.header().preview;
    let residency = if bundle.n_gaussians(0).is_some() { Residency::Baked } else { Residency::Streamed };
    let budget = Budget::for_frame(camera.width_px, camera.height_px)
        .with_max_splats(MaxSplats::Worst)
        .with_residency(residency)
        .with_strips(Strips::Exactly(1));
    let mut drawn = |plan: Plan| {
        let mut tiles = Tiles(Digest::EMPTY);
        Decoder::bind(bundle, plan, &mut *scratch)?.render(&camera, &mut tiles)?;
        Ok::<_, DecodeError>(tiles.0)
    };
    let whole = Plan::new(bundle, &budget)?;
    let single = drawn(whole)?;
    if whole.is_baked() {
        return Ok([single, single]);
    }
    let halves = Plan::new(bundle, &budget.in_bytes(whole.scratch_len() - 1))?;
    if halves.head_weights() != HeadWeights::F16 || halves.n_tiers() != whole.n_tiers() {
        return Err(DecodeError::Internal);
    }
    Ok([single, drawn(halves)?])
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
