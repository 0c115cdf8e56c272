//! How far apart points are, and the voxel size that follows.

use glam::DVec3;
use rayon::prelude::*;

/// The voxel size the family publishes for Synthetic-NeRF, whose points are random: it only must be fine.
pub const PUBLISHED_VOXEL_SIZE: f64 = 0.001;

/// The voxel size for rooms whose points are random (`docs/experiments/2026-11-27-layout-is-not-a-scene.md`): a room reaches
/// farther than an object between its cameras, and a finer lattice leaves it holes that anchors do not grow into.
pub const ROOM_VOXEL_SIZE: f64 = 0.01;

/// The voxel size that keeps about every second point of a sparse cloud apart from its nearest neighbour: the median
/// distance from a point to the nearest point elsewhere, in the points' units.
///
/// A distance: the published automatic rule takes the median of mean *squared* distances as a length, so its voxels
/// depend on the unit (of points 0.01 apart it makes voxels of 0.0001, of the same points in millimetres 100). Falls
/// back to [`PUBLISHED_VOXEL_SIZE`] where fewer than two places are occupied.
///
/// Work: O(n log n), whatever the distribution.
pub fn suggested_voxel_size(points: &[DVec3]) -> f64 {
    let mut places: Vec<DVec3> = points.iter().copied().filter(|p| p.is_finite()).collect();
    places.sort_by(|a, b| {
        a.to_array()
            .iter()
            .zip(b.to_array())
            .fold(std::cmp::Ordering::Equal, |order, (a, b)| order.then(a.total_cmp(&b)))
    });
    places.dedup();
    let mut squared: Vec<f64> = nearest_squared::<1>(&places).into_iter().map(|[nearest]| nearest).collect();
    let middle = squared.len() / 2;
    if squared.len() < 2 {
        return PUBLISHED_VOXEL_SIZE;
    }
    let (_, median, _) = squared.select_nth_unstable_by(middle, f64::total_cmp);
    if *median > 0.0 && median.is_finite() { median.sqrt() } else { PUBLISHED_VOXEL_SIZE }
}

/// Squared distances of every point to its `N` nearest others, ascending; infinite where there are fewer.
///
/// A k-d tree, so that far outliers cost nothing: O(n log n).
pub fn nearest_squared<const N: usize>(points: &[DVec3]) -> Vec<[f64; N]> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    arrange(points, &mut order, 0);
    let nearest = |i: usize| {
        let mut best = [f64::INFINITY; N];
        search(points, &order, 0, i, &mut best);
        best
    };
    (0..points.len()).into_par_iter().map(nearest).collect()
}

/// Puts the median along the axis of this level in the middle, the smaller before it, and so on in both parts.
fn arrange(points: &[DVec3], order: &mut [usize], axis: usize) {
    if order.len() < 2 {
        return;
    }
    let middle = order.len() / 2;
    order.select_nth_unstable_by(middle, |&a, &b| points[a][axis].total_cmp(&points[b][axis]));
    let (before, after) = order.split_at_mut(middle);
    arrange(points, before, (axis + 1) % 3);
    arrange(points, &mut after[1..], (axis + 1) % 3);
}

/// Adds to `best` what lies in this part of the tree nearer to point `of`, skipping where no point can.
fn search<const N: usize>(points: &[DVec3], order: &[usize], axis: usize, of: usize, best: &mut [f64; N]) {
    let middle = order.len() / 2;
    let Some(&at) = order.get(middle) else { return };
    let squared = points[of].distance_squared(points[at]);
    if at != of && squared < best[N - 1] {
        best[N - 1] = squared;
        best.sort_unstable_by(f64::total_cmp);
    }
    let beyond = points[of][axis] - points[at][axis];
    let (before, after) = (&order[..middle], &order[middle + 1..]);
    let (near, far) = if beyond < 0.0 { (before, after) } else { (after, before) };
    search(points, near, (axis + 1) % 3, of, best);
    if beyond * beyond < best[N - 1] {
        search(points, far, (axis + 1) % 3, of, best);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::normalise::random_points_world;

    #[test]
    fn the_tree_agrees_with_the_search_over_all_pairs() {
        let mut points = random_points_world(400, 3);
        points.push(DVec3::splat(1e6));
        points.push(points[7]);
        for (i, found) in nearest_squared::<3>(&points).into_iter().enumerate() {
            let others = points.iter().enumerate().filter(|(j, _)| *j != i);
            let mut all: Vec<f64> = others.map(|(_, q)| points[i].distance_squared(*q)).collect();
            all.sort_by(f64::total_cmp);
            assert_eq!(found, [all[0], all[1], all[2]], "point {i}");
        }
    }

    #[test]
    fn a_grid_has_its_edge_as_voxel_size_in_any_unit() {
        let grid = |edge: f64| -> Vec<DVec3> {
            let axis = || (0..6).map(move |i| f64::from(i) * edge);
            axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| DVec3::new(x, y, z)))).collect()
        };
        for edge in [0.01, 3.0, 1000.0] {
            assert!((suggested_voxel_size(&grid(edge)) / edge - 1.0).abs() < 1e-9, "{edge}");
        }
        let mut doubled = grid(2.0);
        doubled.extend(grid(2.0));
        doubled.push(DVec3::NAN);
        assert!((suggested_voxel_size(&doubled) - 2.0).abs() < 1e-9, "coinciding points are one place");
    }

    #[test]
    fn too_few_places_fall_back() {
        assert_eq!(suggested_voxel_size(&[]), PUBLISHED_VOXEL_SIZE);
        assert_eq!(suggested_voxel_size(&[DVec3::ONE; 9]), PUBLISHED_VOXEL_SIZE);
    }
}
