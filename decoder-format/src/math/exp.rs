//! The exponential function.

use pocketsplat_half::Exponential;

/// Below this argument [`exp`] stays at `exp(EXP_MIN)` ≈ 1.6e-38, the last value that is not subnormal.
pub const EXP_MIN: f32 = -87.0;

/// Above this argument [`exp`] stays at `exp(EXP_MAX)` ≈ 1.7e38, which is still finite.
pub const EXP_MAX: f32 = 88.0;

/// x = n·ln 2 + r with |r| ≤ ½ ln 2, eˣ = 2ⁿ·eʳ.
///
/// The rounder, 1.5 · 2²³, added and subtracted, rounds to the nearest integer and leaves that integer in the low bits. The first part of
/// ln 2 has 9 significant bits, so its product with |n| ≤ 127 is exact (Cody and Waite 1980). The polynomial is interpolated at the
/// Chebyshev nodes; with r² it errs by less than 1e-8.
pub const EXPONENTIAL: Exponential = Exponential {
    log2_e: core::f32::consts::LOG2_E,
    rounder: 12_582_912.0,
    ln_2: [355.0 / 512.0, -2.121_944_4e-4],
    tail: [0.001_392_692_7, 0.008_363_774, 0.041_666_55, 0.166_665_73],
};

/// Returns eˣ with a relative error below 2e-7 for x in [`EXP_MIN`]..=[`EXP_MAX`].
///
/// x = n·ln 2 + r with |r| ≤ ½ ln 2, eˣ = 2ⁿ·eʳ. Arguments outside the range are clamped to it, so the result is always
/// finite and never zero or subnormal; NaN stays NaN.
///
/// # Budget
/// About 20 instructions, no division, no branch.
///
/// ```
/// assert_eq!(pocketsplat_format::math::exp(0.0), 1.0);
/// assert!((pocketsplat_format::math::exp(1.0) - core::f32::consts::E).abs() < 5e-7);
/// ```
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    // Comparisons, not `f32::max`: NaN passes through, and no library call remains on a Cortex-M4.
    let x = if x < EXP_MIN { EXP_MIN } else { x };
    let x = if x > EXP_MAX { EXP_MAX } else { x };
    exp_near(x)
}

/// [`exp`] without its clamp: for arguments known to lie in [`EXP_MIN`]..=[`EXP_MAX`]; others give some number or NaN.
///
/// # Budget
/// About 15 instructions, no division, no branch.
#[inline(always)]
pub(super) fn exp_near(x: f32) -> f32 {
    EXPONENTIAL.near(x)
}

#[cfg(test)]
mod tests {
    use super::{EXP_MAX, EXP_MIN, exp};

    #[test]
    fn relative_error_stays_below_the_documented_bound() {
        let steps = 4_000_000;
        let mut worst = (0.0_f64, 0.0_f32);
        for i in 0..=steps {
            let x = EXP_MIN + (EXP_MAX - EXP_MIN) * (i as f32 / steps as f32);
            let exact = f64::from(x).exp();
            let error = (f64::from(exp(x)) / exact - 1.0).abs();
            if error > worst.0 {
                worst = (error, x);
            }
        }
        assert!(worst.0 <= 2e-7, "relative error {} at {}", worst.0, worst.1);
    }

    #[test]
    fn arguments_outside_the_range_are_clamped() {
        assert_eq!(exp(-1e30), exp(EXP_MIN), "far below");
        assert_eq!(exp(f32::NEG_INFINITY), exp(EXP_MIN), "minus infinity");
        assert_eq!(exp(1e30), exp(EXP_MAX), "far above");
        assert!(exp(EXP_MAX).is_finite() && exp(EXP_MIN).is_normal(), "ends of the range are normal numbers");
        assert!(exp(f32::NAN).is_nan(), "NaN stays NaN");
    }

    #[test]
    fn bits_are_the_same_on_every_target() {
        // Golden: a fold over the bit patterns of a fixed argument list; the same number must come out everywhere.
        let digest = (-2000..2000)
            .fold(0x811c_9dc5_u32, |h, i: i16| (h ^ exp(f32::from(i) * 0.0431).to_bits()).wrapping_mul(0x0100_0193));
        assert_eq!(digest, GOLDEN, "digest {digest:#010x}");
    }

    const GOLDEN: u32 = 0x469f_9e46;
}
