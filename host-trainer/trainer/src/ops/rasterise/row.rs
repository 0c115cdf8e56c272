//! The arithmetic of one row of a tile: alpha, transmittance, the stop rule.

use pocketsplat_core::rules::{ALPHA_MAX, TRANSMITTANCE_MIN};

use crate::ops::project::{ALPHA_CUTOFF, Splat};
use crate::ops::tiles::TILE_PX;
use crate::real::Real;

/// One row of a tile: one vector.
pub(super) type Row<R> = [R; TILE_PX];

/// Rows `first..end` of a tile that a splat of this vertical reach has pixel centres in.
#[inline(always)]
pub(super) fn rows<R: Real>(mean_y: R, half_extent_y: R, tile_y: usize) -> (usize, usize) {
    let centre: f64 = Into::<f64>::into(mean_y) - tile_y as f64 - 0.5;
    let half: f64 = half_extent_y.into();
    // The extent is rounded; the cutoff compares alpha.
    let half = half + half * 1e-5 + 1e-4;
    let limit = TILE_PX as f64;
    let first = (centre - half).larger(-1.0).smaller(limit);
    let end = (centre + half).larger(-1.0).smaller(limit);
    #[expect(clippy::cast_possible_truncation, reason = "1 to 17 after the shift by 2")]
    let bounds = ((first + 2.0) as i32, (end + 2.0) as i32);
    // ceil(first) and floor(end) + 1, with the shift taken off; truncation is floor for what is positive.
    let first = bounds.0 - 2 + i32::from(f64::from(bounds.0) < first + 2.0);
    (first.max(0) as usize, (bounds.1 - 1).clamp(0, TILE_PX as i32) as usize)
}

/// Alpha along one row, before the stop rule; zero where it is not drawn.
///
/// Also gives exp(power) and dx − shear·dy for the backward pass.
#[inline(always)]
pub(super) fn alpha_row<R: Real>(splat: &Splat<R>, dx0: R, dy: R) -> (Row<R>, Row<R>, Row<R>) {
    let (half, sheared) = (R::real(-0.5) * splat.row_precision, dx0 - splat.shear * dy);
    let constant = R::real(-0.5) * splat.column_precision * dy * dy;
    let (mut alpha, mut bell, mut dx) = ([R::ZERO; TILE_PX], [R::ZERO; TILE_PX], [R::ZERO; TILE_PX]);
    for i in 0..TILE_PX {
        dx[i] = sheared + R::real(i as f64);
        let power = constant + half * dx[i] * dx[i];
        bell[i] = power.larger(R::real(-80.0)).exp();
        let raw = splat.opacity * bell[i];
        alpha[i] = if raw < R::real(ALPHA_CUTOFF) { R::ZERO } else { raw.smaller(R::real(ALPHA_MAX)) };
    }
    (alpha, bell, dx)
}

/// Whether an ellipse's bounding box brought up a row that the ellipse does not reach.
#[inline(always)]
pub(super) fn draws_nothing<R: Real>(alpha: &Row<R>) -> bool {
    let mut any = false;
    for a in alpha {
        any |= *a > R::ZERO;
    }
    !any
}

/// Applies the stop rule to one row: gives the weights T·α and moves T on.
///
/// A stopped pixel keeps its transmittance with a negative sign.
#[inline(always)]
pub(super) fn step_row<R: Real>(alpha: &mut Row<R>, transmittance: &mut Row<R>) -> Row<R> {
    let mut weight = [R::ZERO; TILE_PX];
    for i in 0..TILE_PX {
        let t = transmittance[i];
        let after = t * (R::ONE - alpha[i]);
        let live = t > R::ZERO;
        let draws = live & (after >= R::real(TRANSMITTANCE_MIN));
        alpha[i] = if draws { alpha[i] } else { R::ZERO };
        weight[i] = alpha[i] * t;
        transmittance[i] = if draws {
            after
        } else if live {
            -t
        } else {
            t
        };
    }
    weight
}

/// How many splats go by between two looks for rows that have stopped; looking costs as much as a row.
pub(super) const LOOK_EVERY: usize = 8;

/// Marks rows in which every pixel has stopped; says whether all have. Skipping them changes no pixel.
#[inline(always)]
pub(super) fn mark_dead<R: Real>(transmittance: &[Row<R>; TILE_PX], dead: &mut [bool; TILE_PX]) -> bool {
    let mut all = true;
    for (row, dead) in transmittance.iter().zip(dead) {
        *dead = *dead
            || !(reduce(
                row,
                #[inline(always)]
                |a, b| a.larger(b),
            ) > R::ZERO);
        all &= *dead;
    }
    all
}

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
