//! How a photograph was exposed, against the mean photograph that a scene shows.

use std::array::from_fn;

use rayon::prelude::*;

use crate::ops::loss::l1::BLOCK;
use crate::real::Real;

/// Gain of each channel, exposure and white balance together.
///
/// v' = g·(v + 0.055) − 0.055: light times g^2.4, as sRGB writes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure<R> {
    /// g, of red, green and blue.
    pub gain: [R; 3],
}

/// Σ over the pixels that count, by channel: what [`Exposure`] would bring the image closest to its photograph.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExposureSums {
    /// (v + 0.055)·(photograph + 0.055).
    pub products: [f64; 3],
    /// (v + 0.055)².
    pub squares: [f64; 3],
}

impl<R: Real> Exposure<R> {
    /// Where sRGB's curve has its foot: v = 1.055·L^(1/2.4) − 0.055 (IEC 61966-2-1).
    pub const FOOT: f64 = 0.055;
    /// A photograph's bytes from here on may be cut off.
    pub const WHITE: u8 = 250;

    /// Whether it changes nothing.
    pub fn is_none(&self) -> bool {
        self.gain == [R::ONE; 3]
    }

    /// The image as this photograph would show it, planes `[3, height, width]`.
    pub fn apply(&self, planes: &mut [R]) {
        let foot = R::real(Self::FOOT);
        self.each(planes, |gain, value| *value = gain * (*value + foot) - foot);
    }

    /// From the gradient of that to the gradient of the image.
    pub fn backward(&self, d_planes: &mut [R]) {
        self.each(d_planes, |gain, d| *d *= gain);
    }

    fn each(&self, planes: &mut [R], change: impl Fn(R, &mut R) + Sync) {
        // To the bit as it is.
        if self.is_none() {
            return;
        }
        let n = planes.len() / 3;
        for (plane, gain) in planes.chunks_exact_mut(n.max(1)).zip(self.gain) {
            plane.par_chunks_mut(BLOCK).for_each(|part| part.iter_mut().for_each(|value| change(gain, value)));
        }
    }
}

impl ExposureSums {
    /// Of an image and its photograph, planes `[3, height, width]`; white pixels of the photograph are left out, for they may have been brighter.
    pub fn of<R: Real>(image: &[R], truth: &[R], mask: Option<&[bool]>) -> Self {
        let (foot, white) = (Exposure::<R>::FOOT, f64::from(Exposure::<R>::WHITE) / 255.0 - 1e-6);
        let n = image.len() / 3;
        let of_channel = |channel: usize| {
            let range = channel * n..(channel + 1) * n;
            let (image, truth) = (&image[range.clone()], &truth[range]);
            let blocks = (0..n.div_ceil(BLOCK)).into_par_iter().map(|block| {
                let mut sums = [0.0; 2];
                for i in block * BLOCK..n.min((block + 1) * BLOCK) {
                    let (v, t): (f64, f64) = (image[i].into(), truth[i].into());
                    if t < white && mask.is_none_or(|mask| mask[i]) {
                        sums[0] += (v + foot) * (t + foot);
                        sums[1] += (v + foot) * (v + foot);
                    }
                }
                sums
            });
            blocks.collect::<Vec<_>>().into_iter().fold([0.0; 2], |sum, part| from_fn(|i| sum[i] + part[i]))
        };
        let channels: [[f64; 2]; 3] = from_fn(of_channel);
        Self { products: channels.map(|sums| sums[0]), squares: channels.map(|sums| sums[1]) }
    }

    /// Logarithms of the gains of least squares; `None` where an image shows nothing to tell by.
    pub fn log_gains(&self) -> Option<[f64; 3]> {
        let gains: [f64; 3] = from_fn(|c| self.products[c] / self.squares[c]);
        gains.iter().all(|gain| gain.is_finite() && *gain > 0.0).then(|| gains.map(f64::ln))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::random;

    #[test]
    fn a_gain_is_light_to_the_power_of_srgb() {
        // 0.4 of the light, and twice that, as sRGB writes both above its foot.
        let written = |light: f64| 1.055 * light.powf(1.0 / 2.4) - 0.055;
        let exposure = Exposure { gain: [2.0_f64.powf(1.0 / 2.4); 3] };
        let mut planes = vec![written(0.4); 3];
        exposure.apply(&mut planes);
        assert!((planes[0] - written(0.8)).abs() < 1e-12, "{}", planes[0]);
        let (mut as_it_is, none) = (random(1, 30), Exposure { gain: [1.0; 3] });
        none.apply(&mut as_it_is);
        assert_eq!(as_it_is, random(1, 30), "to the bit");
    }

    #[test]
    fn the_sums_find_an_exposure_of_more_than_a_block_whatever_is_white_or_masked() {
        let n = BLOCK + 1000;
        let image: Vec<f64> = random(1, 3 * n).iter().map(|v| 0.4 + 0.3 * v).collect();
        let gain = [1.2, 1.0, 0.7];
        let mut truth = image.clone();
        Exposure { gain }.apply(&mut truth);
        let mut mask = vec![true; n];
        for i in (0..n).step_by(7) {
            (truth[i], truth[i + n], truth[i + 2 * n]) = (1.0, 1.0, 1.0);
        }
        for i in (0..n).step_by(5) {
            mask[i] = false;
            truth[i] = 0.2;
        }
        let found = ExposureSums::of(&image, &truth, Some(&mask)).log_gains().expect("pixels");
        for (found, gain) in found.iter().zip(gain) {
            assert!((found - gain.ln()).abs() < 1e-9, "{found}, {}", gain.ln());
        }
        assert_eq!(ExposureSums::of(&image, &truth, Some(&vec![false; n])).log_gains(), None, "nothing counts");
    }
}
