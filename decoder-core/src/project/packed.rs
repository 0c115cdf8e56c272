//! Splats as they wait in memory: 28 bytes, most numbers rounded to halves.

use bytemuck::{Pod, Zeroable};

use super::splat::Splat;
use crate::math::{from_half, to_half};

/// Precisions lie between 1/0.3 px⁻², the dilation's, and those of splats far larger than a frame: times 2¹² they keep a
/// half's eleven bits down to a standard deviation of 8,000 pixels.
const PRECISION_UNIT: f32 = 1.0 / 4096.0;

/// A [`Splat`], its place and depth as they are, everything else rounded to eleven bits.
///
/// What that costs: each number moves by at most 2⁻¹² of itself, so at the rim, where the exponent is 5.5, alpha by 0.3 %
/// of what is left there, and a colour by a sixteenth of a step of 8 bits.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PackedSplat {
    mean: [f32; 2],
    pub(crate) depth: f32,
    shear: u16,
    row_precision: u16,
    column_precision: u16,
    log_opacity: u16,
    colour: [u16; 3],
    _unused: u16,
}

impl PackedSplat {
    /// Rounds a splat.
    pub(crate) fn new(splat: &Splat) -> Self {
        Self {
            mean: splat.mean,
            depth: splat.depth,
            shear: to_half(splat.shear),
            row_precision: to_half(splat.row_precision / PRECISION_UNIT),
            column_precision: to_half(splat.column_precision / PRECISION_UNIT),
            log_opacity: to_half(splat.log_opacity),
            colour: splat.colour.map(to_half),
            _unused: 0,
        }
    }

    /// The splat, rounded.
    #[inline]
    pub(crate) fn unpack(&self) -> Splat {
        Splat {
            mean: self.mean,
            depth: self.depth,
            shear: from_half(self.shear),
            row_precision: from_half(self.row_precision) * PRECISION_UNIT,
            column_precision: from_half(self.column_precision) * PRECISION_UNIT,
            log_opacity: from_half(self.log_opacity),
            colour: self.colour.map(from_half),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::PackedSplat;
    use crate::project::Splat;

    #[test]
    fn splats_of_all_sizes_keep_eleven_bits() {
        for sigma_px in [0.55_f32, 1.0, 7.3, 120.0, 5000.0] {
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
            assert_eq!((kept.mean, kept.depth), (splat.mean, splat.depth), "as they are");
            let numbers = |s: &Splat| {
                let [red, green, blue] = s.colour;
                [s.shear, s.row_precision, s.column_precision, s.log_opacity, red, green, blue]
            };
            for (kept, whole) in numbers(&kept).into_iter().zip(numbers(&splat)) {
                assert!((kept - whole).abs() <= whole.abs() / 2048.0, "{kept} for {whole} at {sigma_px} px");
            }
        }
    }
}
