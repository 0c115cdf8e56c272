//! Weighted k-means (Lloyd 1982): few vectors that stand for many.

use pocketsplat_kernels::ops::simd::Level;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Codes that are compared at once.
const LANES: usize = 16;

/// Vectors one task takes; nothing is summed within, so that no result depends on it.
const BLOCK: usize = 256;

/// `n_codes` codes, or one for each vector, which locally minimise Σᵢ wᵢ·‖vᵢ − c(vᵢ)‖²; and the code c of each vector, its nearest.
///
/// They start as vectors drawn at random, first among those that weigh anything. Then `n_rounds` times each becomes the weighted mean of those that are nearest to it, and
/// stays where there is none. Cost: `n · n_codes · WIDTH` products a round.
///
/// * `vectors`: finite. * `weights`: of each, 0 or more.
pub(crate) fn k_means<const WIDTH: usize>(
    vectors: &[[f32; WIDTH]],
    weights: &[f64],
    n_codes: usize,
    n_rounds: usize,
    rng: &mut ChaCha8Rng,
) -> (Vec<[f32; WIDTH]>, Vec<usize>) {
    let n_codes = n_codes.min(vectors.len());
    let mut order: Vec<usize> = (0..vectors.len()).collect();
    order.shuffle(rng);
    // A code among vectors that count for nothing would stay there.
    order.sort_by_key(|i| weights[*i] <= 0.0);
    let mut codes: Vec<_> = order[..n_codes].iter().map(|i| vectors[*i]).collect();
    let free = vec![0.0; n_codes];
    for _ in 0..n_rounds {
        let mut sums = vec![([0.0; WIDTH], 0.0); n_codes];
        for ((vector, weight), code) in vectors.iter().zip(weights).zip(cheapest(vectors, &codes, &free)) {
            let (sum, total) = &mut sums[code];
            sum.iter_mut().zip(vector).for_each(|(sum, value)| *sum += weight * f64::from(*value));
            *total += weight;
        }
        for (code, (sum, total)) in codes.iter_mut().zip(sums).filter(|(_, (_, total))| *total > 0.0) {
            #[expect(clippy::cast_possible_truncation, reason = "a mean of single-precision numbers")]
            code.iter_mut().zip(sum).for_each(|(code, sum)| *code = (sum / total) as f32);
        }
    }
    let nearest = cheapest(vectors, &codes, &free);
    (codes, nearest)
}

/// For each vector v the first of the codes c with the least ‖v − c‖² + cost(c).
///
/// * `costs`: of each code, 0 or more.
pub(crate) fn cheapest<const WIDTH: usize>(
    vectors: &[[f32; WIDTH]],
    codes: &[[f32; WIDTH]],
    costs: &[f32],
) -> Vec<usize> {
    // Lanes without a code are infinitely far away.
    let lanes: Vec<_> = codes
        .chunks(LANES)
        .zip(costs.chunks(LANES))
        .map(|(codes, costs)| Lanes {
            codes: std::array::from_fn(|i| {
                std::array::from_fn(|lane| codes.get(lane).map_or(f32::INFINITY, |code| code[i]))
            }),
            costs: std::array::from_fn(|lane| costs.get(lane).copied().unwrap_or(f32::INFINITY)),
        })
        .collect();
    let level = Level::detect();
    let mut cheapest = vec![0; vectors.len()];
    cheapest.par_chunks_mut(BLOCK).zip(vectors.par_chunks(BLOCK)).for_each(|(cheapest, vectors)| {
        level.run(
            #[inline(always)]
            || cheapest.iter_mut().zip(vectors).for_each(|(cheapest, vector)| *cheapest = cheapest_of(vector, &lanes)),
        );
    });
    cheapest
}

/// Codes that are compared at once, and what each costs.
struct Lanes<const WIDTH: usize> {
    codes: [[f32; LANES]; WIDTH],
    costs: [f32; LANES],
}

#[inline(always)]
fn cheapest_of<const WIDTH: usize>(vector: &[f32; WIDTH], lanes: &[Lanes<WIDTH>]) -> usize {
    let (mut best, mut at) = ([f32::INFINITY; LANES], [0; LANES]);
    for (block, lanes) in (0u32..).zip(lanes) {
        let mut sum = lanes.costs;
        for (value, codes) in vector.iter().zip(&lanes.codes) {
            for lane in 0..LANES {
                let d = *value - codes[lane];
                sum[lane] += d * d;
            }
        }
        for lane in 0..LANES {
            at[lane] = if sum[lane] < best[lane] { block } else { at[lane] };
            best[lane] = best[lane].min(sum[lane]);
        }
    }
    let code = |lane: usize| at[lane] as usize * LANES + lane;
    let first = (0..LANES).min_by(|a, b| best[*a].total_cmp(&best[*b]).then(code(*a).cmp(&code(*b))));
    first.map_or(0, code)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    fn cost(vectors: &[[f32; 3]], codes: &[[f32; 3]], nearest: &[usize]) -> f32 {
        let squared = |a: &[f32; 3], b: &[f32; 3]| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
        vectors.iter().zip(nearest).map(|(vector, code)| squared(vector, &codes[*code])).sum()
    }

    #[test]
    fn codes_go_where_vectors_are_and_nearest_is_nearest() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let vectors: Vec<[f32; 3]> = (0..700).map(|_| std::array::from_fn(|_| rng.random::<f32>())).collect();
        let weights = vec![1.0; 700];
        let after = |n_rounds| {
            let (codes, nearest) = k_means(&vectors, &weights, 37, n_rounds, &mut ChaCha8Rng::seed_from_u64(2));
            for (vector, found) in vectors.iter().zip(&nearest) {
                let far = |code: usize| cost(&[*vector], &codes, &[code]);
                assert!((0..37).all(|code| far(code) >= far(*found)), "{vector:?}");
            }
            cost(&vectors, &codes, &nearest)
        };
        let [start, once, often] = [0, 1, 10].map(after);
        assert!(once < 0.9 * start && often < 0.95 * once, "{start}, {once}, {often}");
    }

    #[test]
    fn what_costs_more_is_taken_from_nearer() {
        let (codes, vectors) = ([[0.0f32], [1.0]], [[0.4f32], [0.6], [0.8]]);
        assert_eq!(cheapest(&vectors, &codes, &[0.0, 0.0]), [0, 1, 1]);
        // (0.6 − 0)² = 0.36 against (0.6 − 1)² + 0.3 = 0.46; (0.8 − 0)² = 0.64 against 0.34.
        assert_eq!(cheapest(&vectors, &codes, &[0.0, 0.3]), [0, 0, 1]);
    }

    #[test]
    fn a_code_is_the_weighted_mean() {
        let vectors = [[0.0f32], [4.0]];
        let (codes, nearest) = k_means(&vectors, &[3.0, 1.0], 1, 1, &mut ChaCha8Rng::seed_from_u64(1));
        assert_eq!((codes, nearest), (vec![[1.0]], vec![0, 0]));
        let (codes, nearest) = k_means(&vectors, &[0.0, 0.0], 9, 3, &mut ChaCha8Rng::seed_from_u64(1));
        assert_eq!(nearest.iter().map(|code| codes[*code]).collect::<Vec<_>>(), vectors, "a code for each");
        let (codes, _) =
            k_means(&[[1.0], [2.0], [3.0], [4.0]], &[0.0, 1.0, 0.0, 1.0], 2, 0, &mut ChaCha8Rng::seed_from_u64(1));
        assert!(codes.contains(&[2.0]) && codes.contains(&[4.0]), "{codes:?}");
        assert_eq!(k_means::<1>(&[], &[], 9, 3, &mut ChaCha8Rng::seed_from_u64(1)), (vec![], vec![]));
    }
}
