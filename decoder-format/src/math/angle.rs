//! Sine and cosine of an angle.

use core::f32::consts::FRAC_2_PI;

/// π/2 in three parts; a product of the first or the second with a number of up to 13 bits is exact (Cody and Waite 1980).
const QUARTER_TURN: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];
/// (sin r − r)/r³ for |r| ≤ π/4 in powers of r², from the last (Cephes).
const SIN: [f32; 3] = [-1.951_529_6e-4, 8.332_161e-3, -1.666_665_5e-1];
/// (cos r − 1 + r²/2)/r⁴ likewise.
const COS: [f32; 3] = [2.443_315_7e-5, -1.388_731_6e-3, 4.166_664_6e-2];

/// sin x and cos x, x in radians, right to 10⁻⁷ for |x| ≤ 8192; exactly 0 and 1 for 0.
///
/// r = x − n·π/2 with n the nearest whole number, then a polynomial each in r²; `libm`'s would take 64-bit numbers and ten times the code.
///
/// ```
/// let [sin, cos] = pocketsplat_format::math::sin_cos(core::f32::consts::FRAC_PI_6);
/// assert!((sin - 0.5).abs() < 1e-7 && (cos * cos - 0.75).abs() < 2e-7);
/// ```
#[must_use]
pub fn sin_cos(x: f32) -> [f32; 2] {
    let quarters = x * FRAC_2_PI;
    let n = (quarters + if quarters < 0.0 { -0.5 } else { 0.5 }) as i32;
    let r = QUARTER_TURN.into_iter().fold(x, |rest, part| rest - n as f32 * part);
    let rr = r * r;
    let in_powers = |[a, b, c]: [f32; 3]| (a * rr + b) * rr + c;
    let sin = in_powers(SIN) * rr * r + r;
    let cos = in_powers(COS) * rr * rr - 0.5 * rr + 1.0;
    match n & 3 {
        0 => [sin, cos],
        1 => [cos, -sin],
        2 => [-sin, -cos],
        _ => [-cos, sin],
    }
}

#[cfg(test)]
mod tests {
    use core::f32::consts::TAU;
    use std::format;

    use super::sin_cos;
    use crate::bytes::crc32_of;

    fn angles() -> impl Iterator<Item = f32> {
        (-100_000..=100_000).map(|i| i as f32 * (TAU / 100_000.0))
    }

    #[test]
    fn sine_and_cosine_err_by_less_than_they_say() {
        let far = (-8192..=8192_i16).map(f32::from);
        for x in angles().chain(far) {
            let [sin, cos] = sin_cos(x).map(f64::from);
            let (right_sin, right_cos) = f64::from(x).sin_cos();
            let error = (sin - right_sin).abs().max((cos - right_cos).abs());
            assert!(error <= 1e-7, "{error:e} at {x}");
        }
        assert_eq!((sin_cos(0.0), sin_cos(-0.0)), ([0.0, 1.0], [0.0, 1.0]));
    }

    #[test]
    fn an_orbit_has_the_bits_that_frames_were_made_with() {
        let bits = angles().flat_map(sin_cos).flat_map(|x| x.to_bits().to_le_bytes());
        assert_eq!(format!("{:08x}", crc32_of(bits)), "6f457996");
    }
}
