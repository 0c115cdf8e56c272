//! Conversions by shifts and one multiplication, for every target.

pub mod integer;
pub mod layer;
pub mod root;
pub mod rows;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64", target_family = "wasm"))]
mod rows_in_fours;
pub mod symbols;

/// Whether the processor converts halves itself.
pub const IN_HARDWARE: bool = false;

/// 2¹¹²: what the two formats' exponent biases differ by.
const BIAS_RATIO: f32 = f32::from_bits((127 + 112) << 23);
/// The smallest half whose fraction is a whole one, 2⁻¹⁴; the steps below are 2⁻²⁴, as are those of floats from ½ to 1.
const SMALLEST_NORMAL: f32 = f32::from_bits((127 - 14) << 23);
/// The largest finite half, 65 504.
const MAX_BITS: u32 = 0x7BFF;

/// The bits of the half nearest to `x`, ties to even; what is larger than 65,504 in magnitude becomes that, NaN too.
///
/// # Budget
/// About 10 instructions; 6 where the processor converts.
#[inline]
#[must_use]
pub fn to_half(x: f32) -> u16 {
    let magnitude = x.abs();
    let rounded = if magnitude < SMALLEST_NORMAL {
        (magnitude + 0.5).to_bits() - 0.5_f32.to_bits()
    } else {
        // With the exponent of a half the upper bits are those of a half, to be rounded where its fraction ends.
        let bits = (magnitude / BIAS_RATIO).to_bits();
        (bits + 0xFFF + ((bits >> 13) & 1)) >> 13
    };
    let sign = (x.to_bits() >> 16) & 0x8000;
    (rounded.min(MAX_BITS) | sign) as u16
}

/// The value of the bits of a finite half, exactly.
///
/// Of other bits it is at least 65,536 in magnitude, or NaN, and not the same on every target.
///
/// # Budget
/// About 5 instructions; 4 where the processor converts.
#[inline]
#[must_use]
pub fn from_half(bits: u16) -> f32 {
    let magnitude = f32::from_bits(u32::from(bits & 0x7FFF) << 13) * BIAS_RATIO;
    f32::from_bits(magnitude.to_bits() | u32::from(bits & 0x8000) << 16)
}

/// The values of four, as [`from_half`].
///
/// # Budget
/// About 20 instructions; 11 where the processor converts.
#[inline]
#[must_use]
pub fn from_halves(bits: [u16; 4]) -> [f32; 4] {
    bits.map(from_half)
}

/// Adds to two rows of eight sums each: `sums[i][lane] += weights[row][lane]·inputs[i][row]`, rows in order.
///
/// Weights are finite halves. Every product and every sum is rounded to f32. It ends with the shortest of the slices.
///
/// # Budget
/// Where the processor converts, 29 instructions for 16 products.
pub fn add_products(sums: &mut [[f32; 8]; 2], weights: &[[u16; 8]], inputs: [&[f32]; 2]) {
    let [first, second] = sums;
    let [first_inputs, second_inputs] = inputs;
    for ((row, &x), &y) in weights.iter().zip(first_inputs).zip(second_inputs) {
        for ((first, second), &weight) in first.iter_mut().zip(&mut *second).zip(row) {
            let weight = from_half(weight);
            *first += weight * x;
            *second += weight * y;
        }
    }
}

/// Whether the bits of a half are a number.
#[inline]
#[must_use]
pub const fn is_finite_half(bits: u16) -> bool {
    (bits & 0x7FFF) as u32 <= MAX_BITS
}

#[cfg(test)]
mod tests {
    use super::{from_half, to_half};
    use half::f16;

    #[test]
    fn every_finite_half_is_its_value_and_comes_back() {
        for bits in 0..=u16::MAX {
            let value = f16::from_bits(bits);
            if value.is_finite() {
                assert_eq!(from_half(bits).to_bits(), value.to_f32().to_bits(), "{bits:#06x}");
                assert_eq!(to_half(value.to_f32()), bits, "{bits:#06x}");
            }
        }
    }

    #[test]
    fn floats_round_to_the_nearest_half() {
        let mut state = 1_u32;
        for _ in 0..200_000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            // Exponents from far below the smallest half to the largest.
            let x = f32::from_bits((state & 0x807F_FFFF) | (95 + (state >> 8) % 47) << 23);
            assert_eq!(to_half(x), f16::from_f32(x).to_bits(), "{x:e}");
        }
        for (x, expected) in
            [(1e9, 65504.0), (-1e9, -65504.0), (f32::INFINITY, 65504.0), (65520.0, 65504.0), (f32::NAN, 65504.0)]
        {
            assert_eq!(from_half(to_half(x)), expected, "{x} saturates");
        }
    }
}
