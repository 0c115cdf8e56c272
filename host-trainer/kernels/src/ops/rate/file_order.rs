//! The order of anchors in a bundle: tiers by importance, in each the Morton curve, cut into chunks.

use std::ops::Range;

/// Pruning rates of the tiers where nobody asks for others.
pub const PRUNING_RATES: [f32; 6] = [0.40, 0.30, 0.20, 0.10, 0.05, 0.0];
/// Anchors of a chunk at most where nobody asks for another number: neighbours enough to pay for its record, few enough to skip.
pub const CHUNK_ANCHORS: u16 = 256;

/// The code of a cell that lies so far from the lowest one: bits of z, y and x in turn from the highest on, x lowest.
///
/// * `n_bits`: of a coordinate, at most 21.
pub fn code(offset: [u32; 3], n_bits: u32) -> u64 {
    (0..n_bits).fold(0, |code, bit| {
        (0..3).fold(code, |code, axis| code | (u64::from((offset[axis] >> bit) & 1) << (3 * bit + axis as u32)))
    })
}

/// `coordinate` lowered to a multiple of 2^shift, so that the curve goes through cells of that edge one after the other.
pub fn aligned(coordinate: i32, shift: u8) -> i32 {
    (coordinate >> shift) << shift
}

/// Puts the more important anchors first; of equally important ones the earlier stays the earlier.
pub fn sort_by_importance(order: &mut [usize], importance: &[f32]) {
    order.sort_by(|&a, &b| importance[b].total_cmp(&importance[a]));
}

/// Anchors up to and with each tier.
///
/// * `pruning_rates`: of the scene that ends with each tier, falling to 0: the share of anchors that it lacks.
pub fn tier_ends(n_anchors: usize, pruning_rates: &[f32]) -> Vec<usize> {
    pruning_rates.iter().map(|&rate| ((1.0 - f64::from(rate)) * n_anchors as f64).round() as usize).collect()
}

/// Sorts each tier of anchors by its codes and cuts it into chunks.
///
/// * returns the anchors of each chunk, and the chunks up to and with each tier.
pub fn cut(
    order: &mut [usize],
    tier_ends: &[usize],
    chunk_anchors: usize,
    code: impl Fn(&usize) -> u64,
) -> (Vec<Range<usize>>, Vec<usize>) {
    let (mut chunks, mut tier_chunks, mut begin) = (Vec::new(), Vec::new(), 0);
    for &end in tier_ends {
        order[begin..end].sort_by_cached_key(&code);
        // Chunks of a tier differ by one anchor at most.
        let (n, n_chunks) = (end - begin, (end - begin).div_ceil(chunk_anchors));
        chunks.extend((0..n_chunks).map(|i| begin + i * n / n_chunks..begin + (i + 1) * n / n_chunks));
        tier_chunks.push(chunks.len());
        begin = end;
    }
    (chunks, tier_chunks)
}
