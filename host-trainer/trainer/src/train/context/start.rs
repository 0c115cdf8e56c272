//! The context model as it starts: a grid that fits the scene, a network that says no more than each channel's statistics.

use std::collections::HashSet;

use pocketsplat_format::context::{
    FEATURES_PER_LEVEL, GridFrame, GridLevel, LevelKind, MAX_LEVEL_SHIFT, MAX_SPAN_SHIFT, N_GROUPS, N_LEVELS,
};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::train::schedule::Backbone;
use pocketsplat_kernels::scene::{ContextModel, Head, Scene};

/// Scenes of this many anchors get the published grid and network.
const LARGE: usize = 200_000;
/// λ at which the sizes below were measured with rate–distortion pruning.
const LAMBDA_OF_SIZES: f64 = 0.002;
/// Share of the anchors that may lie outside the frame at either end of an axis: a capture's stray points must not take
/// the grid's resolution from the rest. Outside counts as on the border.
const STRAY: f64 = 0.005;
/// Share of the anchors of a level that the next coarser one has (the published one).
const LEVEL_SHARE: f64 = 0.2;
/// Rows start within ±this, so that the first gradients decide their signs.
const ROW_BOUND: f32 = 1e-4;
/// Output weights start this much smaller than a layer's usual bound, so that the statistics hold at first.
const OUTPUT_DAMPING: f32 = 0.1;
/// Scales start at no less than this share of a base step.
const MIN_SCALE: f64 = 1.0 / 16.0;

/// Anchors to size a model for where `n_anchors` are going to be pruned by what they are worth at λ: n · min(1, 0.002/λ).
///
/// A file that is pruned so shrinks about as 1/λ above 0.002, and its context shall keep its share of the bytes. (Lego at 100 px, λ
/// 0.006: 5 % fewer bytes at equal PSNR.)
pub fn n_to_size_for(n_anchors: usize, lambda: f64) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a number of anchors")]
    let n = (n_anchors as f64 * (LAMBDA_OF_SIZES / lambda).min(1.0)) as usize;
    n
}

/// The model that a scene of `backbone` begins with.
///
/// * `n`: anchors that its size is for.
pub fn begin_context(
    scene: &Scene<f32>,
    backbone: Backbone,
    n: usize,
    base_steps: [f32; N_GROUPS],
    rng: &mut ChaCha8Rng,
) -> ContextModel<f32> {
    let initial = match backbone {
        Backbone::ContextGs => initial_levels,
        Backbone::Scaffold | Backbone::Hac | Backbone::HacPlus => initial_context,
    };
    initial(scene, n, base_steps, rng).with_taps(&scene.shape, backbone.n_taps(scene.shape.feature_dim), 0.0)
}

/// A model for a scene of these anchors.
///
/// * `n`: anchors that its size is for.
pub fn initial_context(
    scene: &Scene<f32>,
    n: usize,
    base_steps: [f32; N_GROUPS],
    rng: &mut ChaCha8Rng,
) -> ContextModel<f32> {
    let mut model = ContextModel::filled(&scene.shape, frame(scene), levels(n), n_hidden(n), base_steps, 0.0);
    for row in &mut model.rows {
        *row = rng.random_range(-ROW_BOUND..ROW_BOUND);
    }
    begin(&mut model.networks[0].mlp, rng);
    model.networks[0].mlp.b2 = output_biases(scene, base_steps);
    model
}

/// Weights as a network starts with them.
fn begin(mlp: &mut Head<f32>, rng: &mut ChaCha8Rng) {
    let bounds = [1.0 / (mlp.n_in as f32).sqrt(), OUTPUT_DAMPING / (mlp.n_hidden as f32).sqrt()];
    for (group, bound) in [(&mut mlp.w1, bounds[0]), (&mut mlp.b1, bounds[0]), (&mut mlp.w2, bounds[1])] {
        for weight in group {
            *weight = rng.random_range(-bound..bound);
        }
    }
}

/// A model for anchors that follow anchors.
///
/// * `n`: anchors that its size is for.
fn initial_levels(
    scene: &Scene<f32>,
    n: usize,
    base_steps: [f32; N_GROUPS],
    rng: &mut ChaCha8Rng,
) -> ContextModel<f32> {
    let n_hidden = n_level_hidden(n);
    let frame = frame(scene);
    let shifts = level_shifts(scene, &frame);
    let mut model = ContextModel::following(&scene.shape, frame, shifts, n_hidden, base_steps, 0.0);
    for network in &mut model.networks {
        begin(&mut network.mlp, rng);
        network.mlp.b2 = output_biases(scene, base_steps);
    }
    model
}

/// Edges of the cells of levels 1 and 2, as powers of two: those for which the share of the anchors that begin a cell of level 1,
/// and of these that begin one of level 2, comes nearest to [`LEVEL_SHARE`]; then the edge of a cube that all lie in.
fn level_shifts(scene: &Scene<f32>, frame: &GridFrame) -> [u8; N_LEVELS] {
    let cells = |shift: u8| {
        let drawn = (0..scene.anchors.len()).filter(|a| scene.anchors.has_drawn(*a));
        drawn.map(|a| scene.anchors.lattice[a].map(|c| c >> shift)).collect::<HashSet<_>>().len().max(1)
    };
    let n: Vec<f64> = (0..=MAX_LEVEL_SHIFT).map(|shift| cells(shift) as f64).collect();
    let coarser = |from: u8| {
        let miss = |to: u8| (n[usize::from(to)] / n[usize::from(from)] / LEVEL_SHARE).ln().abs();
        (from..=MAX_LEVEL_SHIFT).min_by(|a, b| miss(*a).total_cmp(&miss(*b))).unwrap_or(from)
    };
    let first = coarser(0);
    let span = |axis: usize| scene.anchors.lattice.iter().map(move |cell| cell[axis].abs_diff(frame.min[axis])).max();
    let widest = (0..3).filter_map(span).max().unwrap_or(0);
    #[expect(clippy::cast_possible_truncation, reason = "bits of a u32")]
    let span_shift = ((u32::BITS - widest.leading_zeros()) as u8).min(MAX_SPAN_SHIFT);
    [first, coarser(first), span_shift]
}

/// The box of all anchors but the strays, axis by axis.
fn frame(scene: &Scene<f32>) -> GridFrame {
    let ends: [[i32; 2]; 3] = std::array::from_fn(|axis| {
        let mut along: Vec<i32> = scene.anchors.lattice.iter().map(|cell| cell[axis]).collect();
        along.sort_unstable();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
        let stray = (STRAY * along.len() as f64) as usize;
        let last = along.len().saturating_sub(1);
        [stray.min(last), last - stray.min(last)].map(|at| along.get(at).copied().unwrap_or(0))
    });
    GridFrame::spanning(ends.map(|[low, _]| low), ends.map(|[_, high]| high))
}

/// Volumes of falling cell size, then the same for the three planes.
///
/// The published grid has 441,568 rows (12 volumes of 18 to 514 nodes an axis, three times 4 planes of 130 to 1,026, tables
/// of at most 2¹³ and 2¹⁵ rows), 220 KB: little beside its scenes of some hundred thousand anchors, more than all anchors
/// of a small one. Here a table has about a ninth of the anchors' number of rows, so that the whole grid costs about four
/// bits an anchor, on 6 volumes and three times 3 planes, of which the coarse ones are dense.
pub fn levels(n_anchors: usize) -> Vec<GridLevel> {
    let planes = [LevelKind::Xy, LevelKind::Xz, LevelKind::Yz];
    if n_anchors >= LARGE {
        let volumes =
            [18, 24, 33, 44, 59, 80, 108, 148, 201, 275, 376, 514].map(|r| level(LevelKind::Volume, r, 1 << 13));
        let flat = planes.into_iter().flat_map(|kind| [130, 258, 514, 1026].map(|r| level(kind, r, 1 << 15)));
        return volumes.into_iter().chain(flat).collect();
    }
    let cap = u32::try_from(n_anchors / 9).unwrap_or(u32::MAX).max(1 << 8);
    // The power of two below: 2^⌊log₂ cap⌋.
    let cap = 1 << cap.ilog2();
    let volumes = [8, 16, 32, 64, 128, 256].map(|r| level(LevelKind::Volume, r, cap));
    let flat = planes.into_iter().flat_map(|kind| [32, 64, 128].map(|r| level(kind, r, cap)));
    volumes.into_iter().chain(flat).collect()
}

/// A level of `resolution` nodes an axis, hashed where it would have more than `cap` rows.
fn level(kind: LevelKind, resolution: u16, cap: u32) -> GridLevel {
    let dense = GridLevel { kind, resolution, n_rows: 0 }.n_nodes();
    GridLevel { kind, resolution, n_rows: dense.map_or(cap, |nodes| nodes.min(cap)) }
}

/// Hidden units: the network's weights, a byte each, should stay a few per cent of the bundle. (Lego at 100 px, 15,000 anchors,
/// pruned by rate and distortion to 8,000: 16 units instead of 32 take 3 % fewer bytes at equal PSNR.)
fn n_hidden(n_anchors: usize) -> usize {
    match n_anchors {
        ..20_000 => 16,
        20_000..50_000 => 32,
        50_000..LARGE => 64,
        LARGE.. => 100,
    }
}

/// The same where there are three networks and no grid: together about as many bytes.
fn n_level_hidden(n_anchors: usize) -> usize {
    match n_anchors {
        ..5_000 => 12,
        5_000..50_000 => 24,
        50_000..LARGE => 64,
        LARGE.. => 100,
    }
}

/// Mean and log₂ of the standard deviation of every channel, in base steps; steps are the base steps.
fn output_biases(scene: &Scene<f32>, base_steps: [f32; N_GROUPS]) -> Vec<f32> {
    let (f, k, n_channels) = (scene.shape.feature_dim, scene.shape.n_offsets, scene.shape.values_per_anchor());
    let s = scene.shape.n_log_scales();
    let anchors = &scene.anchors;
    let mut biases = vec![0.0; 2 * n_channels + N_GROUPS];
    for channel in 0..n_channels {
        let (values, width, at, group) = match channel {
            c if c < f => (&anchors.features, f, c, 0),
            c if c < f + s => (&anchors.log_scales, s, c - f, 1),
            c => (&anchors.offsets, 3 * k, c - f - s, 2),
        };
        let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for (a, row) in values.chunks_exact(width).enumerate() {
            let counts = if group == 2 { anchors.is_drawn(a * k + at / 3) } else { anchors.has_drawn(a) };
            if counts {
                let value = f64::from(row[at] / base_steps[group]);
                n += 1.0;
                sum += value;
                squares += value * value;
            }
        }
        let mean = sum / f64::max(n, 1.0);
        let variance = squares / f64::max(n, 1.0) - mean * mean;
        biases[channel] = mean as f32;
        biases[n_channels + channel] = variance.max(0.0).sqrt().max(MIN_SCALE).log2() as f32;
    }
    biases
}

const _: () = assert!(FEATURES_PER_LEVEL == 4, "`levels` counts bits");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::Trainer;
    use crate::train::test_capture::{tiny_capture, tiny_config};
    use pocketsplat_kernels::ops::heads::head;
    use pocketsplat_kernels::ops::rate::hash_grid;
    use rand::SeedableRng;

    fn n_rows(n_anchors: usize) -> u32 {
        levels(n_anchors).iter().map(|level| level.n_rows).sum()
    }

    #[test]
    fn the_grid_grows_with_the_scene() {
        assert_eq!(n_rows(LARGE), 12 * 8192 - 8192 + 5832 + 3 * (16_900 + 3 * 32_768));
        for n in [5_000, 20_000, 90_000, 199_999] {
            let per_anchor = f64::from(n_rows(n)) / n as f64;
            assert!((0.4..1.7).contains(&per_anchor), "{n} anchors: {per_anchor} rows each");
        }
        for n in [0, 100, 30_000, LARGE] {
            for level in levels(n) {
                assert!(level.is_dense() || level.n_rows.is_power_of_two(), "{level:?}");
            }
        }
    }

    #[test]
    fn the_larger_lambda_the_fewer_anchors_stay() {
        assert_eq!(
            [0.0, 0.001, 0.002, 0.004, 0.02].map(|lambda| n_to_size_for(20_000, lambda)),
            [20_000, 20_000, 20_000, 10_000, 2_000]
        );
    }

    #[test]
    fn each_level_has_about_a_fifth_of_the_one_below() {
        let capture = tiny_capture();
        let trainer = Trainer::new(&capture, tiny_config(60)).unwrap();
        let mut scene = trainer.state.learned.scene;
        // A plane: a shift takes three quarters of the cells.
        let plane: Vec<[i32; 3]> = (0..64 * 64).map(|i| [4 * (i % 64), 4 * (i / 64), 7]).collect();
        let n = scene.anchors.len().min(plane.len());
        scene.anchors.lattice[..n].copy_from_slice(&plane[..n]);
        scene.anchors.lattice[n..].fill(plane[0]);
        let model = initial_levels(&scene, n, [1.0, 0.1, 0.2], &mut ChaCha8Rng::seed_from_u64(1));
        assert_eq!(
            model.shifts.map(|[first, second, _]| [first, second]),
            Some([3, 4]),
            "cells of 2 by 2 anchors, and of 2 by 2 of these"
        );
        assert_eq!(model.networks.iter().map(|network| network.mlp.n_in).collect::<Vec<_>>(), [17, 17, 3]);
        assert_eq!(model.networks[0].mlp.b2, model.networks[2].mlp.b2);
    }

    #[test]
    fn at_first_it_says_what_the_statistics_say() {
        let capture = tiny_capture();
        let mut trainer = Trainer::new(&capture, tiny_config(60)).unwrap();
        for _ in 0..40 {
            trainer.advance().unwrap();
        }
        let scene = &trainer.state.learned.scene;
        let model = initial_context(scene, scene.anchors.len(), [1.0, 0.1, 0.2], &mut ChaCha8Rng::seed_from_u64(1));
        let units: Vec<[u16; 3]> = scene.anchors.lattice.iter().map(|cell| model.frame.unit(*cell)).collect();
        let n = units.len();
        let mut inputs = vec![0.0; n * model.networks[0].mlp.n_in];
        hash_grid::forward(&model.levels, &model.rows, &units, &mut inputs);
        let (mut hidden, mut outputs) =
            (vec![0.0; n * model.networks[0].mlp.n_hidden], vec![0.0; n * model.networks[0].mlp.n_out]);
        head::forward(&model.networks[0].mlp, &inputs, &mut hidden, &mut outputs);
        for row in outputs.chunks_exact(model.networks[0].mlp.n_out) {
            for (output, bias) in row.iter().zip(&model.networks[0].mlp.b2) {
                assert!((output - bias).abs() < 0.3, "{output} instead of {bias}");
            }
        }
        // The mean log-scale, from its output.
        let mean = scene.anchors.log_scales.iter().step_by(scene.shape.n_log_scales()).sum::<f32>() / n as f32;
        assert!((model.networks[0].mlp.b2[scene.shape.feature_dim] * 0.1 - mean).abs() < 1e-3);
    }
}
