//! Self-Organizing Gaussians (Morgenstern et al. 2023, arXiv 2312.13299), from the paper's mathematics alone.
//!
//! Trained Gaussians are sorted into a square grid in which neighbours are alike (`assignment`). Training goes on with a loss that makes
//! them more so (`smoothness`), and they are sorted again at intervals. Then each number of theirs is a plane of few bits
//! (`attributes`, `quantisation`), and planes are images (`layout`).
//!
//! As published: a radius that shrinks by 0.95, groups of 4, a Huber loss to the blurred grid, whose gradient does not go through the
//! blur; no harmonics but degree 0 in the variant "w/o SH". What is open, and how it is read here:
//!
//! * **The start** is a scene that is trained, so that all methods begin with the same one: 10,000 steps follow, in place of a loss that
//!   is there from the first. Nothing is densified. Rates go on where training ended, and so do the moments of Adam.
//! * **Who goes** so that the count is a square: those with the least opacity times volume.
//! * **Sorted by** places, log-scales and colours of degree 0, each number divided by its deviation.
//! * **The first sort** begins in random order at half the side. Those after it begin with the grid as it is, at a sixteenth.
//! * **Blocks** have the radius and one cell as their side. The filter reaches as far as the radius, which is two deviations. A radius is
//!   done once an exchange lowers the distances by less than a thousandth.
//! * **Smooth** become all attributes but the places, which decide what is seen, each divided by its deviation. The blur is of 5 × 5
//!   cells.
//! * **λ** is 0.003: a larger one costs quality and saves few bytes more.
//! * **Bits**: 14 for places, after sign(x)·ln(1 + |x|); 5 for harmonics above degree 0, 8 for all else, between the least and the
//!   largest number of each plane.
//! * **PNG** in place of JPEG XL, of which there is no kept encoder in Rust alone; files are larger for that. Nothing is lost in them.

mod assignment;
mod attributes;
mod layout;
mod low_pass;
mod quantisation;
mod smoothness;

pub use quantisation::Quantised;

use pocketsplat_gaussians::{Degree, Gaussians};
use pocketsplat_trainer::explicit::Cloud;
use pocketsplat_trainer::explicit::optimiser::CloudOptimiser;
use pocketsplat_trainer::train::TrainError;
use rand::seq::SliceRandom;

use crate::baseline::{Baseline, TrainedScene, Unreadable};
use crate::tuning::{Tuning, picked};
use assignment::assign;
use attributes::{CENTRE, COLOUR, LOG_SCALE, planes};
use smoothness::{Smoothness, deviation};

/// Sorts.
const SORTS: u32 = 10;

/// Steps after each, beside a run of 30,000.
const STEPS: u32 = 1_000;

/// Of the side: where the radius of the first sort begins, and of the others.
const RADII: [f64; 2] = [1.0 / 2.0, 1.0 / 16.0];

/// Numbers of a Gaussian by which it is sorted.
const SORTED_BY: usize = 9;

/// The method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfOrganizing {
    /// Degree of the harmonics that stay; 0 is the variant "w/o SH".
    pub degree: Degree,
    /// λ: how much smoothness counts.
    pub smoothness: f64,
}

impl Default for SelfOrganizing {
    /// As published, but λ, whose unit is of this program.
    fn default() -> Self {
        Self { degree: Degree::Three, smoothness: 0.003 }
    }
}

impl Baseline for SelfOrganizing {
    const NAME: &'static str = "SOG";

    type Compressed = Quantised;

    fn compress(&self, scene: &TrainedScene<'_>) -> Result<Quantised, TrainError> {
        let mut tuning = Tuning::new(scene)?;
        let (mut cloud, side) = square_of(&tuning.cloud());
        cloud.degree = cloud.degree.min(self.degree);
        let mut optimiser = CloudOptimiser::new(cloud.len());
        let mut order: Vec<usize> = (0..cloud.len()).collect();
        order.shuffle(&mut tuning.random());
        for sort in 0..SORTS {
            let radius = RADII[usize::from(sort > 0)] * side as f64;
            assign(&mut order, &sorted_by(&cloud), side, radius, &mut tuning.random());
            cloud = with_unit_rotations(picked(&cloud, order.iter().copied()));
            optimiser.reorder(&order);
            order.sort_unstable();
            let smoothness = Smoothness::new(self.smoothness, &cloud, side);
            tuning.stage(STEPS, |turn, _| {
                let gradients = smoothness.added(turn.gradients(&cloud)?, &cloud);
                Ok(turn.apply(&mut optimiser, &mut cloud, &gradients))
            })?;
        }
        Ok(quantisation::quantised(&with_unit_rotations(cloud), side))
    }

    fn encode(compressed: &Quantised) -> Vec<u8> {
        layout::written(compressed)
    }

    fn decode(bytes: &[u8]) -> Result<Gaussians, Unreadable> {
        layout::read(bytes).map(|quantised| quantised.gaussians())
    }
}

/// The most important Gaussians, as many as fill a square, in their order; and its side.
fn square_of(cloud: &Cloud<f32>) -> (Cloud<f32>, usize) {
    let importance = |i: usize| {
        let opacity = 1.0 / (1.0 + f64::from(-cloud.opacity_logits[i]).exp());
        opacity * cloud.log_scales[i].iter().map(|s| f64::from(*s)).sum::<f64>().exp()
    };
    let side = cloud.len().isqrt();
    let mut rows: Vec<usize> = (0..cloud.len()).collect();
    rows.sort_by(|a, b| importance(*b).total_cmp(&importance(*a)).then(a.cmp(b)));
    rows.truncate(side * side);
    rows.sort_unstable();
    (picked(cloud, rows), side)
}

/// What Gaussians are sorted by: places, log-scales and colours of degree 0 in units of their deviations.
fn sorted_by(cloud: &Cloud<f32>) -> Vec<[f32; SORTED_BY]> {
    let planes = planes(cloud);
    let planes: Vec<_> =
        [CENTRE, LOG_SCALE, COLOUR].into_iter().flatten().map(|of| (&planes[of], deviation(&planes[of]))).collect();
    (0..cloud.len()).map(|i| std::array::from_fn(|of| planes[of].0[i] / planes[of].1)).collect()
}

/// Quaternions of length 1 whose w is not negative: q and −q are one rotation, of which neighbours have the same.
fn with_unit_rotations(mut cloud: Cloud<f32>) -> Cloud<f32> {
    for rotation in &mut cloud.rotations {
        let length = rotation.iter().map(|q| q * q).sum::<f32>().sqrt();
        if length > 0.0 {
            let signed = length.copysign(rotation[0]);
            rotation.iter_mut().for_each(|q| *q /= signed);
        }
    }
    cloud
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::test_files::gaussians_of_file;
    use crate::test_scenes::gaussians;

    #[test]
    fn the_file_draws_what_was_compressed_bit_for_bit_with_any_number_of_threads() {
        for degree in [Degree::Three, Degree::Zero] {
            let method = SelfOrganizing { degree, ..SelfOrganizing::default() };
            let decoded = gaussians_of_file(&method, 90, Quantised::gaussians, layout::read);
            assert_eq!((decoded.len(), decoded.degree), (81, degree));
        }
    }

    #[test]
    fn the_least_go_and_rotations_stay_the_same() {
        let before = gaussians(20);
        let (cloud, side) = square_of(&Cloud::from(&before));
        let importance = |g: &Gaussians, i: usize| {
            let s = g.log_scales[i];
            (s[0] + s[1] + s[2]).exp() / (1.0 + (-g.opacity_logits[i]).exp())
        };
        let mut all: Vec<f32> = (0..20).map(|i| importance(&before, i)).collect();
        all.sort_by(|a, b| b.total_cmp(a));
        let kept = Gaussians::from(cloud.clone());
        assert_eq!((kept.len(), side), (16, 4));
        assert!((0..16).all(|i| importance(&kept, i) >= all[15] * 0.9999));
        for (before, after) in kept.rotations.iter().zip(with_unit_rotations(cloud).rotations) {
            let dot: f32 = before.iter().zip(after).map(|(a, b)| a * b).sum();
            let length = before.iter().map(|q| q * q).sum::<f32>().sqrt();
            assert!((dot.abs() - length).abs() < 1e-5 && after[0] >= 0.0);
        }
    }
}
