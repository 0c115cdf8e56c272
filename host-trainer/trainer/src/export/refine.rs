//! Baked Gaussians moved until their pictures are the bundle's.

use pocketsplat_capture::dataset::Image;
use pocketsplat_gaussians::Gaussians;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use crate::explicit::Cloud;
use crate::explicit::config::CloudRates;
use crate::explicit::optimiser::CloudOptimiser;
use crate::explicit::step::step;
use crate::train::schedule::LearningRate;
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::simd::Level;
use pocketsplat_kernels::step::{TargetView, planes};

/// Everything random follows from it.
const SEED: u64 = 42;

/// Share λ of 1 − SSIM in the loss, as in training.
const DSSIM: f64 = 0.2;

/// What there is to compare with.
pub struct Refinement<'a> {
    /// The cameras, in the frame of the Gaussians.
    pub cameras: &'a [Pinhole<f32>],
    /// What the bundle shows them.
    pub pictures: &'a [Image],
    /// Behind everything, RGB in 0..1.
    pub background: [f32; 3],
    /// Whether opacities are scaled by what the dilation adds.
    pub compensation: bool,
    /// Steps of gradient descent, one view each.
    pub n_steps: u32,
}

/// Gradient descent on all numbers of the Gaussians, none of which comes or goes.
///
/// Means and least squares judge each Gaussian by itself; what one view lacks, because the mean is fainter or wider there, others can
/// give. A step whose gradients are not finite does nothing.
///
/// * `extent`: of the capture; scales the steps of the centres. * `on_step`: is told the number of each step that is done.
pub fn refine(gaussians: Gaussians, with: &Refinement<'_>, extent: f64, mut on_step: impl FnMut(u32)) -> Gaussians {
    let (level, degree) = (Level::detect(), gaussians.degree);
    let mut cloud = Cloud { compensation: with.compensation, ..Cloud::with_room(&gaussians) };
    drop(gaussians);
    let mut optimiser = CloudOptimiser::new(cloud.len());
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut queue: Vec<usize> = Vec::new();
    for done in 0..if with.cameras.is_empty() { 0 } else { with.n_steps } {
        if queue.is_empty() {
            queue = (0..with.cameras.len()).collect();
            queue.shuffle(&mut rng);
        }
        let index = queue.pop().expect("refilled above");
        let target = TargetView::new(&with.cameras[index], planes(&with.pictures[index]), None, with.background);
        let gradients = step(level, &cloud, &target, DSSIM);
        if gradients.loss.is_finite() && gradients.stored.iter().all(|d| d.opacity_logit.is_finite()) {
            let progress = f64::from(done) / f64::from(with.n_steps);
            optimiser.apply(level, &mut cloud, &gradients, &rates(), [progress, extent]);
        }
        on_step(done + 1);
    }
    Gaussians::from(cloud).reduced_to(degree)
}

/// Rates for Gaussians that are nearly right: those of training's middle, falling to a thirtieth.
fn rates() -> CloudRates {
    let falling = |rate: f64| LearningRate::falling(rate, 0.03 * rate);
    CloudRates {
        centre: falling(1.6e-5),
        log_scale: falling(5e-3),
        rotation: falling(1e-3),
        opacity: falling(0.025),
        colour: falling(2.5e-3),
        bands_divisor: 5.0,
    }
}
