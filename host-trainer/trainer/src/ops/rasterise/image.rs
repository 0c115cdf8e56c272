//! An image in the order of its tiles.

use rayon::prelude::*;

use super::TILE_VALUES;
use crate::ops::tiles::TILE_PX;
use crate::real::Real;

/// An image in tile order, as [`forward`](super::forward()) writes and [`backward`](super::backward()) reads it.
#[derive(Clone, Debug, Default)]
pub struct TiledImage<R> {
    /// `[n_tiles, 3, 16, 16]` colour, background included.
    pub colour: Vec<R>,
    /// `[n_tiles, 16, 16]` the share of the background that comes through, where an image was drawn.
    pub transmittance: Vec<R>,
}

/// Copies between tile order and planes `[3, height, width]`.
impl<R: Real> TiledImage<R> {
    /// An image of zeros for a grid of tiles.
    pub fn zeros(grid: [usize; 2]) -> Self {
        let n_pixels = grid[0] * grid[1] * TILE_VALUES;
        Self { colour: vec![R::ZERO; 3 * n_pixels], transmittance: vec![R::ZERO; n_pixels] }
    }

    /// Row-major planes `[3, height, width]`.
    pub fn to_planes(&self, size_px: [usize; 2]) -> Vec<R> {
        let [width, height] = size_px;
        let across = width.div_ceil(TILE_PX);
        let mut planes = vec![R::ZERO; 3 * width * height];
        planes.par_chunks_mut(width).enumerate().for_each(|(i, row)| {
            let (channel, y) = (i / height, i % height);
            for (tx, out) in row.chunks_mut(TILE_PX).enumerate() {
                let at = ((y / TILE_PX * across + tx) * 3 + channel) * TILE_VALUES + y % TILE_PX * TILE_PX;
                out.copy_from_slice(&self.colour[at..at + out.len()]);
            }
        });
        planes
    }

    /// The reverse of [`Self::to_planes`]; pixels beyond the image are zero.
    pub fn from_planes(planes: &[R], size_px: [usize; 2]) -> Self {
        let [width, height] = size_px;
        let grid = size_px.map(|s| s.div_ceil(TILE_PX));
        let mut image = Self::zeros(grid);
        image.colour.par_chunks_mut(TILE_VALUES).enumerate().for_each(|(i, tile)| {
            let (t, channel) = (i / 3, i % 3);
            let (x, y) = (t % grid[0] * TILE_PX, t / grid[0] * TILE_PX);
            let n = TILE_PX.min(width - x);
            for (dy, out) in tile.chunks_exact_mut(TILE_PX).enumerate().take(height - y) {
                let at = (channel * height + y + dy) * width + x;
                out[..n].copy_from_slice(&planes[at..at + n]);
            }
        });
        image
    }
}
