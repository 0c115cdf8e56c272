//! Density control: Gaussians come where the image pulls, and go where they show nothing or too much (Kerbl et al. 2023, section 5.2).

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::Cloud;
use super::config::DensityControl;
use super::optimiser::CloudOptimiser;
use super::start::logit;
use super::step::CloudGradients;
use crate::train::optimiser::retain_rows;
use pocketsplat_kernels::ops::image::explicit_gaussians;
use pocketsplat_kernels::real::Real;

/// What is known of each Gaussian since the last event.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DensityStatistics {
    /// `[N]` Σ over views of ‖dL/d(mean)‖, units of half the image.
    pub gradient_sum: Vec<f32>,
    /// `[N]` views that drew it.
    pub n_drawn: Vec<u32>,
}

impl DensityStatistics {
    /// Nothing known of `n` Gaussians.
    pub fn new(n: usize) -> Self {
        Self { gradient_sum: vec![0.0; n], n_drawn: vec![0; n] }
    }

    /// Adds one view.
    pub fn add(&mut self, gradients: &CloudGradients<f32>) {
        let CloudGradients { drawn, screen, .. } = gradients;
        for (index, gradient) in drawn.iter().zip(screen) {
            let i = *index as usize;
            self.gradient_sum[i] += gradient;
            self.n_drawn[i] += 1;
        }
    }
}

/// One event: clones, splits, removes.
///
/// Where the mean gradient is above the threshold, a small Gaussian gets a twin in its place, which the optimiser then moves by itself; a
/// large one is replaced by two, drawn from it as from a density, with deviations divided by `split_divisor`. Then those go that are
/// too faint, and with `prunes_large` those that are too large in the scene. Afterwards nothing is known of any.
///
/// * `extent`: of the capture. * new Gaussians come last: twins, then halves, each in the order of their parents.
pub fn control(
    cloud: &mut Cloud<f32>,
    optimiser: &mut CloudOptimiser,
    statistics: &mut DensityStatistics,
    settings: &DensityControl,
    extent: f64,
    prunes_large: bool,
    rng: &mut ChaCha8Rng,
) {
    let n = cloud.len();
    let widest =
        |cloud: &Cloud<f32>, i: usize| f64::from(cloud.log_scales[i].iter().fold(f32::MIN, |a, b| a.larger(*b))).exp();
    let pulled: Vec<usize> = (0..n)
        .filter(|i| {
            let mean = f64::from(statistics.gradient_sum[*i]) / f64::from(statistics.n_drawn[*i].max(1));
            mean >= settings.gradient_threshold && statistics.n_drawn[*i] > 0
        })
        .collect();
    let (twins, halves): (Vec<usize>, Vec<usize>) =
        pulled.into_iter().partition(|i| widest(cloud, *i) <= settings.cloned_share * extent);
    for i in &twins {
        let (stored, harmonics) = (cloud.stored(*i), cloud.harmonics_of(*i).to_vec());
        cloud.push(&stored, &harmonics);
    }
    for i in &halves {
        split(cloud, *i, settings.split_divisor, rng);
    }
    let mut keep = vec![true; cloud.len()];
    halves.iter().for_each(|i| keep[*i] = false);
    for (i, keep) in keep.iter_mut().enumerate() {
        let opacity = f64::from(cloud.opacity_logits[i].sigmoid());
        let too_large = prunes_large && widest(cloud, i) > settings.largest_share * extent;
        *keep &= opacity >= settings.min_opacity && !too_large;
    }
    // A scene without Gaussians has nothing left to grow from.
    if !keep.contains(&true) {
        keep.fill(true);
    }
    optimiser.grow(cloud.len());
    retain(cloud, optimiser, &keep);
    *statistics = DensityStatistics::new(cloud.len());
}

/// Appends two halves of Gaussian `i`.
fn split(cloud: &mut Cloud<f32>, i: usize, divisor: f64, rng: &mut ChaCha8Rng) {
    let (parent, harmonics) = (cloud.stored(i), cloud.harmonics_of(i).to_vec());
    let shape = explicit_gaussians::shape(&parent);
    for _ in 0..2 {
        let along: [f32; 3] = [0, 1, 2].map(|axis: usize| f32::real(normal(rng)) * shape.scale[axis]);
        let moved = turn(shape.rotation, along);
        let mut half = parent;
        for axis in 0..3 {
            half.centre[axis] += moved[axis];
            half.log_scale[axis] -= f32::real(divisor.ln());
        }
        cloud.push(&half, &harmonics);
    }
}

/// A draw from the standard normal distribution (Box and Muller 1958).
pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    // Not 0, whose logarithm is infinite.
    let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
    radius * (TAU * rng.random::<f64>()).cos()
}

/// R(q)·v of a unit quaternion: v + 2w(u × v) + 2u × (u × v).
fn turn([w, x, y, z]: [f32; 4], v: [f32; 3]) -> [f32; 3] {
    let (u, v) = (glam::Vec3::new(x, y, z), glam::Vec3::from(v));
    let across = u.cross(v);
    (v + 2.0 * w * across + 2.0 * u.cross(across)).to_array()
}

/// Lowers all opacities to at most `reset_opacity`, so that only what the images ask for becomes opaque again.
pub fn reset_opacities(cloud: &mut Cloud<f32>, optimiser: &mut CloudOptimiser, settings: &DensityControl) {
    let most = logit(f32::real(settings.reset_opacity));
    for opacity_logit in &mut cloud.opacity_logits {
        *opacity_logit = opacity_logit.smaller(most);
    }
    optimiser.forget_opacities();
}

/// Drops the Gaussians that `keep` does not mark, with their moments.
fn retain(cloud: &mut Cloud<f32>, optimiser: &mut CloudOptimiser, keep: &[bool]) {
    retain_rows(&mut cloud.centres, 1, keep);
    retain_rows(&mut cloud.log_scales, 1, keep);
    retain_rows(&mut cloud.rotations, 1, keep);
    retain_rows(&mut cloud.opacity_logits, 1, keep);
    retain_rows(&mut cloud.harmonics, cloud.n_coefficients, keep);
    optimiser.retain(keep);
}

#[cfg(test)]
mod tests {
    use pocketsplat_gaussians::Degree;
    use rand::SeedableRng;

    use super::*;
    use crate::explicit::config::CloudConfig;
    use pocketsplat_kernels::ops::image::explicit_gaussians::Stored;
    use pocketsplat_kernels::ops::image::spherical_harmonics::MOST;

    /// Of extent 5: pulled and small, pulled and large, faint, huge, and one that nothing is wrong with.
    fn five() -> (Cloud<f32>, CloudOptimiser, DensityStatistics) {
        let mut cloud = Cloud::empty(Degree::Three);
        for (i, (size, opacity)) in
            [(0.01, 0.5), (0.2, 0.5), (0.01, 0.004), (0.6, 0.5), (0.01, 0.5)].into_iter().enumerate()
        {
            let stored = Stored {
                centre: [i as f32, 0.0, 0.0],
                log_scale: [f32::ln(size), f32::ln(0.001), f32::ln(0.001)],
                rotation: [1.0, 0.0, 0.0, 1.0],
                opacity_logit: logit(opacity),
            };
            cloud.push(&stored, &[[i as f32; 3]; MOST]);
        }
        let mut optimiser = CloudOptimiser::new(5);
        for (moments, width) in optimiser.each_mut() {
            moments.first.iter_mut().enumerate().for_each(|(at, m)| *m = (1 + at / width) as f32);
        }
        let mut statistics = DensityStatistics::new(5);
        statistics.n_drawn = vec![10; 5];
        statistics.gradient_sum[..2].fill(0.01);
        (cloud, optimiser, statistics)
    }

    #[test]
    fn small_ones_get_a_twin_large_ones_are_split_and_others_go() {
        let settings = CloudConfig::default().density;
        let (mut cloud, mut optimiser, mut statistics) = five();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        control(&mut cloud, &mut optimiser, &mut statistics, &settings, 5.0, true, &mut rng);
        let colours: Vec<f32> = (0..cloud.len()).map(|i| cloud.harmonics_of(i)[15][2]).collect();
        assert_eq!(colours, [0.0, 4.0, 0.0, 1.0, 1.0]);
        assert_eq!(cloud.stored(0), cloud.stored(2), "twins");
        assert_eq!(optimiser.opacity_logits.first, [1.0, 5.0, 0.0, 0.0, 0.0], "new ones have no moments");
        assert_eq!(optimiser.harmonics.first.len(), 5 * COLOUR_LEN);
        assert_eq!(statistics, DensityStatistics::new(5));
        for half in 3..5 {
            assert!((cloud.log_scales[half][0].exp() - 0.2 / 1.6).abs() < 1e-6);
            // Turned by 90 degrees about z, the Gaussian lies along y.
            let [x, y, z] = cloud.centres[half];
            assert!((x - 1.0).abs() < 0.01 && y.abs() < 1.0 && z.abs() < 0.01, "{:?}", cloud.centres[half]);
        }
        assert!(cloud.centres[3] != cloud.centres[4]);
    }

    const COLOUR_LEN: usize = 3 * MOST;

    #[test]
    fn large_ones_stay_until_opacities_were_lowered() {
        let settings = CloudConfig::default().density;
        let (mut cloud, mut optimiser, mut statistics) = five();
        statistics.gradient_sum.fill(0.0);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        control(&mut cloud, &mut optimiser, &mut statistics.clone(), &settings, 5.0, false, &mut rng);
        assert_eq!(cloud.len(), 4, "only the faint one goes");
        let (mut cloud, mut optimiser, _) = five();
        control(&mut cloud, &mut optimiser, &mut statistics, &settings, 5.0, true, &mut rng);
        assert_eq!(cloud.centres.iter().map(|c| c[0]).collect::<Vec<_>>(), [0.0, 1.0, 4.0]);
        reset_opacities(&mut cloud, &mut optimiser, &settings);
        assert!(cloud.opacity_logits.iter().all(|o| (o.sigmoid() - 0.01).abs() < 1e-6));
        assert!(optimiser.opacity_logits.first.iter().all(|m| *m == 0.0));
    }

    #[test]
    fn the_last_ones_stay() {
        let settings = CloudConfig::default().density;
        let (mut cloud, mut optimiser, mut statistics) = five();
        cloud.opacity_logits.fill(-20.0);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        control(&mut cloud, &mut optimiser, &mut statistics, &settings, 5.0, true, &mut rng);
        assert!(!cloud.is_empty());
    }
}
