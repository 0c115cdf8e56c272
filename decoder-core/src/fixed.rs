//! Numbers with a fixed point, made without arithmetic of floats.

/// The integer nearest to x·2^`bits`, the larger of two in magnitude; ±(2³¹ − 1) where it is beyond, or x not a number.
///
/// # Budget
/// About 15 instructions, of integers alone.
#[inline]
pub(crate) fn fixed(x: f32, bits: i32) -> i32 {
    let word = x.to_bits();
    let fraction = word & 0x7F_FFFF | 0x80_0000;
    let exponent = (word >> 23 & 0xFF) as i32 - 150 + bits;
    let magnitude = match exponent {
        ..-24 => 0,
        -24..0 => fraction.wrapping_add(1_u32.wrapping_shl((-1 - exponent) as u32)).wrapping_shr(-exponent as u32),
        0..8 => fraction.wrapping_shl(exponent as u32),
        8.. => 0x7FFF_FFFF,
    } as i32;
    if word >> 31 == 0 { magnitude } else { -magnitude }
}

/// As [`fixed`], of the half with these bits; below 2⁻¹⁴ in magnitude it may be 2⁻¹⁴ off, and what is
/// infinite or no number counts as 65,536 or more.
#[inline]
pub(crate) fn fixed_half(half: u16, bits: i32) -> i32 {
    let half = u32::from(half);
    // The exponents' biases differ by 112.
    let magnitude = ((half & 0x7FFF) << 13) + (112 << 23);
    fixed(f32::from_bits((half & 0x8000) << 16 | magnitude), bits)
}

#[cfg(test)]
mod tests {
    use super::{fixed, fixed_half};

    #[test]
    fn numbers_round_to_the_nearest_and_saturate() {
        let mut state = 1_u32;
        for _ in 0..200_000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let (x, bits) = (f32::from_bits(state), (state >> 7) as i32 % 30);
            let exact = f64::from(x) * f64::from(bits).exp2();
            let expected =
                if exact.is_nan() { continue } else { exact.round().clamp(-2_147_483_647.0, 2_147_483_647.0) };
            assert!((f64::from(fixed(x, bits)) - expected).abs() < 0.5, "{x:e} with {bits} bits");
        }
        assert_eq!([f32::INFINITY, f32::NEG_INFINITY].map(|x| fixed(x, 0)), [i32::MAX, -i32::MAX]);
        assert_eq!([0.0, -0.0, 1e-45, 0.25, 0.5, -0.5, 1.5].map(|x| fixed(x, 0)), [0, 0, 0, 0, 1, -1, 2]);
    }

    #[test]
    fn halves_are_as_their_values() {
        for bits in 0..=u16::MAX {
            let value = half::f16::from_bits(bits).to_f32();
            if value.is_finite() {
                let (found, expected) = (fixed_half(bits, 12), fixed(value, 12));
                assert!(found == expected || value.abs() < 2.0_f32.powi(-14), "{value}: {found}, not {expected}");
                assert!(found.abs_diff(expected) <= 1, "{value}");
            }
        }
    }
}
