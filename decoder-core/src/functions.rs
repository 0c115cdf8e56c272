//! Exponential, logarithm and the heads' activations, to two accuracies.

use pocketsplat_format::math::{self, EXP_MAX, EXP_MIN};

/// The transcendental functions of a frame; none returns NaN or infinity for a number.
pub(crate) trait Functions {
    /// eˣ, x held within [`EXP_MIN`] and [`EXP_MAX`].
    fn exp(x: f32) -> f32;

    /// The natural logarithm of a positive number that is not subnormal.
    fn ln(x: f32) -> f32;

    /// 1/(1 + e⁻ˣ).
    #[inline(always)]
    fn sigmoid(x: f32) -> f32 {
        1.0 / (1.0 + Self::exp(-x))
    }

    /// The hyperbolic tangent of x ≥ 0.
    #[inline(always)]
    fn tanh(x: f32) -> f32 {
        1.0 - 2.0 / (Self::exp(2.0 * x) + 1.0)
    }
}

/// Those of [`math`], right to 4·10⁻⁷; the logarithm is libm's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reference;

impl Functions for Reference {
    #[inline(always)]
    fn exp(x: f32) -> f32 {
        math::exp(x)
    }

    #[inline(always)]
    fn ln(x: f32) -> f32 {
        libm::logf(x)
    }

    #[inline(always)]
    fn sigmoid(x: f32) -> f32 {
        math::sigmoid(x)
    }

    #[inline(always)]
    fn tanh(x: f32) -> f32 {
        math::tanh(x)
    }
}

/// 2ˣ from 64 values and the tangent there, right to 2·10⁻⁵; a polynomial for the logarithm, right to 8·10⁻⁵.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Table;

impl Functions for Table {
    #[inline(always)]
    fn exp(x: f32) -> f32 {
        let x = clamped(x);
        let shifted = x * (core::f32::consts::LOG2_E * 64.0) + ROUNDER;
        let r = x - (shifted - ROUNDER) * (core::f32::consts::LN_2 / 64.0);
        let bits = shifted.to_bits();
        let value = TWO_TO_SIXTY_FOURTHS.get((bits & 63) as usize).copied().unwrap_or_default();
        let tangent = value + value * r;
        f32::from_bits(tangent.to_bits().wrapping_add((bits & !63) << 17))
    }

    /// The exponent times ln 2, and a polynomial of the fraction.
    #[inline(always)]
    fn ln(x: f32) -> f32 {
        let exponent = (x.to_bits() as i32 >> 23) - 127;
        let t = f32::from_bits(x.to_bits() & 0x7F_FFFF | 1.0_f32.to_bits()) - 1.0;
        let [c0, c1, c2, c3] = LN_OF_ONE_AND_T;
        exponent as f32 * core::f32::consts::LN_2 + t * (c0 + t * (c1 + t * (c2 + t * c3)))
    }
}

/// Added and subtracted, it rounds to the nearest integer and leaves that integer in the low bits: 1.5 · 2²³.
const ROUNDER: f32 = 12_582_912.0;
/// `ln(1 + t)/t` for 0 ≤ t < 1, the least largest error of the logarithm: 7.1·10⁻⁵.
const LN_OF_ONE_AND_T: [f32; 4] = [0.997_449, -0.471_301_36, 0.225_685_82, -0.058_757_197];
/// 2^(i/64).
const TWO_TO_SIXTY_FOURTHS: [f32; 64] = {
    let mut values = [0.0; 64];
    let (mut power, mut i) = (1.0_f64, 0);
    while i < values.len() {
        values[i] = power as f32;
        power *= 1.010_889_286_051_700_5;
        i += 1;
    }
    values
};

/// Within [`EXP_MIN`] and [`EXP_MAX`]; NaN passes through.
#[inline(always)]
fn clamped(x: f32) -> f32 {
    let x = if x < EXP_MIN { EXP_MIN } else { x };
    if x > EXP_MAX { EXP_MAX } else { x }
}

#[cfg(test)]
mod tests {
    use std::format;
    use std::vec::Vec;

    use super::{Functions, Reference, Table};
    use pocketsplat_format::bundle::crc32;

    /// Largest relative errors of the exponential, and largest errors of logarithm, sigmoid and tanh.
    fn errors<F: Functions>() -> [f64; 4] {
        let steps = 200_000;
        let along = |low: f32, high: f32| (0..=steps).map(move |i| low + (high - low) * (i as f32 / steps as f32));
        let worst = |errors: &mut dyn Iterator<Item = f64>| errors.fold(0.0, f64::max);
        [
            worst(&mut along(-87.0, 88.0).map(|x| (f64::from(F::exp(x)) / f64::from(x).exp() - 1.0).abs())),
            worst(&mut along(1e-6, 4.0).map(|x| (f64::from(F::ln(x)) - f64::from(x).ln()).abs())),
            worst(
                &mut along(-90.0, 90.0).map(|x| (f64::from(F::sigmoid(x)) - 1.0 / (1.0 + (-f64::from(x)).exp())).abs()),
            ),
            worst(&mut along(0.0, 90.0).map(|x| (f64::from(F::tanh(x)) - f64::from(x).tanh()).abs())),
        ]
    }

    /// Square roots and roundings are exact by IEEE 754; the logarithm is not, and decides the bits of frames.
    #[test]
    fn libm_has_the_bits_that_frames_were_made_with() {
        // Every 997th positive normal number.
        let every = (0x0080_0000..0x7F80_0000).step_by(997);
        let bits: Vec<u8> = every.flat_map(|x| libm::logf(f32::from_bits(x)).to_bits().to_le_bytes()).collect();
        assert_eq!(format!("{:08x}", crc32(&bits)), "0c3b2118", "another libm draws other frames: pin the one before");
    }

    #[test]
    fn functions_err_by_less_than_they_say() {
        for (name, errors, bounds) in [
            ("reference", errors::<Reference>(), [2e-7, 1e-6, 4e-7, 4e-7]),
            ("table", errors::<Table>(), [2e-5, 8e-5, 2e-5, 2e-5]),
        ] {
            for (error, bound) in errors.into_iter().zip(bounds) {
                assert!(error <= bound, "{name}: {errors:?} against {bounds:?}");
            }
        }
    }

    /// What the decoder does with whatever it is given stays a number.
    fn stays_finite<F: Functions>() {
        for x in [0.0, -0.0, 1e-45, 1e-30, 0.5, 87.3, 88.1, 1e9, f32::MAX, f32::INFINITY] {
            assert!(F::exp(x).is_finite() && F::exp(-x) > 0.0, "{x}");
            assert!((0.0..=1.0).contains(&F::sigmoid(x)) && (0.0..=1.0).contains(&F::sigmoid(-x)), "{x}");
            assert!((0.0..=1.0).contains(&F::tanh(x)), "{x}");
        }
    }

    #[test]
    fn no_argument_leaves_the_range() {
        stays_finite::<Reference>();
        stays_finite::<Table>();
    }
}
