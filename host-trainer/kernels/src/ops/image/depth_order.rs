//! Splats by depth.

/// Bits of a key that one pass sorts by.
const DIGIT_BITS: u32 = 11;
const N_DIGITS: usize = 1 << DIGIT_BITS;
/// Passes over a key of 32 bits.
const N_PASSES: usize = 32usize.div_ceil(DIGIT_BITS as usize);

/// Numbers of the depths, ascending; of equal ones the lower number first.
///
/// Depths are positive, so their bits order as they do. A radix sort from the lowest digit up, whose every pass keeps the order of equal
/// digits. Cost: four passes over n keys, fewer where depths share their high bits.
pub fn by_depth(depths: impl Iterator<Item = f32>) -> Vec<u32> {
    let mut keys: Vec<(u32, u32)> = (0u32..).zip(depths).map(|(i, depth)| (depth.to_bits(), i)).collect();
    let digit = |key: u32, pass: usize| (key >> (pass as u32 * DIGIT_BITS)) as usize % N_DIGITS;
    let mut counts = vec![[0u32; N_DIGITS]; N_PASSES];
    for (key, _) in &keys {
        for (pass, counts) in counts.iter_mut().enumerate() {
            counts[digit(*key, pass)] += 1;
        }
    }
    let mut sorted = vec![(0, 0); keys.len()];
    for (pass, counts) in counts.iter_mut().enumerate() {
        if counts.iter().any(|count| *count as usize == keys.len()) {
            continue;
        }
        let mut before = 0;
        for count in counts.iter_mut() {
            before += std::mem::replace(count, before);
        }
        for key in &keys {
            let place = &mut counts[digit(key.0, pass)];
            sorted[*place as usize] = *key;
            *place += 1;
        }
        std::mem::swap(&mut keys, &mut sorted);
    }
    keys.into_iter().map(|(_, i)| i).collect()
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
            assert_eq!(by_depth(depths.iter().copied()), expected);
        }
    }
}
