//! Harmonics of a lower degree learn the pictures of a higher one, from places beside those of the photographs.

use glam::DVec3;
use pocketsplat_capture::camera::Camera;
use pocketsplat_gaussians::Degree;
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::simd::Level;
use pocketsplat_kernels::real::Real;
use pocketsplat_kernels::step::TargetView;
use pocketsplat_trainer::explicit::Cloud;
use pocketsplat_trainer::explicit::density::normal;
use pocketsplat_trainer::explicit::optimiser::CloudOptimiser;
use pocketsplat_trainer::explicit::step::{CloudGradients, draw, step_of};
use pocketsplat_trainer::train::TrainError;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::tuning::Tuning;

/// Steps, beside a run of 30,000.
const STEPS: u32 = 10_000;

/// The degree that stays.
const DEGREE: Degree = Degree::Two;

/// Standard deviation of a pseudo view's place from that of its training view, of the capture's extent.
const DEVIATION: f64 = 0.02;

/// Values one task takes; nothing is summed within.
const BLOCK: usize = 4096;

/// Lowers the degree of a cloud to 2: everything of it learns to show, from pseudo views, what it showed before.
pub(crate) fn distil(tuning: &mut Tuning<'_>, cloud: &mut Cloud<f32>) -> Result<(), TrainError> {
    let teacher = cloud.clone();
    cloud.degree = cloud.degree.min(DEGREE);
    let mut optimiser = CloudOptimiser::new(cloud.len());
    tuning.stage(STEPS, |turn, rng| {
        let capture = turn.scene.capture;
        let camera = Pinhole::new(&pseudo_view(&turn.view.camera, DEVIATION * capture.extent, rng));
        let taught = draw(turn.level, &teacher, &camera, capture.background).image.to_planes(camera.size_px);
        let target = TargetView::new(&camera, taught, None, capture.background);
        let gradients = gradients(turn.level, cloud, &target);
        Ok(turn.apply(&mut optimiser, cloud, &gradients))
    })
}

/// The view from a place beside, in the same direction: eye + N(0, σ²).
fn pseudo_view(camera: &Camera, deviation: f64, rng: &mut ChaCha8Rng) -> Camera {
    let eye = camera.centre_world() + deviation * DVec3::from_array([(); 3].map(|()| normal(rng)));
    Camera { translation: -(camera.rotation * eye), ..camera.clone() }
}

/// Of L = mean (image − taught)² over pixels and channels.
fn gradients(level: Level, cloud: &Cloud<f32>, target: &TargetView<'_, f32>) -> CloudGradients<f32> {
    step_of(level, cloud, target, |image, d_image| {
        let n = image.len() as f64;
        let twice = f32::real(2.0 / n);
        let blocks = d_image.par_chunks_mut(BLOCK).zip(image.par_chunks(BLOCK)).zip(target.truth().par_chunks(BLOCK));
        blocks.for_each(|((d_image, image), taught)| {
            for ((d, image), taught) in d_image.iter_mut().zip(image).zip(taught) {
                *d += twice * (*image - *taught);
            }
        });
        f32::real(target.squared_sum(image) / n)
    })
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::baseline::TrainedScene;
    use crate::test_scenes::{capture_of, gaussians, short_config};

    #[test]
    fn the_loss_falls_and_the_degree_with_it() {
        let gaussians = gaussians(60);
        let (capture, mut config) = (capture_of(&gaussians, 4), short_config());
        config.iterations = 900;
        let scene = TrainedScene { gaussians: &gaussians, capture: &capture, config: &config };
        let mut tuning = Tuning::new(&scene).unwrap();
        let teacher = tuning.cloud();
        let mut cloud = teacher.clone();
        distil(&mut tuning, &mut cloud).unwrap();
        assert_eq!(cloud.degree, Degree::Two);
        let loss = |cloud: &Cloud<f32>| -> f64 {
            let of = |camera: &Pinhole<f32>| {
                let taught = draw(tuning.level, &teacher, camera, [0.0; 3]).image.to_planes(camera.size_px);
                f64::from(gradients(tuning.level, cloud, &TargetView::new(camera, taught, None, [0.0; 3])).loss)
            };
            tuning.cameras.iter().map(of).sum()
        };
        let cut = Cloud { degree: Degree::Two, ..teacher.clone() };
        assert!(loss(&teacher) == 0.0 && loss(&cloud) < 0.5 * loss(&cut), "{} of {}", loss(&cloud), loss(&cut));
    }

    #[test]
    fn pseudo_views_lie_around_their_view() {
        let capture = capture_of(&gaussians(3), 1);
        let camera = &capture.train[0].camera;
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let moved: Vec<DVec3> = (0..500)
            .map(|_| {
                let view = pseudo_view(camera, 0.1, &mut rng);
                assert_eq!(view.rotation, camera.rotation);
                view.centre_world() - camera.centre_world()
            })
            .collect();
        let mean = moved.iter().sum::<DVec3>() / 500.0;
        let variance = moved.iter().map(|d| d.length_squared()).sum::<f64>() / 1500.0;
        assert!(mean.length() < 0.02 && (variance.sqrt() - 0.1).abs() < 0.01, "{mean}, {variance}");
    }
}
