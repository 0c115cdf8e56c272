//! A Gaussian in 32 bytes.

use bytemuck::{Pod, Zeroable};
use pocketsplat_format::bundle::Effects;
use pocketsplat_format::math::{from_half, to_half};

use crate::scene::{Gaussian, NO_ROTATION};

/// Largest number of 12 bits, for colours.
const MAX_12: u32 = (1 << 12) - 1;
/// Largest number of 16 bits, for the opacity.
const MAX_16: u32 = (1 << 16) - 1;
/// Largest number of 20 bits, for the quaternion.
const MAX_20: u32 = (1 << 20) - 1;
/// Scales from here on, normalised units, are infinite: exact frames do not draw them either, as too large for f32.
const SCALE_MAX: f32 = (1 << 25) as f32;
/// Bits of a half without its sign; what stands for infinity.
const HALF_BITS: u32 = 0x7FFF;
/// The least colour that has a number; the largest is a step below 1.5. The heads' lie within 0 and 1, what detail adds may leave that.
const COLOUR_MIN: f32 = -0.5;
/// Numbers of a colour in a unit. Up to 1 each is a half, so that frames that keep colours in halves round none again.
const COLOUR_STEPS: f32 = 2048.0;
/// Of a unit quaternion's numbers all but the largest are at most √½.
const SQRT_HALF: f32 = core::f32::consts::FRAC_1_SQRT_2;

/// A Gaussian, its centre as it is, everything else rounded.
///
/// Scales are halves, the quaternion is its three smaller numbers a, b, c in steps of 1.3·10⁻⁶ (with eleven bits each, the end of a
/// needle across the frame moved by half a pixel), opacity is in 65535ths, colours are in 2048ths: a sixteenth of an 8-bit step at
/// most. The largest number of the quaternion has its place in two bits.
///
/// ```text
/// words 0 to 2: x, y, z                          word 5: a 20 | red 12
/// word 3: scale 0 15 | scale 1 15 | largest 2    word 6: b 20 | green 12
/// word 4: scale 2 15 | opacity 16 | 0            word 7: c 20 | blue 12
/// ```
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct BakedGaussian {
    centre: [f32; 3],
    words: [u32; 5],
}

impl BakedGaussian {
    /// Rounds a Gaussian.
    pub(crate) fn new(gaussian: &Gaussian) -> Self {
        let [red, green, blue] = gaussian.colour.map(|c| level(c - COLOUR_MIN, COLOUR_STEPS, MAX_12));
        let opacity = level(gaussian.opacity, MAX_16 as f32, MAX_16);
        let [s0, s1, s2] = gaussian.scale.map(pack_scale);
        let (largest, [a, b, c]) = smaller_three(gaussian.rotation);
        let words = [s0 | s1 << 15 | largest << 30, s2 | opacity << 15, a | red << 20, b | green << 20, c | blue << 20];
        Self { centre: gaussian.centre, words }
    }

    /// What a Gaussian is in every frame, whether it is kept or evaluated again.
    pub(crate) fn rounded(gaussian: &Gaussian, effects: Effects) -> Gaussian {
        Self::new(gaussian).unpack(effects)
    }

    /// The Gaussian, rounded.
    ///
    /// # Budget
    /// About 40 multiplications and shifts, a square root; less where Gaussians are isotropic, which have no rotation.
    #[inline]
    pub(crate) fn unpack(&self, effects: Effects) -> Gaussian {
        let [w3, w4, w5, w6, w7] = self.words;
        let colour = |word: u32| COLOUR_MIN + (word >> 20) as f32 * (1.0 / COLOUR_STEPS);
        Gaussian {
            centre: self.centre,
            scale: [w3, w3 >> 15, w4].map(unpack_scale),
            rotation: if cfg!(feature = "anisotropy") && effects.anisotropic {
                unit_quaternion(w3 >> 30, [w5, w6, w7])
            } else {
                NO_ROTATION
            },
            opacity: ((w4 >> 15) & MAX_16) as f32 * (1.0 / MAX_16 as f32),
            colour: [w5, w6, w7].map(colour),
        }
    }
}

/// The bits of a scale, which is positive.
fn pack_scale(scale: f32) -> u32 {
    // NaN, of absurd weights, is not drawn either.
    if scale < SCALE_MAX { u32::from(to_half(scale)) & HALF_BITS } else { HALF_BITS }
}

#[inline]
fn unpack_scale(bits: u32) -> f32 {
    let bits = bits & HALF_BITS;
    if bits == HALF_BITS { f32::INFINITY } else { from_half(bits as u16) }
}

/// The nearest of the numbers 0..=`most` to `x` in units of `1/n_steps`; NaN counts as 0.
fn level(x: f32, n_steps: f32, most: u32) -> u32 {
    // Casts saturate.
    ((x * n_steps + 0.5) as u32).min(most)
}

/// Which number of a unit quaternion is the largest, and the others as numbers of 20 bits, signs turned so that the largest
/// is positive: −q rotates as q does.
fn smaller_three(rotation: [f32; 4]) -> (u32, [u32; 3]) {
    let (mut largest, mut most) = (0, 0.0_f32);
    for (index, number) in (0..).zip(rotation) {
        if number.abs() > most.abs() {
            (largest, most) = (index, number);
        }
    }
    // Of a unit quaternion it is at least ½; the heads' are shorter only when they vanish, and then rotate by next to nothing.
    let (largest, rotation) = if most.abs() < 0.25 { (0, [1.0, 0.0, 0.0, 0.0]) } else { (largest, rotation) };
    let sign = 1.0_f32.copysign(most);
    let number = |x: f32| level(0.5 + 0.5 * sign * x / SQRT_HALF, MAX_20 as f32, MAX_20);
    let [w, x, y, z] = rotation;
    let others = match largest {
        0 => [x, y, z],
        1 => [w, y, z],
        2 => [w, x, z],
        _ => [w, x, y],
    };
    (largest, others.map(number))
}

/// The quaternion of [`smaller_three`].
#[inline]
fn unit_quaternion(largest: u32, others: [u32; 3]) -> [f32; 4] {
    let [a, b, c] = others.map(|bits| (2.0 * SQRT_HALF / MAX_20 as f32) * (bits & MAX_20) as f32 - SQRT_HALF);
    let rest = 1.0 - (a * a + b * b + c * c);
    let number = pocketsplat_half::sqrt(if rest > 0.0 { rest } else { 0.0 });
    match largest {
        0 => [number, a, b, c],
        1 => [a, number, b, c],
        2 => [a, b, number, c],
        _ => [a, b, c, number],
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;

    use super::{BakedGaussian, Effects, MAX_12};
    use crate::scene::Gaussian;
    use pocketsplat_format::math::{from_half, to_half};

    fn anisotropic() -> Effects {
        Effects { anisotropic: true, ..Effects::default() }
    }

    #[test]
    fn a_gaussian_comes_back_within_its_steps() {
        let mut state = 5_u32;
        let mut random = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        for _ in 0..20_000 {
            let raw = [random() - 0.5, random() - 0.5, random() - 0.5, random() - 0.5];
            let norm = raw.iter().map(|x| x * x).sum::<f32>().sqrt();
            let whole = Gaussian {
                centre: [4.0 * random() - 3.0, 1e6 * random(), -1e-7 * random()],
                scale: [random() * 10.0, random() * 1e-3, 1e-5],
                rotation: raw.map(|x| x / norm),
                opacity: random(),
                colour: [random(), 1.49 * random(), -0.5 * random()],
            };
            let kept = BakedGaussian::new(&whole).unpack(anisotropic());
            let near = |kept: f32, whole: f32, step: f32, what: &str| {
                assert!((kept - whole).abs() <= step, "{what}: {kept} for {whole}");
            };
            assert_eq!(kept.centre, whole.centre, "as it is");
            for (kept, whole) in kept.scale.into_iter().zip(whole.scale) {
                near(kept, whole, whole / 2048.0 + 3e-8, "scale");
            }
            for (kept, whole) in kept.colour.into_iter().zip(whole.colour) {
                near(kept, whole, 2.5e-4, "colour");
            }
            near(kept.opacity, whole.opacity, 8e-6, "opacity");
            // |q·q'| = cos of half the angle between the rotations.
            let dot: f32 = kept.rotation.iter().zip(whole.rotation).map(|(a, b)| a * b).sum();
            assert!(1.0 - dot.abs() < 3e-7, "{:?} for {:?}", kept.rotation, whole.rotation);
        }
    }

    #[test]
    fn every_colour_up_to_1_is_a_half() {
        for number in 0..=MAX_12 {
            let mut kept = BakedGaussian::zeroed();
            kept.words[2..].fill(number << 20);
            let colour = kept.unpack(anisotropic()).colour;
            assert_eq!(colour, [number as f32 / 2048.0 - 0.5; 3], "number {number}");
            assert_eq!(BakedGaussian::new(&Gaussian { colour, ..gaussian() }).words[2] >> 20, number, "it comes back");
            assert!(colour[0] > 1.0 || from_half(to_half(colour[0])) == colour[0], "{colour:?} is no half");
        }
    }

    fn gaussian() -> Gaussian {
        Gaussian { centre: [0.0; 3], scale: [1.0; 3], rotation: [1.0, 0.0, 0.0, 0.0], opacity: 1.0, colour: [0.0; 3] }
    }

    #[test]
    fn what_has_no_number_becomes_the_nearest() {
        let beyond = Gaussian {
            centre: [f32::INFINITY, 9.0, -0.0],
            scale: [1e7, 0.0, f32::INFINITY],
            rotation: [-1.0, 0.0, 0.0, 0.0],
            opacity: 1.0,
            colour: [7.0, -7.0, f32::NAN],
        };
        let kept = BakedGaussian::new(&beyond).unpack(anisotropic());
        assert_eq!(kept.colour, [1.5 - 1.0 / 2048.0, -0.5, -0.5], "the ends of the range");
        assert_eq!((kept.scale, kept.opacity), ([65504.0, 0.0, f32::INFINITY], 1.0), "the largest half");
        assert!(kept.rotation[0] > 0.999_999 && kept.rotation[1].abs() < 2e-6, "no rotation: {:?}", kept.rotation);
    }
}
