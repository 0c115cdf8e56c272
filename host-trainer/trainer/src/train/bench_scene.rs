//! A scene of any size that takes of a step what a trained one takes: for measuring time.

use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::TrainConfig;
use super::config::Hac;
use super::context::start::initial_context;
use pocketsplat_kernels::ops::rate::noise::Stream;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::scene::init::initial_scene;
use pocketsplat_kernels::step::coding::{Coding, RateTerms};

/// Splats that an anchor of [`scene`] makes in [`camera`]'s view, about.
pub const SPLATS_PER_ANCHOR: f64 = 5.4;

/// The same of [`coded`].
pub const SPLATS_PER_CODED_ANCHOR: f64 = 2.0;

/// A camera that sees the whole of [`scene`].
pub fn camera([width_px, height_px]: [u32; 2]) -> Camera {
    let shorter = f64::from(width_px.min(height_px));
    Camera {
        rotation: DMat3::IDENTITY,
        translation: DVec3::new(0.0, 0.0, 4.0),
        focal_px: [shorter * 555.0 / 400.0; 2],
        principal_px: [f64::from(width_px) / 2.0, f64::from(height_px) / 2.0],
        width_px,
        height_px,
    }
}

/// Anchors on a sphere's surface, about half of their Gaussians opaque, as in a trained scene.
pub fn scene(n_anchors: usize) -> Scene<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let points: Vec<DVec3> = (0..n_anchors)
        .map(|_| DVec3::from(std::array::from_fn(|_| rng.random_range(-1.0..1.0))).normalize_or(DVec3::X) * 1.1)
        .collect();
    let mut scene = initial_scene(TrainConfig::default().shape, 0.001, &points, &mut rng);
    for value in scene.anchors.features.iter_mut().chain(&mut scene.anchors.offsets) {
        *value = rng.random_range(-1.0..1.0);
    }
    // Makes about half of the Gaussians opaque.
    scene.heads.opacity.b2.fill(0.0);
    for log_scale in &mut scene.anchors.log_scales {
        *log_scale += rng.random_range(-0.2..0.6);
    }
    scene
}

/// The same after pruning: three of four offsets are masked, and there is a context model.
pub fn coded(n_anchors: usize) -> Scene<f32> {
    let mut scene = scene(n_anchors);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for logit in &mut scene.anchors.mask_logits {
        *logit = if rng.random::<f32>() < 0.75 { -6.0 } else { 1.0 };
    }
    scene.context = Some(initial_context(&scene, scene.anchors.len(), Hac::default().base_steps(), &mut rng));
    scene
}

/// What most steps do to the values of [`coded`].
pub fn coding() -> Coding<'static, f32> {
    let Hac { lambda, sample, mask_weight, grid_weight, .. } = Hac::default();
    let rate = RateTerms { lambda, sample, mask: mask_weight, masks_weigh_anchors: false, grid: grid_weight };
    Coding::Context { stream: Stream::of_run(1), rate, exact: None }
}
