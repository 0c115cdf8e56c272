//! Rows of numbers in a square grid in which neighbours are alike: Parallel Linear Assignment Sorting (Morgenstern et al. 2023, section 3).

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::low_pass::LowPass;

/// What the radius is multiplied by once swaps gain little.
const RADIUS_DECAY: f64 = 0.95;

/// Swaps gain little where they lower the sum of all distances by a smaller share.
const LEAST_GAIN: f64 = 1e-3;

/// Of a low-pass filter's radius.
const DEVIATION: f64 = 0.5;

/// Cells that exchange what they have at a time.
const GROUP: usize = 4;

/// All orders of a group, that which changes nothing first.
const ORDERS: [[usize; GROUP]; 24] = orders();

/// Moves rows among the cells of a grid to where the grid is smoothest.
///
/// Until the radius falls to 1: what the grid should be is itself, low-pass filtered at the radius. Cells of a block exchange rows, four
/// and four drawn at random, such that Σ‖row − target‖² is least; blocks lie anew each time. Cost: for each radius a filter of as many
/// cells, and a few rounds of 4 · `WIDTH` products a cell.
///
/// * `cells`: `[side²]` the row of each cell, each once. * `rows`: finite. * `radius`: where to begin, in cells.
pub(super) fn assign<const WIDTH: usize>(
    cells: &mut [usize],
    rows: &[[f32; WIDTH]],
    side: usize,
    mut radius: f64,
    rng: &mut ChaCha8Rng,
) {
    while radius >= 1.0 {
        let targets = low_passed(cells, rows, side, radius);
        loop {
            let distance = |cells: &[usize]| -> f64 {
                let each = cells.iter().zip(&targets).map(|(row, target)| f64::from(squared(&rows[*row], target)));
                each.sum()
            };
            let before = distance(cells);
            exchange(cells, rows, &targets, side, radius, rng);
            // Nor where there is nothing to gain.
            if !(before - distance(cells) > LEAST_GAIN * before) {
                break;
            }
        }
        radius *= RADIUS_DECAY;
    }
}

/// Rows of the filtered grid, cell by cell.
fn low_passed<const WIDTH: usize>(
    cells: &[usize],
    rows: &[[f32; WIDTH]],
    side: usize,
    radius: f64,
) -> Vec<[f32; WIDTH]> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the side")]
    let filter = LowPass::new(radius.ceil() as usize, DEVIATION * radius);
    let planes: Vec<Vec<f32>> = (0..WIDTH)
        .into_par_iter()
        .map(|i| filter.of(&cells.iter().map(|row| rows[*row][i]).collect::<Vec<_>>(), side))
        .collect();
    (0..cells.len()).map(|cell| std::array::from_fn(|i| planes[i][cell])).collect()
}

/// One exchange in all blocks of a tiling that is drawn at random.
fn exchange<const WIDTH: usize>(
    cells: &mut [usize],
    rows: &[[f32; WIDTH]],
    targets: &[[f32; WIDTH]],
    side: usize,
    radius: f64,
    rng: &mut ChaCha8Rng,
) {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the side")]
    let block = radius as usize + 1;
    // Blocks at the edges are cut there.
    let [columns, lines] = [(); 2].map(|()| {
        let first = rng.random_range(1..=block);
        let within = (first..side).step_by(block);
        std::iter::once(0).chain(within).chain([side]).collect::<Vec<usize>>()
    });
    let blocks: Vec<[[usize; 2]; 2]> =
        lines.windows(2).flat_map(|y| columns.windows(2).map(move |x| [[x[0], x[1]], [y[0], y[1]]])).collect();
    let seed = rng.random();
    let moved: Vec<Vec<(usize, usize)>> = blocks
        .par_iter()
        .enumerate()
        .map(|(stream, [[left, right], [top, bottom]])| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(stream as u64);
            let mut within: Vec<usize> =
                (*top..*bottom).flat_map(|y| (*left..*right).map(move |x| y * side + x)).collect();
            within.shuffle(&mut rng);
            within.as_chunks().0.iter().flat_map(|group| best(group, cells, rows, targets)).collect()
        })
        .collect();
    moved.into_iter().flatten().for_each(|(cell, row)| cells[cell] = row);
}

/// The cells of a group, each with the row that it should have.
fn best<const WIDTH: usize>(
    group: &[usize; GROUP],
    cells: &[usize],
    rows: &[[f32; WIDTH]],
    targets: &[[f32; WIDTH]],
) -> [(usize, usize); GROUP] {
    let cost = group.map(|cell| group.map(|from| squared(&rows[cells[from]], &targets[cell])));
    let of = |order: &[usize; GROUP]| (0..GROUP).map(|i| cost[i][order[i]]).sum::<f32>();
    let order = ORDERS.iter().min_by(|a, b| of(a).total_cmp(&of(b))).expect("there are 24");
    std::array::from_fn(|i| (group[i], cells[group[order[i]]]))
}

fn squared<const WIDTH: usize>(a: &[f32; WIDTH], b: &[f32; WIDTH]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

const fn orders() -> [[usize; GROUP]; 24] {
    let mut all = [[0, 1, 2, 3]; 24];
    let (mut n, mut code) = (0, 0);
    while code < 256 {
        let [a, b, c, d] = [code / 64, code / 16 % 4, code / 4 % 4, code % 4];
        if a != b && a != c && a != d && b != c && b != d && c != d {
            all[n] = [a, b, c, d];
            n += 1;
        }
        code += 1;
    }
    all
}

#[cfg(test)]
mod tests {
    use pocketsplat_kernels::finite_difference::random;

    use super::*;

    const SIDE: usize = 24;

    /// Points of a cube in a random grid, and the same sorted.
    fn sorted(threads: usize) -> (Vec<[f32; 3]>, Vec<usize>) {
        #[expect(clippy::cast_possible_truncation, reason = "any numbers")]
        let numbers: Vec<f32> = random(5, 3 * SIDE * SIDE).into_iter().map(|x| x as f32).collect();
        let rows = numbers.as_chunks().0.to_vec();
        let mut cells: Vec<usize> = (0..SIDE * SIDE).collect();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| assign(&mut cells, &rows, SIDE, 11.0, &mut ChaCha8Rng::seed_from_u64(1)));
        (rows, cells)
    }

    /// Mean distance of neighbours, squared.
    fn roughness(rows: &[[f32; 3]], cells: &[usize]) -> f32 {
        let pairs = (0..SIDE * SIDE).flat_map(|cell| {
            let right = (cell % SIDE + 1 < SIDE).then_some((cell, cell + 1));
            let below = (cell / SIDE + 1 < SIDE).then_some((cell, cell + SIDE));
            right.into_iter().chain(below)
        });
        pairs.map(|(a, b)| squared(&rows[cells[a]], &rows[cells[b]])).sum::<f32>() / (2 * SIDE * (SIDE - 1)) as f32
    }

    #[test]
    fn a_sorted_grid_has_every_row_once_and_like_beside_like() {
        let (rows, cells) = sorted(1);
        let mut all = cells.clone();
        all.sort_unstable();
        let start: Vec<usize> = (0..SIDE * SIDE).collect();
        assert_eq!(all, start);
        let share = roughness(&rows, &cells) / roughness(&rows, &start);
        assert!(share < 0.15, "{share} of the squared distances");
        assert_eq!(sorted(3).1, cells, "with any number of threads");
    }

    #[test]
    fn a_group_is_put_in_its_best_order() {
        let rows = [[0.0], [1.0], [2.0], [3.0]];
        let targets = [[2.2], [0.1], [3.5], [0.9]];
        let placed = best(&[0, 1, 2, 3], &[3, 1, 0, 2], &rows, &targets);
        assert_eq!(placed, [(0, 2), (1, 0), (2, 3), (3, 1)]);
        let mut orders = ORDERS.to_vec();
        orders.sort_unstable();
        orders.dedup();
        assert_eq!(orders.len(), 24);
        let mut alone = [0];
        assign(&mut alone, &[[1.0]], 1, 0.5, &mut ChaCha8Rng::seed_from_u64(1));
        assert_eq!(alone, [0]);
    }
}
