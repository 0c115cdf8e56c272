//! Blends splats tile by tile, and takes the image's gradient back to them.
//!
//! Per pixel, front to back: α = min(0.99, o·exp(−½·dᵀ·Σ'⁻¹·d)), skipped below 1/255; the pixel stops before a splat
//! that would bring its transmittance below 1e-4; colour += T·α·c, T ← T·(1 − α); at the end colour += T·background
//! (Kerbl et al. 2023, eq. 3 and their constants).
//!
//! One row of a tile is one vector of [`TILE_PX`] lanes, and the same loop runs under AVX-512, AVX2 or the baseline,
//! chosen at run time. No multiplication is fused with an addition, so all of them give the same bits. Gradients go to
//! one slot per (tile, splat) pair and are summed per splat in tile order: no result depends on the number of threads.

mod backward;
mod count;
mod forward;
mod image;
mod row;
#[cfg(test)]
mod tests;

pub use backward::{background_gradient, backward, backward_through};
pub use count::{DrawCounts, count};
pub use forward::{forward, forward_into};
pub use image::TiledImage;

use super::project::{Footprint, Splat};
use super::tiles::{TILE_PX, TileLists};
use crate::real::Real;
use row::Row;

/// Values of one channel of a tile.
const TILE_VALUES: usize = TILE_PX * TILE_PX;

/// A splat in a tile.
#[derive(Clone, Copy)]
struct TileSplat<R> {
    splat: Splat<R>,
    /// −2·power where its alpha falls to the cutoff.
    reach: R,
}

/// What one tile draws, nearest first.
struct Tile<R> {
    /// Copies: gathered one after the other, so that the loads overlap, where the blending loop would wait for each.
    splats: Vec<TileSplat<R>>,
    /// Centre of its first column, and of its rows.
    x: R,
    ys: Row<R>,
}

impl<R: Real> Tile<R> {
    fn new(splats: &[Splat<R>], footprints: &[Footprint<R>], lists: &TileLists, t: usize) -> Self {
        let origin = [t % lists.grid[0] * TILE_PX, t / lists.grid[0] * TILE_PX];
        let gather = |entry: &u32| {
            let (splat, half) = (splats[*entry as usize], footprints[*entry as usize].half_extent_px[1]);
            TileSplat { splat, reach: half * splat.column_precision * half }
        };
        let centre = |p: usize| R::real(p as f64 + 0.5);
        let ys = std::array::from_fn(|y| centre(origin[1] + y));
        Self { splats: lists.tile(t).iter().map(gather).collect(), x: centre(origin[0]), ys }
    }
}
