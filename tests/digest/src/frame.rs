//! One number for the pixels of a frame.

use core::convert::Infallible;

use pocketsplat_core::{Budget, Bundle, DecodeError, Decoder, MaxSplats, Residency, Strips, TileSink};

use super::digest::Digest;

/// Digest of the frame that a bundle's preview camera sees, tile by tile.
///
/// Gaussians are baked if they are the same in every frame, otherwise anchors are streamed.
///
/// * `scratch`: as many bytes as a plan of that, of one strip and every splat takes.
///
/// # Errors
/// The decoder's.
pub fn frame_digest(bundle: &Bundle<'_>, scratch: &mut [u8]) -> Result<Digest, DecodeError> {
    let camera = bundle.header().preview;
    let residency = if bundle.n_gaussians(0).is_some() { Residency::Baked } else { Residency::Streamed };
    let budget = Budget::for_frame(camera.width_px, camera.height_px)
        .with_max_splats(MaxSplats::Worst)
        .with_residency(residency)
        .with_strips(Strips::Exactly(1));
    let mut tiles = Tiles(Digest::EMPTY);
    Decoder::bind(bundle, bundle.plan(&budget)?, scratch)?.render(&camera, &mut tiles)?;
    Ok(tiles.0)
}

struct Tiles(Digest);

impl TileSink for Tiles {
    type Error = Infallible;

    fn tile(&mut self, x_px: u16, y_px: u16, width: u16, height: u16, rgb: &[[u8; 3]]) -> Result<(), Infallible> {
        self.0.add([x_px, y_px, width, height].into_iter().flat_map(u16::to_le_bytes));
        self.0.add(rgb.as_flattened().iter().copied());
        Ok(())
    }
}
