//! Where a scene starts: one anchor per occupied lattice cell, heads drawn at random.

use std::collections::BTreeSet;

use glam::DVec3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::{Anchors, Heads, ModelShape, Scene};
use crate::ops::Real;

/// Squared distances below this are lifted to it before the logarithm.
const MIN_SQUARED_SPACING: f64 = 1e-7;

/// Builds the starting scene from points (Scaffold-GS; section 1.2 and 1.3 of the method notes).
///
/// Anchors sit at unique(round(p/ε))·ε in lexicographic order; offsets and features are 0; all six log-scales are
/// ln √(mean squared distance to the three nearest anchors); heads are drawn from U(−1/√n_in, 1/√n_in).
pub fn initial_scene(shape: ModelShape, voxel_size: f64, points: &[DVec3], rng: &mut ChaCha8Rng) -> Scene<f32> {
    let cells: BTreeSet<[i32; 3]> = points.iter().map(|p| lattice_cell(*p, voxel_size)).collect();
    let lattice: Vec<[i32; 3]> = cells.into_iter().collect();
    let positions: Vec<DVec3> = lattice.iter().map(|c| DVec3::from(c.map(f64::from)) * voxel_size).collect();
    let log_scales = mean_squared_spacing(&positions)
        .into_iter()
        .flat_map(|squared| [f32::real(0.5 * squared.max(MIN_SQUARED_SPACING).ln()); 6])
        .collect();
    let n = lattice.len();
    let anchors = Anchors {
        lattice,
        features: vec![0.0; n * shape.feature_dim],
        log_scales,
        offsets: vec![0.0; n * shape.n_offsets * 3],
    };
    let mut heads = Heads::filled(&shape, 0.0f32);
    for head in heads.each_mut() {
        let fans = [head.n_in, head.n_in, head.n_hidden, head.n_hidden];
        for (group, fan_in) in head.groups_mut().into_iter().zip(fans) {
            let bound = f32::real(1.0 / (fan_in as f64).sqrt());
            for weight in group {
                *weight = rng.random_range(-bound..bound);
            }
        }
    }
    Scene { shape, voxel_size, anchors, heads }
}

/// The lattice cell nearest to a point, ties to even.
pub fn lattice_cell(point: DVec3, cell_size: f64) -> [i32; 3] {
    #[expect(clippy::cast_possible_truncation, reason = "scenes are a few thousand cells wide; the cast saturates")]
    let cell = (point / cell_size).to_array().map(|c| c.round_ties_even() as i32);
    cell
}

/// Mean squared distance of every point to its three nearest others; fewer where there are fewer.
///
/// Cells of a uniform grid of about two points each, searched in growing rings: O(n) for points that fill their volume.
pub fn mean_squared_spacing(points: &[DVec3]) -> Vec<f64> {
    let (Some(first), n) = (points.first(), points.len()) else { return Vec::new() };
    let (low, high) = points.iter().fold((*first, *first), |(low, high), p| (low.min(*p), high.max(*p)));
    let extent = (high - low).max_element().max(1e-12);
    let cells = ((n as f64 / 2.0).cbrt().ceil()).clamp(1.0, 256.0);
    let edge = extent / cells * (1.0 + 1e-9);
    #[expect(clippy::cast_possible_truncation, reason = "1 to 256 cells an axis")]
    let side = cells as i64;
    #[expect(clippy::cast_possible_truncation, reason = "at most 256")]
    let cell_of = |p: DVec3| ((p - low) / edge).to_array().map(|c| (c as i64).clamp(0, side - 1));
    #[expect(clippy::cast_sign_loss, clippy::cast_possible_truncation, reason = "clamped above")]
    let index = |c: [i64; 3]| ((c[0] * side + c[1]) * side + c[2]) as usize;
    #[expect(clippy::cast_sign_loss, clippy::cast_possible_truncation, reason = "at most 256³ cells")]
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); (side * side * side) as usize];
    for (i, p) in points.iter().enumerate() {
        members[index(cell_of(*p))].push(i);
    }
    let nearest_three = |i: usize| {
        let (p, home) = (points[i], cell_of(points[i]));
        let mut best = [f64::INFINITY; 3];
        for ring in 0..side {
            // Everything within `ring` cells has been seen: nothing outside is nearer than ring − 1 edges … stop.
            let seen = (ring - 1).max(0) as f64 * edge;
            if best[2] <= seen * seen {
                break;
            }
            let around = |axis: usize| (home[axis] - ring).max(0)..=(home[axis] + ring).min(side - 1);
            for x in around(0) {
                for y in around(1) {
                    for z in around(2) {
                        let at = [x, y, z];
                        if (0..3).all(|a| (at[a] - home[a]).abs() < ring) {
                            continue;
                        }
                        for j in members[index(at)].iter().filter(|j| **j != i) {
                            let d = p.distance_squared(points[*j]);
                            if d < best[2] {
                                best[2] = d;
                                best.sort_unstable_by(f64::total_cmp);
                            }
                        }
                    }
                }
            }
        }
        let found: Vec<f64> = best.into_iter().filter(|d| d.is_finite()).collect();
        if found.is_empty() { 0.0 } else { found.iter().sum::<f64>() / found.len() as f64 }
    };
    (0..n).into_par_iter().map(nearest_three).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::finite_difference::random;
    use rand::SeedableRng;

    #[test]
    fn spacing_agrees_with_the_search_over_all_pairs() {
        let points: Vec<DVec3> = random(1, 900).chunks_exact(3).map(DVec3::from_slice).collect();
        for (i, found) in mean_squared_spacing(&points).into_iter().enumerate() {
            let mut all: Vec<f64> = points
                .iter()
                .enumerate()
                .filter(|(j, _)| *j != i)
                .map(|(_, q)| points[i].distance_squared(*q))
                .collect();
            all.sort_by(f64::total_cmp);
            let expected = all[..3].iter().sum::<f64>() / 3.0;
            assert!((found - expected).abs() < 1e-12, "point {i}: {found} against {expected}");
        }
        assert_eq!(mean_squared_spacing(&[DVec3::ONE]), [0.0]);
    }

    #[test]
    fn one_anchor_per_cell_in_lexicographic_order() {
        let shape = crate::train::TrainConfig::default().shape;
        let points = [DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.0, 0.31, 0.0), DVec3::new(0.01, 0.29, 0.0)];
        let scene = initial_scene(shape, 0.1, &points, &mut ChaCha8Rng::seed_from_u64(1));
        assert_eq!(scene.anchors.lattice, [[0, 3, 0], [5, 0, 0]]);
        let expected = 0.5 * (0.25f64 + 0.09).ln();
        assert!((f64::from(scene.anchors.log_scales[0]) - expected).abs() < 1e-6);
        assert!(scene.heads.opacity.w1.iter().all(|w| w.abs() <= 1.0 / 35f32.sqrt()));
    }
}
