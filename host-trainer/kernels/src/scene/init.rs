//! Where a scene starts: one anchor per occupied lattice cell, heads drawn at random.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use glam::DVec3;
use pocketsplat_format::bundle::{MAX_LATTICE_BITS, MAX_LATTICE_MIN};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::{Anchors, Head, Heads, INITIAL_MASK_LOGIT, ModelShape, Scene};
use crate::real::Real;
use pocketsplat_capture::dataset::nearest_squared;

/// Squared distances below this are lifted to it before the logarithm.
const MIN_SQUARED_SPACING: f64 = 1e-7;

/// Share of a bundle's lattice that the points may span; the rest is for anchors that grow beyond them.
const SPANNED_SHARE: f64 = 0.99;
/// Share of it that anchors may grow into; the rest is for a lowest corner on a coarser lattice.
const GROWN_SHARE: f64 = 0.999;
/// The widest span of cells of a bundle's lattice.
const LATTICE_SPAN: u32 = (1 << MAX_LATTICE_BITS) - 1;

/// The smallest voxel edge at which `points` fit the lattice of a bundle, in their units; 0 without points.
pub fn least_voxel_size(points: &[DVec3]) -> f64 {
    if points.is_empty() {
        return 0.0;
    }
    let [low, high] = points
        .iter()
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], point| [low.min(*point), high.max(*point)]);
    let of_span = (high - low).max_element() / f64::from(LATTICE_SPAN);
    let of_distance = low.abs().max(high.abs()).max_element() / f64::from(MAX_LATTICE_MIN);
    of_span.max(of_distance) / SPANNED_SHARE
}

/// The cells that anchors may grow into, along each axis: around the middle of `cells`, as many as the lattice of a bundle holds.
pub fn lattice_room(cells: &[[i32; 3]]) -> [RangeInclusive<i32>; 3] {
    #[expect(clippy::cast_possible_truncation, reason = "far below 2³¹")]
    let half = (0.5 * GROWN_SHARE * f64::from(LATTICE_SPAN)) as i32;
    let limit = MAX_LATTICE_MIN.cast_signed();
    std::array::from_fn(|axis| {
        let along = cells.iter().map(|cell| cell[axis]);
        let middle = along.clone().min().unwrap_or_default().midpoint(along.max().unwrap_or_default());
        middle.saturating_sub(half).max(-limit)..=middle.saturating_add(half).min(limit)
    })
}

/// Builds the starting scene from points (Lu et al. 2024, Scaffold-GS, section 3.1).
///
/// Anchors sit at unique(round(p/ε))·ε in lexicographic order; offsets and features are 0; all log-scales are
/// ln √(mean squared distance to the three nearest anchors); heads are drawn from U(−1/√n_in, 1/√n_in), but all opacities begin
/// above 0, and the head of detail ends in zeros, so that it adds nothing at first.
pub fn initial_scene(shape: ModelShape, voxel_size: f64, points: &[DVec3], rng: &mut ChaCha8Rng) -> Scene<f32> {
    let cells: BTreeSet<[i32; 3]> = points.iter().map(|p| lattice_cell(*p, voxel_size)).collect();
    let lattice: Vec<[i32; 3]> = cells.into_iter().collect();
    let positions: Vec<DVec3> = lattice.iter().map(|c| DVec3::from(c.map(f64::from)) * voxel_size).collect();
    let log_scales = mean_squared_spacing(&positions)
        .flat_map(|squared| {
            std::iter::repeat_n(f32::real(0.5 * squared.max(MIN_SQUARED_SPACING).ln()), shape.n_log_scales())
        })
        .collect();
    let n = lattice.len();
    let anchors = Anchors {
        lattice,
        features: vec![0.0; n * shape.feature_dim],
        log_scales,
        offsets: vec![0.0; n * shape.n_offsets * 3],
        mask_logits: vec![f32::real(INITIAL_MASK_LOGIT); n * shape.n_offsets],
        prune_rank: Vec::new(),
        view_weights: Vec::new(),
    };
    let mut heads = Heads::filled(&shape, 0.0f32);
    // A stream of its own: with a detail head or without, everything else begins and grows alike.
    let mut of_detail = rng.clone();
    of_detail.set_stream(2);
    let names: Vec<_> = heads.names().collect();
    for (name, head) in names.into_iter().zip(heads.each_mut()) {
        let rng = if name == "detail" { &mut of_detail } else { &mut *rng };
        let fans = [head.n_in, head.n_in, head.n_hidden, head.n_hidden];
        for (group, fan_in) in head.groups_mut().into_iter().zip(fans) {
            let bound = f32::real(1.0 / (fan_in as f64).sqrt());
            for weight in group {
                *weight = rng.random_range(-bound..bound);
            }
        }
    }
    if let Some(detail) = &mut heads.detail {
        detail.w2.fill(0.0);
        detail.b2.fill(0.0);
    }
    draw_all_at_first(&mut heads.opacity);
    Scene { shape, voxel_size, anchors, heads, context: None }
}

/// Turns the biases of the opacity head, so that no opacity begins below 0 where features and what the head sees of the view are 0.
///
/// An offset whose opacity is below 0 is not drawn and learns nothing. With random opacity signs, two to four of ten offsets were
/// never drawn by any anchor of the finished scene (`docs/experiments/2026-11-25-positive-opacity-initialisation.md`).
fn draw_all_at_first(opacity: &mut Head<f32>) {
    let rows = opacity.w2.chunks_exact(opacity.n_hidden).zip(&mut opacity.b2);
    for (row, bias) in rows {
        let hidden: f32 = row.iter().zip(&opacity.b1).map(|(w, b)| w * b.max(0.0)).sum();
        *bias = (hidden + *bias).abs() - hidden;
    }
}

/// The lattice cell nearest to a point, ties to even.
pub fn lattice_cell(point: DVec3, cell_size: f64) -> [i32; 3] {
    #[expect(clippy::cast_possible_truncation, reason = "scenes are a few thousand cells wide; the cast saturates")]
    let cell = (point / cell_size).to_array().map(|c| c.round_ties_even() as i32);
    cell
}

/// Mean squared distance of every point to its three nearest others; fewer where there are fewer.
fn mean_squared_spacing(points: &[DVec3]) -> impl Iterator<Item = f64> {
    nearest_squared::<3>(points).into_iter().map(|nearest| {
        let (sum, n) =
            nearest.iter().filter(|d| d.is_finite()).fold((0.0, 0), |(sum, n), squared| (sum + squared, n + 1));
        sum / f64::from(n.max(1))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::random;
    use rand::SeedableRng;

    #[test]
    fn spacing_agrees_with_the_search_over_all_pairs() {
        let points: Vec<DVec3> = random(1, 900).chunks_exact(3).map(DVec3::from_slice).collect();
        for (i, found) in mean_squared_spacing(&points).enumerate() {
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
        assert_eq!(mean_squared_spacing(&[DVec3::ONE]).collect::<Vec<_>>(), [0.0]);
    }

    #[test]
    fn every_offset_begins_drawn() {
        let plain = ModelShape::plain(8, 10);
        for (seed, view_geometry) in (0..20).flat_map(|seed| [(seed, false), (seed, true)]) {
            let shape = ModelShape { view_geometry, ..plain };
            let Head { n_hidden, w2, b1, b2, .. } =
                initial_scene(shape, 0.1, &[DVec3::ZERO], &mut ChaCha8Rng::seed_from_u64(seed)).heads.opacity;
            for (row, bias) in w2.chunks_exact(n_hidden).zip(&b2) {
                let logit: f32 = row.iter().zip(&b1).map(|(w, b)| w * b.max(0.0)).sum::<f32>() + bias;
                assert!(logit > 0.0, "seed {seed}: {logit}");
            }
        }
    }

    #[test]
    fn one_anchor_per_cell_in_lexicographic_order() {
        let shape = ModelShape { view_colour: true, view_geometry: true, ..ModelShape::plain(32, 10) };
        let points = [DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.0, 0.31, 0.0), DVec3::new(0.01, 0.29, 0.0)];
        let scene = initial_scene(shape, 0.1, &points, &mut ChaCha8Rng::seed_from_u64(1));
        assert_eq!(scene.anchors.lattice, [[0, 3, 0], [5, 0, 0]]);
        let expected = 0.5 * (0.25f64 + 0.09).ln();
        assert!((f64::from(scene.anchors.log_scales[0]) - expected).abs() < 1e-6);
        assert!(scene.heads.opacity.w1.iter().all(|w| w.abs() <= 1.0 / 35f32.sqrt()));
    }
}
