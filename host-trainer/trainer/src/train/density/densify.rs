//! Growth of anchors where the image pulls, and pruning of those that show nothing.

use std::collections::{BTreeMap, HashSet};

use glam::DVec3;

use super::Statistics;
use crate::train::optimiser::{Optimiser, retain_rows};
use crate::train::schedule::Densification;
use pocketsplat_kernels::ops::rate::noise::Stream;
use pocketsplat_kernels::scene::init::{lattice_cell, lattice_room};
use pocketsplat_kernels::scene::{Anchors, INITIAL_MASK_LOGIT, Scene};

/// Base log-scales above this are lowered to it at every event, as the published trainer does: l_g ≤ e^0.05.
const MAX_BASE_LOG_SCALE: f32 = 0.05;

/// Growth ratio of thresholds, and shrink ratio of voxel edges, from one level to the next finer.
const THRESHOLD_RATIO: f64 = 2.0;
const EDGE_RATIO: u32 = 4;

/// Adds anchors where offsets that were drawn often enough have a large mean screen gradient.
///
/// Level i = 0, 1, …: threshold τ·2^i, kept with probability 1 − 0.5^(i+1), voxel edge ε·⌊cells/4^i⌋ (a level without a
/// cell is skipped, and so is a finer one when nothing has grown yet). A new anchor takes the element-wise largest
/// feature of the parents that fall into its voxel, log-scales ln(edge), offsets 0 (Lu et al. 2024, Scaffold-GS, section 3.3).
///
/// * `coarsest_cells`: voxel edge of level 0. * `luck`: of this event. * returns how many were added.
pub fn grow(
    scene: &mut Scene<f32>,
    optimiser: &mut Optimiser<f32>,
    statistics: &mut Statistics,
    settings: &Densification,
    coarsest_cells: u32,
    luck: Stream,
) -> usize {
    let (f, k) = (scene.shape.feature_dim, scene.shape.n_offsets);
    let enough = f64::from(settings.interval) * settings.success * 0.5;
    let n_before = scene.anchors.len();
    let eligible: Vec<usize> = (0..n_before * k).filter(|at| f64::from(statistics.n_drawn[*at]) > enough).collect();
    let mean_gradient = |at: usize| f64::from(statistics.gradient_sum[at]) / f64::from(statistics.n_drawn[at].max(1));
    let lattice = lattice_room(&scene.anchors.lattice);
    for level in 0..settings.levels {
        let cells = coarsest_cells / EDGE_RATIO.pow(level);
        if cells == 0 || (level > 0 && scene.anchors.len() == n_before) {
            continue;
        }
        let threshold = settings.gradient_threshold * THRESHOLD_RATIO.powf(f64::from(level));
        let drop_below = 0.5f64.powf(f64::from(level + 1));
        let is_lucky = |scene: &Scene<f32>, at: usize| {
            let of_cell =
                scene.anchors.lattice[at / k].into_iter().fold(luck.branch(level), |s, c| s.branch(c.cast_unsigned()));
            f64::from(of_cell.uniform((at % k) as u32)) > drop_below
        };
        let edge = scene.voxel_size * f64::from(cells);
        let cells = i32::try_from(cells).expect("a voxel spans a few cells");
        let at_lattice = |cell: [i32; 3]| cell.map(|c| c.saturating_mul(cells));
        let is_outside = |cell| lattice.iter().zip(at_lattice(cell)).any(|(along, c)| !along.contains(&c));
        let cell_of = |p: DVec3| lattice_cell(p, edge);
        let position =
            |scene: &Scene<f32>, a: usize| DVec3::from(scene.anchors.lattice[a].map(f64::from)) * scene.voxel_size;
        let occupied: HashSet<[i32; 3]> = (0..scene.anchors.len()).map(|a| cell_of(position(scene, a))).collect();
        let mut candidates: BTreeMap<[i32; 3], Candidate> = BTreeMap::new();
        for at in eligible.iter().copied().filter(|at| mean_gradient(*at) >= threshold && is_lucky(scene, *at)) {
            let anchor = at / k;
            let offset = DVec3::from(std::array::from_fn(|i| {
                f64::from(scene.anchors.offsets[at * 3 + i])
                    * f64::from(scene.anchors.log_scales[anchor * scene.shape.n_log_scales() + i]).exp()
            }));
            let cell = cell_of(position(scene, anchor) + offset);
            if occupied.contains(&cell) || is_outside(cell) {
                continue;
            }
            let parent = &scene.anchors.features[anchor * f..(anchor + 1) * f];
            let candidate =
                candidates.entry(cell).or_insert_with(|| Candidate { feature: parent.to_vec(), support: 0.0 });
            candidate.support += mean_gradient(at);
            for (largest, value) in candidate.feature.iter_mut().zip(parent) {
                *largest = largest.max(*value);
            }
        }
        #[expect(clippy::cast_possible_truncation, reason = "the logarithm of an edge is small")]
        let log_edge = edge.ln() as f32;
        let room = settings.max_anchors.map_or(usize::MAX, |most| most.saturating_sub(scene.anchors.len()));
        for (cell, feature) in best_supported(candidates, room) {
            scene.anchors.lattice.push(at_lattice(cell));
            scene.anchors.features.extend(feature);
            scene.anchors.log_scales.extend(std::iter::repeat_n(log_edge, scene.shape.n_log_scales()));
            scene.anchors.offsets.extend(std::iter::repeat_n(0.0, 3 * k));
            scene.anchors.mask_logits.extend(std::iter::repeat_n(INITIAL_MASK_LOGIT as f32, k));
            if !scene.anchors.prune_rank.is_empty() {
                scene.anchors.prune_rank.push(1.0);
            }
            if !scene.anchors.view_weights.is_empty() {
                scene.anchors.view_weights.push(1.0);
            }
        }
    }
    for at in eligible {
        statistics.gradient_sum[at] = 0.0;
        statistics.n_drawn[at] = 0;
    }
    statistics.grow(scene.anchors.len(), k);
    optimiser.grow(scene);
    scene.anchors.len() - n_before
}

/// A voxel that asks for an anchor.
struct Candidate {
    /// Element-wise largest feature of the parents.
    feature: Vec<f32>,
    /// Sum of the mean gradients of the offsets in it.
    support: f64,
}

/// The `room` candidates with the largest support, in the order of their cells.
fn best_supported(candidates: BTreeMap<[i32; 3], Candidate>, room: usize) -> Vec<([i32; 3], Vec<f32>)> {
    let mut all: Vec<([i32; 3], Candidate)> = candidates.into_iter().collect();
    if all.len() > room {
        // The sort is stable: equal support leaves the smaller cell first.
        all.sort_by(|a, b| b.1.support.total_cmp(&a.1.support));
        all.truncate(room);
        all.sort_by_key(|(cell, _)| *cell);
    }
    all.into_iter().map(|(cell, candidate)| (cell, candidate.feature)).collect()
}

/// Removes anchors that were seen often enough and whose opacities sum to less than `min_opacity` a view on average, and
/// those whose offsets are all masked.
///
/// Afterwards every anchor that was seen often enough starts counting afresh, and base log-scales are lowered to
/// 0.05 (as the published trainer does).
///
/// * returns how many were removed.
pub fn prune(
    scene: &mut Scene<f32>,
    optimiser: &mut Optimiser<f32>,
    statistics: &mut Statistics,
    settings: &Densification,
) -> usize {
    let enough = f64::from(settings.interval) * settings.success;
    let n_before = scene.anchors.len();
    let judged: Vec<bool> = statistics.n_views.iter().map(|n| f64::from(*n) > enough).collect();
    let mut keep: Vec<bool> = (0..n_before)
        .map(|a| {
            let floor = settings.min_opacity * f64::from(statistics.n_views[a]);
            scene.anchors.has_drawn(a) && !(judged[a] && f64::from(statistics.opacity_sum[a]) < floor)
        })
        .collect();
    // A scene without anchors has nothing left to grow from.
    if !keep.contains(&true) {
        keep.fill(true);
    }
    for (a, judged) in judged.into_iter().enumerate() {
        if judged {
            statistics.opacity_sum[a] = 0.0;
            statistics.n_views[a] = 0;
        }
    }
    for base in scene.anchors.log_scales.chunks_exact_mut(scene.shape.n_log_scales()).flat_map(|s| &mut s[3..]) {
        *base = base.min(MAX_BASE_LOG_SCALE);
    }
    retain(scene, optimiser, statistics, &keep);
    n_before - scene.anchors.len()
}

/// Drops the anchors that `keep` does not mark, with all that belongs to them.
pub fn retain(scene: &mut Scene<f32>, optimiser: &mut Optimiser<f32>, statistics: &mut Statistics, keep: &[bool]) {
    let (f, s, k) = (scene.shape.feature_dim, scene.shape.n_log_scales(), scene.shape.n_offsets);
    let Anchors { lattice, features, log_scales, offsets, mask_logits, prune_rank, view_weights } = &mut scene.anchors;
    retain_rows(lattice, 1, keep);
    for (values, width) in [(features, f), (log_scales, s), (offsets, 3 * k), (mask_logits, k)] {
        retain_rows(values, width, keep);
    }
    for of_anchors in [prune_rank, view_weights] {
        if !of_anchors.is_empty() {
            retain_rows(of_anchors, 1, keep);
        }
    }
    optimiser.retain(keep, &scene.shape);
    statistics.retain(keep, k);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::TrainConfig;
    use crate::train::streams::{self, Purpose, random};
    use pocketsplat_kernels::scene::ModelShape;
    use pocketsplat_kernels::scene::init::initial_scene;

    fn start(points: &[DVec3]) -> (Scene<f32>, Optimiser<f32>, Statistics) {
        start_with(TrainConfig::default().shape, points)
    }

    fn start_with(shape: ModelShape, points: &[DVec3]) -> (Scene<f32>, Optimiser<f32>, Statistics) {
        let scene = initial_scene(shape, 0.001, points, &mut random(1, Purpose::Start, 0));
        let optimiser = Optimiser::new(&scene);
        let statistics = Statistics::new(scene.anchors.len(), scene.shape.n_offsets);
        (scene, optimiser, statistics)
    }

    fn consistent(scene: &Scene<f32>, optimiser: &Optimiser<f32>, statistics: &Statistics) {
        let n = scene.anchors.len();
        assert_eq!(scene.anchors.features.len(), n * 32);
        assert_eq!(scene.anchors.log_scales.len(), n * scene.shape.n_log_scales());
        assert_eq!(optimiser.log_scales.first.len(), n * scene.shape.n_log_scales());
        assert_eq!(scene.anchors.offsets.len(), n * 30);
        assert_eq!(optimiser.features.first.len(), n * 32);
        assert_eq!(optimiser.offsets.second.len(), n * 30);
        assert_eq!(scene.anchors.mask_logits.len(), n * 10);
        assert_eq!(optimiser.mask_logits.first.len(), n * 10);
        assert_eq!(statistics.n_views.len(), n);
        assert_eq!(statistics.gradient_sum.len(), n * 10);
    }

    #[test]
    fn an_offset_that_is_pulled_hard_becomes_an_anchor_on_the_lattice() {
        let (mut scene, mut optimiser, mut statistics) = start(&[DVec3::ZERO, DVec3::ONE]);
        scene.anchors.features[..32].fill(-2.0);
        for k in 0..10 {
            scene.anchors.log_scales[..3].fill(0.0);
            scene.anchors.offsets[k * 3] = 0.1 * (k + 1) as f32;
            statistics.n_drawn[k] = 41;
            statistics.gradient_sum[k] = 41.0;
        }
        let added =
            grow(&mut scene, &mut optimiser, &mut statistics, &Densification::default(), 4, streams::growth(1, 100));
        assert!((8..=10).contains(&added), "kept at ½ on the coarse level, then at ¾ of the rest: {added}");
        consistent(&scene, &optimiser, &statistics);
        for cell in &scene.anchors.lattice[2..] {
            assert!(cell[0] % 100 == 0 && cell[0] > 0 && cell[1] == 0, "at a former offset: {cell:?}");
        }
        assert!(scene.anchors.features[64..].iter().all(|v| *v == -2.0), "the parent's feature");
        assert!(statistics.n_drawn.iter().all(|n| *n == 0), "judged offsets start afresh");
        let again =
            grow(&mut scene, &mut optimiser, &mut statistics, &Densification::default(), 4, streams::growth(1, 100));
        assert_eq!(again, 0, "nothing is eligible");
    }

    #[test]
    fn an_offset_beyond_the_lattice_of_a_bundle_grows_nothing() {
        let (mut scene, mut optimiser, mut statistics) = start(&[DVec3::ZERO, DVec3::ONE]);
        scene.anchors.log_scales[..3].fill(0.0);
        // A bundle spans 2²¹ cells, here 0.001 wide: from about −1,048 to 1,048.
        let near = [1000.0, -1000.0].repeat(3);
        for (k, x) in near.into_iter().chain([1100.0, -1100.0, f32::INFINITY, -1100.0]).enumerate() {
            scene.anchors.offsets[k * 3] = x;
            (statistics.n_drawn[k], statistics.gradient_sum[k]) = (41, 41.0);
        }
        let settings = Densification { levels: 3, ..Densification::default() };
        grow(&mut scene, &mut optimiser, &mut statistics, &settings, 16, streams::growth(1, 100));
        consistent(&scene, &optimiser, &statistics);
        let mut grown: Vec<i32> = scene.anchors.lattice[2..].iter().map(|cell| cell[0]).collect();
        grown.sort_unstable();
        assert!(!grown.is_empty() && grown.iter().all(|x| x.abs() == 1_000_000), "{grown:?}");
    }

    #[test]
    fn a_seldom_drawn_or_gentle_offset_grows_nothing() {
        let (mut scene, mut optimiser, mut statistics) = start(&[DVec3::ZERO, DVec3::ONE]);
        statistics.n_drawn[0] = 40;
        statistics.gradient_sum[0] = 40.0;
        statistics.n_drawn[1] = 100;
        statistics.gradient_sum[1] = 100.0 * 1.9e-4;
        assert_eq!(
            grow(&mut scene, &mut optimiser, &mut statistics, &Densification::default(), 4, streams::growth(1, 100)),
            0
        );
        assert_eq!(statistics.n_drawn[..2], [40, 0], "only the judged one is reset");
    }

    /// How many of 400 offsets, each in a voxel of its own, grow an anchor.
    ///
    /// * `pull`: mean gradient, in thresholds of the coarsest level.
    fn grown(pull: f32, levels: u32) -> usize {
        let points: Vec<DVec3> = (0..40).map(|i| DVec3::new(0.0, f64::from(i), 0.0)).collect();
        let (mut scene, mut optimiser, mut statistics) = start(&points);
        scene.anchors.log_scales.fill(0.0);
        for at in 0..400 {
            scene.anchors.offsets[at * 3] = 0.1 * (at % 10 + 1) as f32;
            statistics.n_drawn[at] = 100;
            statistics.gradient_sum[at] = 100.0 * 2e-4 * pull;
        }
        let settings = Densification { levels, ..Densification::default() };
        grow(&mut scene, &mut optimiser, &mut statistics, &settings, 4, streams::growth(1, 100))
    }

    #[test]
    fn half_of_the_offsets_may_grow_at_the_coarsest_level_and_a_finer_one_asks_for_twice_the_pull() {
        // 0.5 ± 0.08 and 1 − 0.5·0.25 = 0.875 ± 0.05, three standard deviations and more.
        let within = |found: usize, share: f64, by: f64| (found as f64 / 400.0 - share).abs() < by;
        assert!(within(grown(1.5, 1), 0.5, 0.08), "one level: {}", grown(1.5, 1));
        assert_eq!(grown(1.5, 2), grown(1.5, 1), "too gentle for the second level");
        assert!(within(grown(3.0, 2), 0.875, 0.05), "two levels: {}", grown(3.0, 2));
    }

    #[test]
    fn a_cap_keeps_the_candidates_that_are_pulled_hardest() {
        // Every offset is pulled harder than those nearer to the anchor.
        let grown = |max_anchors| {
            let (mut scene, mut optimiser, mut statistics) = start(&[DVec3::ZERO, DVec3::ONE]);
            scene.anchors.log_scales[..3].fill(0.0);
            for k in 0..10 {
                scene.anchors.offsets[k * 3] = 0.1 * (k + 1) as f32;
                statistics.n_drawn[k] = 41;
                statistics.gradient_sum[k] = (k + 1) as f32;
            }
            let settings = Densification { max_anchors, levels: 1, ..Densification::default() };
            let mut once_more =
                || grow(&mut scene, &mut optimiser, &mut statistics, &settings, 4, streams::growth(1, 100));
            let (added, again) = (once_more(), once_more());
            assert_eq!(again, 0, "nothing is eligible");
            consistent(&scene, &optimiser, &statistics);
            let cells: Vec<i32> = scene.anchors.lattice[2..].iter().map(|c| c[0]).collect();
            assert_eq!(cells.len(), added);
            assert!(cells.is_sorted(), "{cells:?}");
            cells
        };
        let (all, capped) = (grown(None), grown(Some(4)));
        assert!(all.len() > 2, "{all:?}");
        assert_eq!(capped, all[all.len() - 2..]);
    }

    #[test]
    fn isotropic_scenes_grow_and_lose_anchors_alike() {
        let shape = ModelShape { anisotropic: false, ..TrainConfig::default().shape };
        let (mut scene, mut optimiser, mut statistics) = start_with(shape, &[DVec3::ZERO, DVec3::ONE]);
        for k in 0..10 {
            scene.anchors.log_scales[..3].fill(0.0);
            scene.anchors.offsets[k * 3] = 0.1 * (k + 1) as f32;
            statistics.n_drawn[k] = 41;
            statistics.gradient_sum[k] = 41.0;
        }
        assert!(
            grow(&mut scene, &mut optimiser, &mut statistics, &Densification::default(), 4, streams::growth(1, 100))
                > 0
        );
        consistent(&scene, &optimiser, &statistics);
        statistics.n_views[1] = 81;
        scene.anchors.log_scales[3] = 1.0;
        let kept = [&scene.anchors.log_scales[..4], &scene.anchors.log_scales[8..]].concat();
        assert_eq!(prune(&mut scene, &mut optimiser, &mut statistics, &Densification::default()), 1);
        consistent(&scene, &optimiser, &statistics);
        assert_eq!(scene.anchors.log_scales[3], MAX_BASE_LOG_SCALE);
        assert_eq!(scene.anchors.log_scales[..3], kept[..3]);
        assert_eq!(scene.anchors.log_scales[4..], kept[4..]);
    }

    #[test]
    fn an_anchor_that_showed_nothing_goes() {
        let (mut scene, mut optimiser, mut statistics) = start(&[DVec3::ZERO, DVec3::ONE, -DVec3::ONE]);
        statistics.n_views = vec![81, 81, 80];
        statistics.opacity_sum = vec![0.4, 0.41, 0.0];
        scene.anchors.log_scales[17] = 1.0;
        let kept = scene.anchors.lattice[1..].to_vec();
        assert_eq!(prune(&mut scene, &mut optimiser, &mut statistics, &Densification::default()), 1);
        assert_eq!(scene.anchors.lattice, kept);
        consistent(&scene, &optimiser, &statistics);
        assert_eq!(statistics.n_views, [0, 80], "judged anchors start afresh, the other goes on");
        assert_eq!(scene.anchors.log_scales[11], MAX_BASE_LOG_SCALE);
        scene.anchors.mask_logits[10..].fill(-5.0);
        assert_eq!(prune(&mut scene, &mut optimiser, &mut statistics, &Densification::default()), 1);
        assert_eq!(scene.anchors.lattice, kept[..1], "an anchor that is masked as a whole goes too");
        consistent(&scene, &optimiser, &statistics);
    }
}
