//! Order by depth: a radix sort of indices, stable, without recursion.

use crate::project::PackedSplat;

/// Values of one digit.
pub(crate) const N_RADIX: usize = 256;

/// Fills `order` with the indices of `splats`, nearest first; equal depths keep their order.
///
/// Least significant digit first over the bits of the depths: a positive float's bits ascend with its value. A digit
/// that all depths share costs no pass.
///
/// * `order`, `spare`: one entry a splat; the result may end in either, so the slices come back in their new roles.
/// * `counts`: [`N_RADIX`] entries.
///
/// # Budget
/// At most eight passes over the splats.
// Not inlined: it has two callers.
#[inline(never)]
pub(crate) fn sort_by_depth<'o>(
    splats: &[PackedSplat],
    mut order: &'o mut [u32],
    mut spare: &'o mut [u32],
    counts: &mut [u32],
) -> (&'o mut [u32], &'o mut [u32]) {
    for (index, slot) in (0..).zip(order.iter_mut()) {
        *slot = index;
    }
    let digit_of = |index: u32, shift: u32| {
        let bits = splats.get(index as usize).map_or(0, |splat| splat.depth().to_bits());
        ((bits >> shift) & 0xFF) as usize
    };
    for shift in [0, 8, 16, 24] {
        counts.fill(0);
        for splat in splats {
            if let Some(count) = counts.get_mut(((splat.depth().to_bits() >> shift) & 0xFF) as usize) {
                *count += 1;
            }
        }
        if counts.iter().any(|&count| count as usize == splats.len()) {
            continue;
        }
        let mut start = 0;
        for count in counts.iter_mut() {
            start += core::mem::replace(count, start);
        }
        for &index in order.iter() {
            let Some(start) = counts.get_mut(digit_of(index, shift)) else { continue };
            if let Some(slot) = spare.get_mut(*start as usize) {
                *slot = index;
            }
            *start += 1;
        }
        core::mem::swap(&mut order, &mut spare);
    }
    (order, spare)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use bytemuck::Zeroable;

    use super::{N_RADIX, sort_by_depth};
    use crate::project::{PackedSplat, Splat};

    #[test]
    fn nearest_first_and_ties_in_order() {
        let mut state = 1_u32;
        let splats: Vec<PackedSplat> = (0..1000)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                PackedSplat::new(&Splat { depth: 0.2 + (state >> 22) as f32 * 0.03, ..Splat::zeroed() })
            })
            .collect();
        let (mut a, mut b) = ([0; 1000], [0; 1000]);
        let (order, _) = sort_by_depth(&splats, &mut a, &mut b, &mut [0; N_RADIX]);
        // The standard library's sort is stable.
        let mut expected: Vec<u32> = (0..1000).collect();
        expected.sort_by(|&i, &j| splats[i as usize].depth().total_cmp(&splats[j as usize].depth()));
        assert_eq!(order, expected);
    }
}
