//! Splats by depth.

use rayon::prelude::*;

/// Numbers of the depths, ascending; of equal ones the lower number first.
///
/// Depths are positive, so their bits order as they do. Cost: a sort of n keys of 64 bits, on all threads.
pub fn by_depth(depths: impl IndexedParallelIterator<Item = f32>) -> Vec<u32> {
    let mut keys: Vec<u64> = depths.enumerate().map(|(i, depth)| u64::from(depth.to_bits()) << 32 | i as u64).collect();
    keys.par_sort_unstable();
    #[expect(clippy::cast_possible_truncation, reason = "the lower half is the number")]
    keys.into_par_iter().map(|key| key as u32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::random;

    #[test]
    fn depths_ascend_and_ties_keep_their_order() {
        let spread = |n: usize, decades: f64| random(4, n).into_iter().map(move |v| 10f64.powf(decades * v) as f32);
        // Far apart; in one octave; with many ties; one; none.
        let far = spread(5_000, 20.0).collect::<Vec<_>>();
        let near = spread(5_000, 0.1).collect::<Vec<_>>();
        let ties = spread(5_000, 1.0).map(f32::ceil).collect::<Vec<_>>();
        for depths in [far, near, ties, vec![2.0], vec![]] {
            let mut expected: Vec<u32> = (0..u32::try_from(depths.len()).expect("small")).collect();
            expected.sort_by(|a, b| depths[*a as usize].total_cmp(&depths[*b as usize]));
            assert_eq!(by_depth(depths.par_iter().copied()), expected);
        }
    }
}
