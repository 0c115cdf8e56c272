//! Splats as they are kept in memory.

use bytemuck::{Pod, Zeroable};
use pocketsplat_format::math::to_half;
use pocketsplat_half::from_halves;

use super::splat::Splat;
use crate::fixed::fixed_half;

/// Bits of 2⁻⁶¹, which stands for every smaller precision: a deviation of 1.5·10⁹ px.
const LEAST_PRECISION: u32 = (127 - 61) << 23;
/// What a float has more digits than are kept.
const DIGITS_DROPPED: u32 = 13;

/// A splat as it is kept in memory, 28 bytes: place, depth and shear as f32, everything else rounded to the eleven bits of halves.
///
/// Shear is multiplied by the distance from the centre: eleven bits of it would move the far end of a needle that crosses a
/// frame of 500 pixels by an eighth of a pixel, and one whose centre lies as far outside by as much more.
///
/// What the others cost: each number moves by at most 2⁻¹² of itself, so at the rim, where the exponent is 5.5, alpha by
/// 0.3 % of what is left there, and a colour by a sixteenth of a step of 8 bits.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PackedSplat {
    mean: [f32; 2],
    depth: f32,
    shear: f32,
    rest: HalfFields,
}

impl PackedSplat {
    /// Rounds a splat.
    pub(crate) fn new(splat: &Splat) -> Self {
        Self { mean: splat.mean, depth: splat.depth, shear: splat.shear, rest: HalfFields::new(splat) }
    }

    /// The splat, rounded.
    #[inline]
    pub(crate) fn unpack(&self) -> Splat {
        self.rest.unpack(self.mean, self.depth, self.shear)
    }

    /// Centre, shear, and the precisions along a row and across rows, as in [`Splat`].
    #[inline(always)]
    pub(crate) fn shape(&self) -> ([f32; 2], f32, [f32; 2]) {
        (self.mean, self.shear, [self.rest.row_precision, self.rest.column_precision].map(unpack_precision))
    }

    /// Natural logarithm of the opacity, and the colour, with so many bits behind the point.
    #[inline(always)]
    pub(crate) fn fixed(&self, opacity_bits: i32, colour_bits: i32) -> (i32, [i32; 3]) {
        let colour = self.rest.colour.map(|half| fixed_half(half, colour_bits));
        (fixed_half(self.rest.log_opacity, opacity_bits), colour)
    }

    /// z in the camera frame, positive.
    #[inline]
    pub(crate) fn depth(&self) -> f32 {
        self.depth
    }
}

/// What of a [`Splat`] is kept in 16 bits.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct HalfFields {
    row_precision: u16,
    column_precision: u16,
    log_opacity: u16,
    colour: [u16; 3],
}

impl HalfFields {
    #[inline]
    fn new(splat: &Splat) -> Self {
        Self {
            row_precision: pack_precision(splat.row_precision),
            column_precision: pack_precision(splat.column_precision),
            log_opacity: to_half(splat.log_opacity),
            colour: splat.colour.map(to_half),
        }
    }

    /// The splat, with what is kept as f32.
    #[inline]
    fn unpack(&self, mean: [f32; 2], depth: f32, shear: f32) -> Splat {
        let [red, green, blue] = self.colour;
        let [log_opacity, colour @ ..] = from_halves([self.log_opacity, red, green, blue]);
        Splat {
            mean,
            depth,
            shear,
            row_precision: unpack_precision(self.row_precision),
            column_precision: unpack_precision(self.column_precision),
            log_opacity,
            colour,
        }
    }
}

/// Rounds a precision to eleven bits, as a half has them; but six bits of exponent and no sign, because precisions lie
/// between 6 px⁻², that of the least dilation, and those of splats far larger than a frame whose rim alone may cross it.
fn pack_precision(precision: f32) -> u16 {
    let above = precision.to_bits().saturating_sub(LEAST_PRECISION);
    let rounded = above.saturating_add(1 << (DIGITS_DROPPED - 1)) >> DIGITS_DROPPED;
    // Not reached: the largest stands for 8.
    rounded.min(u16::MAX.into()) as u16
}

#[inline]
fn unpack_precision(packed: u16) -> f32 {
    f32::from_bits((u32::from(packed) << DIGITS_DROPPED).wrapping_add(LEAST_PRECISION))
}

#[cfg(test)]
mod tests {
    use super::PackedSplat;
    use crate::project::Splat;

    #[test]
    fn splats_of_all_sizes_keep_eleven_bits() {
        for sigma_px in [0.41_f32, 1.0, 7.3, 120.0, 5000.0, 1e5, 5e8] {
            let precision = 1.0 / (sigma_px * sigma_px);
            let splat = Splat {
                mean: [-123.456, 7.891],
                shear: -sigma_px / 3.0,
                row_precision: precision,
                column_precision: precision * 0.37,
                log_opacity: -2.345,
                colour: [0.123, 0.987, -0.0456],
                depth: 3.21,
            };
            let kept = PackedSplat::new(&splat).unpack();
            let exact = |s: &Splat| (s.mean, s.depth, s.shear);
            assert_eq!(exact(&kept), exact(&splat), "as they are");
            let numbers = |s: &Splat| {
                let [red, green, blue] = s.colour;
                [s.row_precision, s.column_precision, s.log_opacity, red, green, blue]
            };
            for (kept, whole) in numbers(&kept).into_iter().zip(numbers(&splat)) {
                assert!((kept - whole).abs() <= whole.abs() / 2048.0, "{kept} for {whole} at {sigma_px} px");
            }
        }
    }
}
