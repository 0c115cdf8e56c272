//! Planes of few bits.

use pocketsplat_gaussians::{Degree, Gaussians};
use pocketsplat_trainer::explicit::Cloud;
use rayon::prelude::*;

use super::attributes::{CENTRE, COLOUR, LOG_SCALE, OPACITY, ROTATION, gaussians, planes};

/// A grid as its file has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantised {
    pub(super) side: usize,
    pub(super) degree: Degree,
    /// Of each plane, the least and the largest number; of places, as [`contracted`].
    pub(super) ranges: Vec<[f32; 2]>,
    /// `[side²]` each.
    pub(super) planes: Vec<Vec<u16>>,
}

/// Bits of a plane's numbers.
fn bits(plane: usize) -> u32 {
    match plane {
        plane if CENTRE.contains(&plane) => 14,
        plane if LOG_SCALE.contains(&plane) || ROTATION.contains(&plane) => 8,
        plane if OPACITY.contains(&plane) || COLOUR.contains(&plane) => 8,
        _ => 5,
    }
}

/// The largest step of a plane.
pub(super) fn most(plane: usize) -> u16 {
    u16::MAX >> (16 - bits(plane))
}

/// sign(x)·ln(1 + |x|): fine steps in the middle of a scene, coarse ones far out.
fn contracted(x: f32) -> f64 {
    f64::from(x).abs().ln_1p().copysign(f64::from(x))
}

/// The nearest steps between the least and the largest number of each plane.
pub(super) fn quantised(cloud: &Cloud<f32>, side: usize) -> Quantised {
    let all = planes(cloud);
    let (ranges, planes) = all.par_iter().enumerate().map(|(of, plane)| steps(plane, of)).unzip();
    Quantised { side, degree: cloud.degree, ranges, planes }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast saturates, and is within the range"
)]
fn steps(plane: &[f32], of: usize) -> ([f32; 2], Vec<u16>) {
    let laid = |x: f32| if CENTRE.contains(&of) { contracted(x) } else { f64::from(x) };
    let least = plane.iter().copied().fold(f32::INFINITY, f32::min);
    let largest = plane.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let [least, largest] = [least, largest].map(|bound| laid(bound) as f32);
    let width = f64::from(largest) - f64::from(least);
    let per_width = if width > 0.0 { f64::from(most(of)) / width } else { 0.0 };
    let step = |x: &f32| ((laid(*x) - f64::from(least)) * per_width).round().min(f64::from(most(of))) as u16;
    ([least, largest], plane.iter().map(step).collect())
}

impl Quantised {
    /// The Gaussians, row by row of the grid.
    pub fn gaussians(&self) -> Gaussians {
        let numbers = |(of, (plane, range)): (usize, (&Vec<u16>, &[f32; 2]))| -> Vec<f32> {
            let [least, largest] = range.map(f64::from);
            let number = |step: &u16| {
                let laid = least + f64::from(*step) * (largest - least) / f64::from(most(of));
                #[expect(clippy::cast_possible_truncation, reason = "the one rounding")]
                let number = if CENTRE.contains(&of) { laid.abs().exp_m1().copysign(laid) } else { laid } as f32;
                number
            };
            plane.iter().map(number).collect()
        };
        let planes: Vec<_> = self.planes.par_iter().zip(&self.ranges).enumerate().map(numbers).collect();
        gaussians(&planes, self.degree)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scenes;

    #[test]
    fn numbers_move_by_half_a_step_at_most() {
        let before = test_scenes::gaussians(49);
        let quantised = quantised(&Cloud::from(&before), 7);
        let after = quantised.gaussians();
        let [before, after] = [before, after].map(|gaussians| planes(&Cloud::from(&gaussians)));
        for (of, (before, after)) in before.iter().zip(&after).enumerate() {
            let [least, largest] = quantised.ranges[of];
            // Contracted places are at most e^1 times as far apart here.
            let stretch = if CENTRE.contains(&of) { 2.72 } else { 1.0 };
            let half = 0.5 * stretch * (largest - least) / f32::from(most(of)) + 1e-6;
            assert!(before.iter().zip(after).all(|(a, b)| (a - b).abs() <= half), "plane {of}");
        }
        assert_eq!(steps(&[0.5; 3], 4), ([0.5; 2], vec![0; 3]));
    }
}
