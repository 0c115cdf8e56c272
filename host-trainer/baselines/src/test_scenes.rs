//! Small scenes whose photographs are pictures of Gaussians.

use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Capture, Photograph, View};
use pocketsplat_gaussians::{Degree, Gaussians};
use pocketsplat_kernels::finite_difference::random;
use pocketsplat_trainer::explicit::CloudConfig;
use pocketsplat_trainer::explicit::render::Renderer;

/// A run of 60 iterations, and stages to match.
pub(crate) fn short_config() -> CloudConfig {
    CloudConfig { iterations: 60, ..CloudConfig::default() }
}

/// `n` Gaussians around the origin, of degree 3, all different.
#[expect(clippy::cast_possible_truncation, reason = "any numbers")]
pub(crate) fn gaussians(n: usize) -> Gaussians {
    let numbers: Vec<f32> = random(7, n * 59).into_iter().map(|x| x as f32).collect();
    let mut gaussians = Gaussians { degree: Degree::Three, ..Gaussians::default() };
    for row in numbers.chunks_exact(59) {
        gaussians.centres.push([row[0], row[1], row[2]]);
        gaussians.log_scales.push([row[3] - 2.0, row[4] - 2.0, row[5] - 2.0]);
        gaussians.rotations.push([row[6], row[7], row[8], row[9]]);
        gaussians.opacity_logits.push(2.0 * row[10]);
        gaussians.harmonics.extend(row[11..].chunks_exact(3).map(|c| [0.4 * c[0], 0.4 * c[1], 0.4 * c[2]]));
    }
    gaussians
}

/// The same, and as many again that do not show.
pub(crate) fn with_hidden(gaussians: &Gaussians) -> Gaussians {
    let mut all = gaussians.clone();
    all.centres.extend(&gaussians.centres);
    all.log_scales.extend(&gaussians.log_scales);
    all.rotations.extend(&gaussians.rotations);
    all.opacity_logits.resize(all.centres.len(), -9.0);
    all.harmonics.extend(&gaussians.harmonics);
    all
}

/// `n` photographs of 24 × 20 pixels from around the origin, named by number.
pub(crate) fn capture_of(gaussians: &Gaussians, n: u32) -> Capture {
    let renderer = Renderer::new(gaussians);
    let view = |i: u32| {
        let camera = Camera {
            rotation: DMat3::from_rotation_y(f64::from(i) * 1.3),
            translation: DVec3::new(0.0, 0.0, 3.0),
            focal_px: [26.0, 26.0],
            principal_px: [12.0, 10.0],
            width_px: 24,
            height_px: 20,
        };
        let image = renderer.image(&camera, [0.0; 3]);
        View::new(i.to_string(), camera, Photograph { image, mask: None })
    };
    Capture::of_views((0..n).map(view).collect(), vec![DVec3::ZERO])
}
