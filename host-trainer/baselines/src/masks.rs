//! Masks that are learned: whether a Gaussian, or a part of it, is worth what it costs (Lee et al. 2024, Compact 3D Gaussian
//! Representation, eqs. 1 and 2).
//!
//! M = sg(1[σ(m) > ε] − σ(m)) + σ(m): a mask is 0 or 1 where it is used, and its gradient goes on to m as if it were σ(m). What is off has
//! no gradient but that of its cost, so it never comes back.

use pocketsplat_kernels::ops::adam::{self, Moments, Step};
use pocketsplat_kernels::ops::image::explicit_gaussians::Stored;
use pocketsplat_kernels::real::Real;
use pocketsplat_trainer::explicit::step::CloudGradients;
use pocketsplat_trainer::train::optimiser::retain_rows;

/// ε.
const THRESHOLD: f32 = 0.01;

/// N masks.
pub(crate) struct Masks {
    /// m `[N]`.
    logits: Vec<f32>,
    moments: Moments<f32>,
    n_steps: u32,
}

impl Masks {
    /// All undecided: σ(m) = ½.
    pub(crate) fn new(n: usize) -> Self {
        Self { logits: vec![0.0; n], moments: Moments::zeros(n), n_steps: 0 }
    }

    /// M `[N]`.
    pub(crate) fn are_on(&self) -> Vec<bool> {
        self.logits.iter().map(|logit| logit.sigmoid() > THRESHOLD).collect()
    }

    /// N.
    pub(crate) fn len(&self) -> usize {
        self.logits.len()
    }

    /// Moves every m.
    ///
    /// * `d_masks`: `[N]` dL/dM, and what the cost adds.
    pub(crate) fn step(&mut self, rate: f64, d_masks: &[f32]) {
        self.n_steps += 1;
        let slope = |soft: f32| soft * (1.0 - soft);
        let d: Vec<f32> = self.logits.iter().zip(d_masks).map(|(logit, d)| d * slope(logit.sigmoid())).collect();
        let Moments { first, second } = &mut self.moments;
        adam::update(Step::new(rate, self.n_steps), &mut self.logits, first, second, Some(&d));
    }

    /// Drops those that `keep` does not mark.
    pub(crate) fn retain(&mut self, keep: &[bool]) {
        for values in [&mut self.logits, &mut self.moments.first, &mut self.moments.second] {
            retain_rows(values, 1, keep);
        }
    }
}

/// dL/dM of a Gaussian that is on, where M multiplies its deviations and its opacity o: Σ dL/d(ln s) + o·dL/do.
#[inline]
fn of_gaussian<R: Real>(stored: &Stored<R>, d: &Stored<R>) -> R {
    let [x, y, z] = d.log_scale;
    // d.opacity_logit = dL/do·o·(1 − o).
    x + y + z + d.opacity_logit * (R::ONE + stored.opacity_logit.exp())
}

/// dL/dM of values that are on, where M multiplies them: Σ x·dL/dx.
pub(crate) fn of_values<R: Real>(values: &[R], d_values: &[R]) -> R {
    values.iter().zip(d_values).fold(R::ZERO, |sum, (value, d)| sum + *value * *d)
}

/// dL/dM `[N]` of the Gaussians themselves; 0 for those that did not reach the image.
///
/// * `opacity_logits`: `[N]`.
pub(crate) fn of_gaussians(opacity_logits: &[f32], gradients: &CloudGradients<f32>) -> Vec<f32> {
    let mut d_masks = vec![0.0; opacity_logits.len()];
    for (index, d) in gradients.drawn.iter().zip(&gradients.stored) {
        let index = *index as usize;
        let found = of_gaussian(&Stored { opacity_logit: opacity_logits[index], ..Stored::default() }, d);
        // An opacity of 1 in this precision leaves 0 · ∞.
        d_masks[index] = if found.is_finite() { found } else { 0.0 };
    }
    d_masks
}

#[cfg(test)]
mod tests {
    use pocketsplat_gaussians::Degree;
    use pocketsplat_kernels::finite_difference::{assert_gradient, random};
    use pocketsplat_kernels::ops::heads::neural_gaussians::Gaussian;
    use pocketsplat_kernels::ops::image::explicit_gaussians::{backward, shape};
    use pocketsplat_trainer::explicit::CloudConfig;

    use super::*;
    use crate::baseline::TrainedScene;
    use crate::test_scenes::{capture_of, gaussians};
    use crate::tuning::Tuning;

    #[test]
    fn the_gradient_of_a_mask_agrees_with_finite_differences() {
        for seed in 0..6 {
            let (x, w) = (random(seed, 8), random(seed + 50, 4));
            let stored = Stored {
                log_scale: [x[0], x[1], x[2]],
                rotation: [x[3], x[4], x[5], x[6]],
                opacity_logit: 3.0 * x[7],
                ..Stored::default()
            };
            let d = Gaussian { scale: [w[0], w[1], w[2]], opacity: w[3], ..Gaussian::default() };
            let found = backward([0.0; 3], Degree::Zero, &stored, &[[0.0; 3]], &d, &mut [[0.0; 3]]);
            let loss = |m: &[f64]| {
                let Gaussian { scale, opacity, .. } = shape(&stored);
                m[0] * (0..3).map(|i| w[i] * scale[i]).sum::<f64>() + w[3] * m[0] * opacity
            };
            assert_gradient("mask", &[1.0], &[of_gaussian(&stored, &found)], loss);
        }
    }

    #[test]
    fn the_gradient_of_a_mask_of_values_agrees_with_finite_differences() {
        let (values, at) = (random(1, 9), random(2, 9));
        // L = ½·‖M·x − y‖².
        let d: Vec<f64> = values.iter().zip(&at).map(|(x, y)| x - y).collect();
        let loss = |m: &[f64]| values.iter().zip(&at).map(|(x, y)| 0.5 * (m[0] * x - y).powi(2)).sum::<f64>();
        assert_gradient("mask", &[1.0], &[of_values(&values, &d)], loss);
    }

    #[test]
    fn what_only_costs_goes_and_what_pays_stays() {
        let mut masks = Masks::new(2);
        for _ in 0..3000 {
            masks.step(1e-2, &[1e-3, 1e-3 - 2e-3]);
        }
        assert_eq!(masks.are_on(), [false, true]);
        masks.retain(&[false, true]);
        assert_eq!((masks.are_on(), masks.moments.first.len()), (vec![true], 1));
        assert!(masks.len() == 1 && masks.logits[0] > 3.0);
    }

    #[test]
    #[expect(clippy::cast_possible_truncation, reason = "any numbers")]
    fn in_runs_of_any_length_what_only_costs_goes_and_chance_turns_nothing_off() {
        let gaussians = gaussians(1);
        let capture = capture_of(&gaussians, 1);
        for iterations in [300, 2_000, 30_000, 60_000] {
            let config = CloudConfig { iterations, ..CloudConfig::default() };
            let scene = TrainedScene { gaussians: &gaussians, capture: &capture, config: &config };
            let tuning = Tuning::new(&scene).unwrap();
            let (rate, n_steps) = (tuning.hurried(1e-2), tuning.length(13_000) as usize);
            let mut masks = Masks::new(40);
            // Half of them pay in some steps what they cost in others.
            for d in random(9, 20 * n_steps).chunks_exact(20) {
                let d: Vec<f32> = d.iter().map(|d| *d as f32).chain([1e-3; 20]).collect();
                masks.step(rate, &d);
            }
            let on = masks.are_on();
            assert!(on[..20].iter().all(|on| *on) && !on[20..].contains(&true), "{iterations}: {on:?}");
        }
    }
}
