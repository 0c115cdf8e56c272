//! Order by depth: a radix sort of indices, stable, without recursion.

use super::blend::Splats;
use crate::project::PackedSplat;

/// Values of one digit.
pub(crate) const N_RADIX: usize = 256;

/// Shifts of the digits, the least significant first.
pub(crate) const DIGITS: [u32; 4] = [0, 8, 16, 24];

/// Puts the indices of `splats` into the order of one digit of their depths, those of equal digits as they were; returns whether the
/// result is in `spare`, and not in `order`. After all [`DIGITS`], with the slices in their new roles, the nearest splat is first: a
/// positive float's bits ascend with its value.
///
/// * `order`, `spare`: one entry a splat; at the first digit `order` needs no content. * `counts`: [`N_RADIX`] entries.
///
/// # Budget
/// Two passes over the splats; one where all share the digit.
// Not inlined: it has two callers.
#[inline(never)]
pub(crate) fn order_by_digit(
    splats: &[PackedSplat],
    order: &mut [u32],
    spare: &mut [u32],
    counts: &mut [u32],
    shift: u32,
) -> bool {
    if shift == 0 {
        for (index, slot) in (0..).zip(order.iter_mut()) {
            *slot = index;
        }
    }
    let digit_of = |index: u32| {
        let bits = splats.get(index as usize).map_or(0, |splat| splat.depth().to_bits());
        ((bits >> shift) & 0xFF) as usize
    };
    counts.fill(0);
    for splat in splats {
        if let Some(count) = counts.get_mut(((splat.depth().to_bits() >> shift) & 0xFF) as usize) {
            *count += 1;
        }
    }
    if counts.iter().any(|&count| count as usize == splats.len()) {
        return false;
    }
    let mut start = 0;
    for count in counts.iter_mut() {
        start += core::mem::replace(count, start);
    }
    for &index in order.iter() {
        let Some(start) = counts.get_mut(digit_of(index)) else { continue };
        if let Some(slot) = spare.get_mut(*start as usize) {
            *slot = index;
        }
        *start += 1;
    }
    true
}

/// The same of the splats of a list, whose content is in `order` from the first digit on.
#[inline(never)]
pub(crate) fn order_list_by_digit(
    splats: &impl Splats,
    order: &[u32],
    spare: &mut [u32],
    counts: &mut [u32],
    shift: u32,
) -> bool {
    let digit_of = |number: u32| {
        let bits = splats.splat(number).map_or(0, |(_, splat)| splat.depth().to_bits());
        ((bits >> shift) & 0xFF) as usize
    };
    counts.fill(0);
    for &number in order {
        if let Some(count) = counts.get_mut(digit_of(number)) {
            *count += 1;
        }
    }
    if counts.iter().any(|&count| count as usize == order.len()) {
        return false;
    }
    let mut start = 0;
    for count in counts.iter_mut() {
        start += core::mem::replace(count, start);
    }
    for &number in order {
        let Some(start) = counts.get_mut(digit_of(number)) else { continue };
        if let Some(slot) = spare.get_mut(*start as usize) {
            *slot = number;
        }
        *start += 1;
    }
    true
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use bytemuck::Zeroable;

    use super::{DIGITS, N_RADIX, order_by_digit};
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
        let (mut order, mut spare) = (&mut a, &mut b);
        for shift in DIGITS {
            if order_by_digit(&splats, order, spare, &mut [0; N_RADIX], shift) {
                std::mem::swap(&mut order, &mut spare);
            }
        }
        // The standard library's sort is stable.
        let mut expected: Vec<u32> = (0..1000).collect();
        expected.sort_by(|&i, &j| splats[i as usize].depth().total_cmp(&splats[j as usize].depth()));
        assert_eq!(order[..], expected);
    }
}
