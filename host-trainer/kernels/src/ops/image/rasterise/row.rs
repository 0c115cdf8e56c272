//! The arithmetic of one row of a tile: alpha, transmittance, the stop rule.

use std::hint::select_unpredictable;

use pocketsplat_format::rules::{ALPHA_MAX, TRANSMITTANCE_MIN};

use crate::ops::image::project::{ALPHA_CUTOFF, Splat};
use crate::ops::image::tiles::TILE_PX;
use crate::real::Real;

/// One row of a tile: one vector.
pub(super) type Row<R> = [R; TILE_PX];

/// The rows of a tile as one splat sees them.
pub(super) struct SplatRows<R> {
    /// From the splat's centre to that of each row, pixels.
    pub(super) dy: Row<R>,
    /// From the ellipse's middle in each row to the centre of the tile's first column, pixels.
    sheared: Row<R>,
    /// The part of power = −½(p·dx² + k·dy²) that a row has in common.
    constant: Row<R>,
    /// −½p.
    half: R,
    /// One bit a row: whether the splat may draw a pixel of it.
    pub(super) reached: u32,
}

/// How much lower than at the cutoff the power of a row's best pixel may be: far more than rounding takes off.
const POWER_SLACK: f64 = 1e-3;

impl<R: Real> SplatRows<R> {
    /// * `reach`: −2·power where alpha falls to the cutoff. * `x`: centre of the tile's first column. * `ys`: centres of its rows.
    #[inline(always)]
    pub(super) fn new(splat: &Splat<R>, reach: R, x: R, ys: &Row<R>) -> Self {
        let dx0 = x - splat.mean_px[0];
        let half = R::real(-0.5) * splat.row_precision;
        let lowest = R::real(-0.5) * reach - R::real(POWER_SLACK);
        let last = R::real((TILE_PX - 1) as f64);
        let (mut dy, mut sheared, mut constant) = ([R::ZERO; TILE_PX], [R::ZERO; TILE_PX], [R::ZERO; TILE_PX]);
        let mut reached = 0;
        for y in 0..TILE_PX {
            dy[y] = ys[y] - splat.mean_px[1];
            sheared[y] = dx0 - splat.shear * dy[y];
            constant[y] = R::real(-0.5) * splat.column_precision * dy[y] * dy[y];
            // The place in the row that is closest to the ellipse's middle.
            let nearest = sheared[y] + (-sheared[y]).larger(R::ZERO).smaller(last);
            let best = constant[y] + half * nearest * nearest;
            reached |= u32::from(best >= lowest) << y;
        }
        Self { dy, sheared, constant, half, reached }
    }

    /// Alpha along a row, before the stop rule; zero where it is not drawn.
    ///
    /// Also gives exp(power) and dx for the backward pass.
    #[inline(always)]
    pub(super) fn alpha(&self, y: usize, opacity: R) -> (Row<R>, Row<R>, Row<R>) {
        let (half, sheared, constant) = (self.half, self.sheared[y], self.constant[y]);
        let (mut alpha, mut bell, mut dx) = ([R::ZERO; TILE_PX], [R::ZERO; TILE_PX], [R::ZERO; TILE_PX]);
        for i in 0..TILE_PX {
            dx[i] = sheared + R::real(i as f64);
            let power = constant + half * dx[i] * dx[i];
            bell[i] = power.larger(R::real(-80.0)).exp();
            let raw = opacity * bell[i];
            alpha[i] = select_unpredictable(raw < R::real(ALPHA_CUTOFF), R::ZERO, raw.smaller(R::real(ALPHA_MAX)));
        }
        (alpha, bell, dx)
    }
}

/// The numbers of the bits that are set, ascending.
#[inline(always)]
pub(super) fn set_bits(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(
        #[inline(always)]
        move || {
            let y = (bits != 0).then_some(bits.trailing_zeros() as usize & (TILE_PX - 1))?;
            bits &= bits - 1;
            Some(y)
        },
    )
}

/// Applies the stop rule to one row: gives the weights T·α and moves T on.
///
/// A stopped pixel keeps its transmittance with a negative sign.
#[inline(always)]
pub(super) fn step_row<R: Real>(alpha: &mut Row<R>, transmittance: &mut Row<R>) -> Row<R> {
    let mut weight = [R::ZERO; TILE_PX];
    for i in 0..TILE_PX {
        let t = transmittance[i];
        // Negative for a stopped pixel, too.
        let after = t * (R::ONE - alpha[i]);
        let draws = after >= R::real(TRANSMITTANCE_MIN);
        alpha[i] = select_unpredictable(draws, alpha[i], R::ZERO);
        weight[i] = alpha[i] * t;
        transmittance[i] = select_unpredictable(draws, after, -t.abs());
    }
    weight
}

/// How many splats go by between two looks for rows that have stopped; looking costs as much as a row.
pub(super) const LOOK_EVERY: usize = 8;

/// The rows of `live`, one bit each, in which a pixel has not stopped. Skipping the others changes no pixel.
#[inline(always)]
pub(super) fn live_rows<R: Real>(live: u32, transmittance: &[Row<R>; TILE_PX]) -> u32 {
    let mut left = 0;
    for y in set_bits(live) {
        let mut any = false;
        for t in &transmittance[y] {
            any |= *t > R::ZERO;
        }
        left |= u32::from(any) << y;
    }
    left
}

/// All rows of a tile.
pub(super) const ALL_ROWS: u32 = (1 << TILE_PX) - 1;

/// Combines the lanes in a fixed tree, which vectorises.
#[inline(always)]
pub(super) fn reduce<R: Real>(row: &Row<R>, combine: impl Fn(R, R) -> R) -> R {
    let mut lanes = *row;
    let mut width = TILE_PX / 2;
    while width > 0 {
        for i in 0..width {
            lanes[i] = combine(lanes[i], lanes[i + width]);
        }
        width /= 2;
    }
    lanes[0]
}
