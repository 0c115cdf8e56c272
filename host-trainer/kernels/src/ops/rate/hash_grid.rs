//! Features of a place: signs of a multi-resolution grid, interpolated.

use pocketsplat_format::context::{FEATURES_PER_LEVEL, GridLevel, WEIGHT_ONE};
use rayon::prelude::*;

use crate::real::Real;

/// Writes Σ weight·sign(row) over the corners of every level (Chen et al. 2024, HAC), the weights those of the
/// decoder: multiples of 2⁻²⁴ whose sums are exact in any order.
///
/// * `rows`: `[Σ n_rows, 4]`, level after level; a sign is + from 0 on. * `units`: `[n]` places in the unit cube.
/// * `features`: `[n, 4·levels]`, overwritten.
pub fn forward<R: Real>(levels: &[GridLevel], rows: &[R], units: &[[u16; 3]], features: &mut [R]) {
    for (unit, features) in units.iter().zip(features.chunks_exact_mut(levels.len() * FEATURES_PER_LEVEL)) {
        let mut first_row = 0;
        for (level, out) in levels.iter().zip(features.chunks_exact_mut(FEATURES_PER_LEVEL)) {
            let mut sums = [0i32; FEATURES_PER_LEVEL];
            for (row, weight) in level.corners(*unit).iter() {
                let at = (first_row + row as usize) * FEATURES_PER_LEVEL;
                let weight = weight.cast_signed();
                for (sum, value) in sums.iter_mut().zip(&rows[at..at + FEATURES_PER_LEVEL]) {
                    *sum += if *value >= R::ZERO { weight } else { -weight };
                }
            }
            for (out, sum) in out.iter_mut().zip(sums) {
                *out = R::real(f64::from(sum) / f64::from(WEIGHT_ONE));
            }
            first_row += level.n_rows as usize;
        }
    }
}

/// Some places and the gradients of their features, `[n, 4·levels]`.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a, R> {
    /// `[n]` places in the unit cube.
    pub units: &'a [[u16; 3]],
    /// `[n, 4·levels]`.
    pub d_features: &'a [R],
}

/// Gradients of [`forward`] through the signs: weight·dL/d(feature) where |row| ≤ 1, else 0 (straight through).
///
/// Levels are taken in parallel, the places of each in order, so the sums do not depend on the number of threads.
///
/// * `parts`: all places, in any cut. * `d_rows`: as `rows`, overwritten.
pub fn backward<R: Real>(levels: &[GridLevel], rows: &[R], parts: &[Part<'_, R>], d_rows: &mut [R]) {
    let width = levels.len() * FEATURES_PER_LEVEL;
    let mut of_levels = Vec::with_capacity(levels.len());
    let (mut rows, mut d_rows) = (rows, d_rows);
    for (index, level) in levels.iter().enumerate() {
        let len = level.n_rows as usize * FEATURES_PER_LEVEL;
        let (own, after) = rows.split_at(len);
        let (d_own, d_after) = d_rows.split_at_mut(len);
        of_levels.push((index, level, own, d_own));
        (rows, d_rows) = (after, d_after);
    }
    of_levels.into_par_iter().for_each(|(index, level, rows, d_rows)| {
        d_rows.fill(R::ZERO);
        let to_share = R::real(1.0 / f64::from(WEIGHT_ONE));
        for part in parts {
            for (unit, d_features) in part.units.iter().zip(part.d_features.chunks_exact(width)) {
                let d_features = &d_features[index * FEATURES_PER_LEVEL..(index + 1) * FEATURES_PER_LEVEL];
                for (row, weight) in level.corners(*unit).iter() {
                    let at = row as usize * FEATURES_PER_LEVEL;
                    let share = R::real(f64::from(weight)) * to_share;
                    for (d_row, d_feature) in d_rows[at..at + FEATURES_PER_LEVEL].iter_mut().zip(d_features) {
                        *d_row += share * *d_feature;
                    }
                }
            }
        }
        for (row, d_row) in rows.iter().zip(d_rows) {
            *d_row = if row.abs() <= R::ONE { *d_row } else { R::ZERO };
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::random;
    use pocketsplat_format::context::LevelKind;

    fn levels() -> Vec<GridLevel> {
        [
            (LevelKind::Volume, 5, 125),
            (LevelKind::Volume, 90, 64),
            (LevelKind::Xy, 9, 81),
            (LevelKind::Xz, 17, 32),
            (LevelKind::Yz, 3, 9),
        ]
        .map(|(kind, resolution, n_rows)| GridLevel { kind, resolution, n_rows })
        .to_vec()
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0..=65535")]
    fn units(n: usize) -> Vec<[u16; 3]> {
        random(3, 3 * n).chunks_exact(3).map(|v| std::array::from_fn(|i| (32767.5 * (v[i] + 1.0)) as u16)).collect()
    }

    /// The gradient is that of the signs: what turning a row over changes, by 2.
    #[test]
    fn backward_is_half_of_what_a_turned_sign_changes() {
        let (levels, units) = (levels(), units(30));
        let n_rows: usize = levels.iter().map(|l| l.n_rows as usize).sum();
        let mut rows: Vec<f64> = random(4, 4 * n_rows);
        rows[7] = 1.5;
        rows[8] = -1.0;
        let weights = random(5, units.len() * levels.len() * 4);
        let f = |rows: &[f64]| -> f64 {
            let mut features = vec![9.0; weights.len()];
            forward(&levels, rows, &units, &mut features);
            features.iter().zip(&weights).map(|(f, w)| f * w).sum()
        };
        let mut d_rows = vec![9.0; rows.len()];
        let cut = 11 * levels.len() * 4;
        let parts = [
            Part { units: &units[..11], d_features: &weights[..cut] },
            Part { units: &units[11..], d_features: &weights[cut..] },
        ];
        backward(&levels, &rows, &parts, &mut d_rows);
        let start = f(&rows);
        for i in 0..rows.len() {
            let mut turned = rows.clone();
            turned[i] = if rows[i] >= 0.0 { -0.5 } else { 0.5 };
            let expected = if rows[i].abs() > 1.0 { 0.0 } else { (f(&turned) - start) / (2.0 * turned[i].signum()) };
            assert!((d_rows[i] - expected).abs() < 1e-9, "row value {i}: {} against {expected}", d_rows[i]);
        }
    }

    #[test]
    fn equal_signs_make_a_feature_of_one() {
        let levels = levels();
        let n_rows: usize = levels.iter().map(|l| l.n_rows as usize).sum();
        for sign in [1.0f32, -1.0] {
            let mut features = vec![9.0; 20 * levels.len() * 4];
            forward(&levels, &vec![0.3 * sign; 4 * n_rows], &units(20), &mut features);
            assert!(features.iter().all(|f| *f == sign));
        }
        let mut features = vec![9.0f32; levels.len() * 4];
        forward(&levels, &vec![0.0; 4 * n_rows], &units(1), &mut features);
        assert!(features.iter().all(|f| *f == 1.0), "0 counts as +1");
    }
}
