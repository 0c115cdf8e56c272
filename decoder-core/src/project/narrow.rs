//! Splats in 20 bytes, every number in 16 bits.

use bytemuck::{Pod, Zeroable};

use super::packed::{ElevenBits, SplatRecord};
use super::splat::Splat;
use crate::arithmetic::{Narrow, SplatChoice};
use crate::math::{from_half, to_half};

/// Steps of a pixel in which centres are kept; 16 bits then reach 4,095 px on either side.
const STEPS_PER_PX: f32 = 8.0;

impl SplatChoice for Narrow {
    type Record = NarrowSplat;
}

/// A [`Splat`] whose centre is rounded to an eighth of a pixel and its depth to a 256th of itself, everything else to eleven bits.
///
/// A centre further than 4,095 px outside is moved there.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct NarrowSplat {
    mean: [i16; 2],
    depth: u16,
    shear: u16,
    rest: ElevenBits,
}

impl SplatRecord for NarrowSplat {
    fn new(splat: &Splat) -> Self {
        Self {
            // The cast saturates.
            mean: splat.mean.map(|px| libm::rintf(px * STEPS_PER_PX) as i16),
            depth: (splat.depth.to_bits() >> 16) as u16,
            shear: to_half(splat.shear),
            rest: ElevenBits::new(splat),
        }
    }

    #[inline]
    fn unpack(&self) -> Splat {
        let mean = self.mean.map(|steps| f32::from(steps) * (1.0 / STEPS_PER_PX));
        self.rest.unpack(mean, self.depth(), from_half(self.shear))
    }

    #[inline]
    fn depth(&self) -> f32 {
        f32::from_bits(u32::from(self.depth) << 16)
    }
}

#[cfg(test)]
mod tests {
    use super::NarrowSplat;
    use crate::project::{Splat, SplatRecord};

    #[test]
    fn centres_keep_eighths_of_a_pixel_and_stay_within_reach() {
        let splat = Splat {
            mean: [-123.456, 7.891],
            shear: -0.75,
            row_precision: 0.01,
            column_precision: 0.02,
            log_opacity: -2.345,
            colour: [0.123, 0.987, -0.0456],
            depth: 3.21,
        };
        let kept = NarrowSplat::new(&splat).unpack();
        assert_eq!(size_of::<NarrowSplat>(), 20);
        assert_eq!((kept.mean, kept.shear), ([-123.5, 7.875], -0.75));
        assert!(kept.depth <= splat.depth && kept.depth > splat.depth * (1.0 - 1.0 / 128.0), "{}", kept.depth);
        let far = NarrowSplat::new(&Splat { mean: [-1e6, 1e9], ..splat }).unpack();
        assert_eq!(far.mean, [-4096.0, 4095.875]);
    }
}
