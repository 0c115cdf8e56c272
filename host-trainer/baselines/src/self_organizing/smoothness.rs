//! What the training adds to the loss: neighbours in the grid shall be alike.

use pocketsplat_kernels::real::Real;
use pocketsplat_trainer::explicit::Cloud;
use pocketsplat_trainer::explicit::step::CloudGradients;
use rayon::prelude::*;

use super::attributes::{LOG_SCALE, planes, with_planes};
use super::low_pass::LowPass;

/// Cells that the filter reaches to each side.
const REACH: usize = 2;

/// Of the filter, in cells.
const DEVIATION: f64 = 3.0;

/// Planes that are made smooth begin here: places stay where the photographs want them.
const FIRST: usize = LOG_SCALE.start;

/// λ·Σ over planes of mean H((x − blurred x)/σ), with Huber's H of threshold 1 and the plane's deviation σ (Morgenstern et al. 2023,
/// section 4.2). What is blurred is a target: no gradient goes through it.
pub(super) struct Smoothness {
    weight: f32,
    side: usize,
    /// Of each plane.
    deviations: Vec<f32>,
    filter: LowPass,
}

impl Smoothness {
    /// * `cloud`: in the order of the grid.
    pub(super) fn new(weight: f64, cloud: &Cloud<f32>, side: usize) -> Self {
        let deviations = planes(cloud)[FIRST..].iter().map(|plane| deviation(plane)).collect();
        #[expect(clippy::cast_possible_truncation, reason = "a weight")]
        Self { weight: weight as f32, side, deviations, filter: LowPass::new(REACH, DEVIATION) }
    }

    /// Adds loss and gradients.
    pub(super) fn added(&self, mut gradients: CloudGradients<f32>, cloud: &Cloud<f32>) -> CloudGradients<f32> {
        let (losses, d): (Vec<f32>, Vec<Vec<f32>>) = planes(cloud)[FIRST..]
            .par_iter()
            .zip(&self.deviations)
            .map(|(plane, deviation)| smoothness(plane, &self.filter.of(plane, self.side), *deviation, self.weight))
            .unzip();
        gradients.loss += losses.iter().sum::<f32>();
        with_planes(gradients, FIRST, &d)
    }
}

/// The standard deviation of a plane; 1 where all is the same.
pub(super) fn deviation(plane: &[f32]) -> f32 {
    let n = plane.len() as f64;
    let mean = plane.iter().map(|x| f64::from(*x)).sum::<f64>() / n;
    let variance = plane.iter().map(|x| (f64::from(*x) - mean).powi(2)).sum::<f64>() / n;
    #[expect(clippy::cast_possible_truncation, reason = "of single-precision numbers")]
    let deviation = variance.sqrt() as f32;
    if deviation > 0.0 { deviation } else { 1.0 }
}

/// λ·mean H((x − t)/σ) over a plane, and its gradient.
fn smoothness<R: Real>(plane: &[R], target: &[R], deviation: R, weight: R) -> (R, Vec<R>) {
    let share = weight / R::real(plane.len() as f64);
    let half = R::real(0.5);
    let huber = |d: R| if d.abs() > R::ONE { d.abs() - half } else { half * d * d };
    let d = || plane.iter().zip(target).map(|(x, t)| (*x - *t) / deviation);
    let slope = |d: R| d.larger(-R::ONE).smaller(R::ONE) * share / deviation;
    (share * d().map(huber).sum::<R>(), d().map(slope).collect())
}

#[cfg(test)]
mod tests {
    use pocketsplat_kernels::finite_difference::{assert_piecewise_gradient, random};

    use super::*;

    #[test]
    fn gradients_agree_with_finite_differences() {
        let (plane, target) = (random(1, 40), random(2, 40));
        let of = |plane: &[f64]| smoothness(plane, &target, 0.6, 3.0);
        let (_, d) = of(&plane);
        assert!(d.iter().any(|d| d.abs() > 0.1249) && d.iter().any(|d| d.abs() < 0.1), "both pieces");
        assert_piecewise_gradient("smoothness", &plane, &d, |plane| of(plane).0);
    }

    #[test]
    fn a_plane_of_one_value_is_smooth() {
        let plane = [0.3f32; 9];
        assert_eq!(deviation(&plane), 1.0);
        assert_eq!(smoothness(&plane, &LowPass::new(REACH, DEVIATION).of(&[0.5; 9], 3), 1.0, 1.0).1.len(), 9);
        assert!((deviation(&[1.0, 3.0]) - 1.0).abs() < 1e-6);
    }
}
