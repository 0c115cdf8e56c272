//! Exponential, logarithm and the heads' activations, to two accuracies.

use pocketsplat_format::math::{self, EXP_MAX, EXP_MIN};

use crate::fixed::fixed;

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

/// In integers: 2ˣ from 65 values and the line between two of them, right to 2·10⁻⁵; a polynomial for the logarithm, right to 8·10⁻⁵.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Table;

impl Functions for Table {
    /// # Budget
    /// On RV32IMAC about 45 instructions.
    #[inline]
    fn exp(x: f32) -> f32 {
        Power::of_e(fixed(x, EXPONENT_BITS)).to_float()
    }

    /// The exponent times ln 2, and a polynomial of the fraction.
    #[inline]
    fn ln(x: f32) -> f32 {
        let exponent = (x.to_bits() as i32 >> 23) - 127;
        let t = (x.to_bits() & 0x7F_FFFF) as i32;
        let [c0, c1, c2, c3] = LN_OF_ONE_AND_T;
        let times_t = |y: i32| product(y, t, 23);
        let of_fraction = times_t(c0 + times_t(c1 + times_t(c2 + times_t(c3))));
        float(exponent.wrapping_mul(LN_2).wrapping_add(of_fraction), LN_BITS)
    }

    /// Of −|x|, whose exponential is not above 1.
    #[inline]
    fn sigmoid(x: f32) -> f32 {
        let power = Power::of_e(-fixed(x, EXPONENT_BITS).abs());
        let share = reciprocal(power.one_and());
        if x.is_sign_negative() { power.times(share).to_float() } else { from_half_to_one(share) }
    }

    /// (1 − e⁻²ˣ)/(1 + e⁻²ˣ).
    #[inline]
    fn tanh(x: f32) -> f32 {
        let power = Power::of_e(-fixed(x, EXPONENT_BITS + 1).max(0));
        let one_and = power.one_and();
        let one_less = (2 << ONE_BITS) - one_and;
        float(product(one_less as i32, reciprocal(one_and) as i32, ONE_BITS), ONE_BITS)
    }
}

/// Bits behind the point of exponents: the first six are the table's index.
const EXPONENT_BITS: i32 = 20;
const INDEX_BITS: i32 = 6;
/// Those of numbers from 0 to 2, and of logarithms.
const ONE_BITS: i32 = 30;
const LN_BITS: i32 = 24;
const LN_2: i32 = rounded(core::f64::consts::LN_2, LN_BITS);
const LOG2_E: i32 = rounded(core::f64::consts::LOG2_E, ONE_BITS);
/// `ln(1 + t)/t` for 0 ≤ t < 1, the least largest error of the logarithm: 7.1·10⁻⁵.
const LN_OF_ONE_AND_T: [i32; 4] = [
    rounded(0.997_449, LN_BITS),
    rounded(-0.471_301_36, LN_BITS),
    rounded(0.225_685_82, LN_BITS),
    rounded(-0.058_757_197, LN_BITS),
];
/// 2^(i/64), 23 bits behind the point.
static TWO_TO_SIXTY_FOURTHS: [u32; (1 << INDEX_BITS) + 1] = {
    let mut values = [0; (1 << INDEX_BITS) + 1];
    let (mut power, mut i) = (1.0_f64, 0);
    while i < values.len() {
        values[i] = rounded(power, 23) as u32;
        power *= 1.010_889_286_051_700_5;
        i += 1;
    }
    values
};

/// A power of e as `fraction · 2^exponent`.
#[derive(Clone, Copy)]
struct Power {
    /// From 1 to 2, 23 bits behind the point.
    fraction: u32,
    exponent: i32,
}

impl Power {
    /// eˣ, x with [`EXPONENT_BITS`] and held within [`EXP_MIN`] and [`EXP_MAX`].
    #[inline]
    fn of_e(x: i32) -> Self {
        const FINE_BITS: i32 = EXPONENT_BITS - INDEX_BITS;
        let x = x.clamp((EXP_MIN as i32) << EXPONENT_BITS, (EXP_MAX as i32) << EXPONENT_BITS);
        let x = product(x, LOG2_E, ONE_BITS);
        let index = ((x >> FINE_BITS) & ((1 << INDEX_BITS) - 1)) as usize;
        let &[low, high] = TWO_TO_SIXTY_FOURTHS.get(index..).and_then(<[u32]>::first_chunk).unwrap_or(&[1 << 23; 2]);
        let fine = (x & ((1 << FINE_BITS) - 1)) as u32;
        Self { fraction: low + (((high - low) * fine) >> FINE_BITS), exponent: x >> EXPONENT_BITS }
    }

    /// Its float; the fraction's first bit is one more of the exponent.
    #[inline]
    fn to_float(self) -> f32 {
        f32::from_bits((((self.exponent + 126) as u32) << 23).wrapping_add(self.fraction))
    }

    /// 1 more than it, which is not above 1, with [`ONE_BITS`].
    #[inline]
    fn one_and(self) -> u32 {
        (1 << ONE_BITS) + (self.fraction << (ONE_BITS - 23)).checked_shr(self.exponent.unsigned_abs()).unwrap_or(0)
    }

    /// Times a number from ½ to 1 with [`ONE_BITS`].
    #[inline]
    fn times(self, share: u32) -> Self {
        let fraction = product(self.fraction as i32, share as i32, ONE_BITS) as u32;
        let below_one = fraction < 1 << 23;
        Self { fraction: fraction << u32::from(below_one), exponent: self.exponent - i32::from(below_one) }
    }
}

/// x·y, of both bits behind the point so many fewer.
#[inline]
fn product(x: i32, y: i32, bits: i32) -> i32 {
    ((i64::from(x) * i64::from(y)) >> bits) as i32
}

/// 1/d for d from 1 to 2, both with [`ONE_BITS`]: a division of 32 bits and a step of Newton's method.
#[inline]
fn reciprocal(d: u32) -> u32 {
    let near = (u32::MAX / (d >> 15)) as i32;
    let error = ((1_i64 << 31) - ((i64::from(d) * i64::from(near)) >> 16)) as i32;
    ((near << 13) + (near.wrapping_mul(error >> 4) >> 14)) as u32
}

/// A number from ½ to 1 with [`ONE_BITS`], as a float.
#[inline]
fn from_half_to_one(x: u32) -> f32 {
    f32::from_bits((125 << 23) + (x >> (ONE_BITS - 24)))
}

/// A number with so many bits behind the point, as a float.
#[inline]
fn float(x: i32, bits: i32) -> f32 {
    let whole = x as f32;
    if x == 0 { whole } else { f32::from_bits(whole.to_bits().wrapping_sub((bits as u32) << 23)) }
}

const fn rounded(x: f64, bits: i32) -> i32 {
    let scaled = x * (1_i64 << bits) as f64;
    (scaled + if scaled < 0.0 { -0.5 } else { 0.5 }) as i32
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
