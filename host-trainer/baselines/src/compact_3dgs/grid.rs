//! Features of a place: a hash grid of many resolutions, interpolated (Müller et al. 2022, Instant-NGP, section 3).

use pocketsplat_capture::dataset::EXTENT;
use pocketsplat_format::context::{GridLevel, LevelKind, WEIGHT_ONE};
use pocketsplat_kernels::real::Real;
use rayon::prelude::*;

/// Resolutions.
const LEVELS: u32 = 16;
/// Nodes along an axis, of the coarsest and of the finest.
const COARSEST: f64 = 16.0;
const FINEST: f64 = 4096.0;
/// Numbers of a row.
pub(super) const CHANNELS: usize = 2;
/// Numbers of a place.
pub(super) const FEATURES: usize = LEVELS as usize * CHANNELS;

/// The resolutions, the same factor from each to the next.
///
/// * `log2_rows`: of the rows of a level at most; one with more nodes is hashed.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 16..=4096")]
pub(super) fn levels(log2_rows: u8) -> Vec<GridLevel> {
    let level = |i: u32| {
        let resolution = (COARSEST * (FINEST / COARSEST).powf(f64::from(i) / f64::from(LEVELS - 1))).round() as u16;
        let n_rows = u64::from(resolution).pow(3).min(1 << log2_rows) as u32;
        GridLevel { kind: LevelKind::Volume, resolution, n_rows }
    };
    (0..LEVELS).map(level).collect()
}

/// Rows of all levels.
pub(super) fn n_rows(levels: &[GridLevel]) -> usize {
    levels.iter().map(|level| level.n_rows as usize).sum()
}

/// A place in the unit cube: x within the ball of cameras, and (2 − 1/‖x‖)·x/‖x‖ beyond it, in units of its radius (Barron et al. 2022,
/// Mip-NeRF 360, eq. 10).
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0..=65535")]
pub(super) fn contracted(centre: [f32; 3]) -> [u16; 3] {
    let x = centre.map(|x| f64::from(x) / EXTENT);
    let length = x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let factor = if length > 1.0 { (2.0 - 1.0 / length) / length } else { 1.0 };
    x.map(|x| (65535.0 * (0.25 * factor * x + 0.5)).round() as u16)
}

/// Σ weight·row over the corners of every level.
///
/// * `rows`: of all levels.
#[inline]
pub(super) fn features<R: Real>(levels: &[GridLevel], rows: &[[R; CHANNELS]], unit: [u16; 3]) -> [R; FEATURES] {
    let mut features = [R::ZERO; FEATURES];
    let mut first = 0;
    for (level, out) in levels.iter().zip(features.as_chunks_mut::<CHANNELS>().0) {
        for (row, weight) in level.corners(unit).iter() {
            let share: R = share(weight);
            let row = rows[first + row as usize];
            (0..CHANNELS).for_each(|i| out[i] += share * row[i]);
        }
        first += level.n_rows as usize;
    }
    features
}

/// Gradient of [`features`]: levels in parallel, the places of each in order, so that sums do not depend on the number of threads.
///
/// * `d_rows`: overwritten.
pub(super) fn backward<R: Real>(
    levels: &[GridLevel],
    units: &[[u16; 3]],
    d_features: &[[R; FEATURES]],
    d_rows: &mut [[R; CHANNELS]],
) {
    let mut parts = Vec::with_capacity(levels.len());
    let mut rest = d_rows;
    for (i, level) in levels.iter().enumerate() {
        let (own, after) = rest.split_at_mut(level.n_rows as usize);
        parts.push((i, level, own));
        rest = after;
    }
    parts.into_par_iter().for_each(|(i, level, d_rows)| {
        d_rows.fill([R::ZERO; CHANNELS]);
        for (unit, d) in units.iter().zip(d_features) {
            for (row, weight) in level.corners(*unit).iter() {
                let share: R = share(weight);
                (0..CHANNELS).for_each(|c| d_rows[row as usize][c] += share * d[i * CHANNELS + c]);
            }
        }
    });
}

#[inline(always)]
fn share<R: Real>(weight: u32) -> R {
    R::real(f64::from(weight) / f64::from(WEIGHT_ONE))
}

#[cfg(test)]
mod tests {
    use pocketsplat_kernels::finite_difference::{assert_gradient, random};

    use super::*;

    #[test]
    fn backward_agrees_with_finite_differences() {
        let levels =
            [(5, 125), (90, 32)].map(|(resolution, n_rows)| GridLevel { kind: LevelKind::Volume, resolution, n_rows });
        let units = [[0, 30_000, 65_535], [1_000, 2, 3], [40_000, 50_000, 60_000]];
        let weights = random(3, 3 * FEATURES);
        let loss = |x: &[f64]| {
            let found = units.map(|unit| features(&levels, x.as_chunks().0, unit));
            found.as_flattened().iter().zip(&weights).map(|(f, w)| f * w).sum::<f64>()
        };
        let rows = random(4, CHANNELS * n_rows(&levels));
        let mut d_rows = vec![[9.0; CHANNELS]; n_rows(&levels)];
        backward(&levels, &units, weights.as_chunks().0, &mut d_rows);
        assert_gradient("grid", &rows, d_rows.as_flattened(), loss);
    }

    #[test]
    fn levels_grow_and_places_far_away_stay_in_the_cube() {
        let levels = levels(10);
        assert_eq!((levels[0].resolution, levels[15].resolution), (16, 4096));
        assert!(levels.iter().all(|level| level.n_rows == 1024));
        assert_eq!(super::levels(14)[0].n_rows, 4096, "dense");
        assert_eq!(contracted([0.0; 3]), [32768; 3]);
        assert_eq!(contracted([0.0, 5.0, -5.0 * 1e-4]), [32768, 49151, 32766]);
        assert!(contracted([1e9, 0.0, -1e9]).iter().all(|x| (9000..56_500).contains(x)));
    }
}
