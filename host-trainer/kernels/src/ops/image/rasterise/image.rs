//! An image in the order of its tiles.

use rayon::prelude::*;

use super::TILE_VALUES;
use crate::ops::image::tiles::TILE_PX;
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
    /// Makes room for a grid of tiles; what is there stays.
    pub fn fit(&mut self, grid: [usize; 2]) {
        let n_pixels = grid[0] * grid[1] * TILE_VALUES;
        self.colour.resize(3 * n_pixels, R::ZERO);
        self.transmittance.resize(n_pixels, R::ZERO);
    }

    /// Row-major planes `[3, height, width]`.
    pub fn to_planes(&self, size_px: [usize; 2]) -> Vec<R> {
        let mut planes = Vec::new();
        self.write_planes(size_px, &mut planes);
        planes
    }

    /// [`Self::to_planes`] into a buffer.
    pub fn write_planes(&self, size_px: [usize; 2], planes: &mut Vec<R>) {
        let [width, height] = size_px;
        let across = width.div_ceil(TILE_PX);
        planes.resize(3 * width * height, R::ZERO);
        planes.par_chunks_mut(width).enumerate().for_each(|(i, row)| {
            let (channel, y) = (i / height, i % height);
            for (tx, out) in row.chunks_mut(TILE_PX).enumerate() {
                let at = ((y / TILE_PX * across + tx) * 3 + channel) * TILE_VALUES + y % TILE_PX * TILE_PX;
                out.copy_from_slice(&self.colour[at..at + out.len()]);
            }
        });
    }

    /// The reverse of [`Self::to_planes`]; pixels beyond the image are zero.
    pub fn from_planes(planes: &[R], size_px: [usize; 2]) -> Self {
        let mut image = Self::default();
        image.read_planes(planes, size_px);
        image
    }

    /// [`Self::from_planes`] into an image that is there.
    pub fn read_planes(&mut self, planes: &[R], size_px: [usize; 2]) {
        let [width, height] = size_px;
        let grid = size_px.map(|s| s.div_ceil(TILE_PX));
        self.fit(grid);
        self.colour.par_chunks_mut(TILE_VALUES).enumerate().for_each(|(i, tile)| {
            let (t, channel) = (i / 3, i % 3);
            let (x, y) = (t % grid[0] * TILE_PX, t / grid[0] * TILE_PX);
            let n = TILE_PX.min(width - x);
            for (dy, out) in tile.chunks_exact_mut(TILE_PX).enumerate() {
                let (inside, beyond) = out.split_at_mut(if y + dy < height { n } else { 0 });
                let at = (channel * height + y + dy) * width + x;
                inside.copy_from_slice(if inside.is_empty() { &[] } else { &planes[at..at + n] });
                beyond.fill(R::ZERO);
            }
        });
    }
}
