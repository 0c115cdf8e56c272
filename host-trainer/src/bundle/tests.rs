//! Laws of the writer and the decoder's reader together.

mod culling;
mod damage;
mod entropy;
mod figures;
mod round_trip;

use glam::{DMat3, DVec3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{BundleInfo, QuantisationSteps};
use crate::camera::Camera;
use crate::dataset::Normalisation;
use crate::scene::{Anchors, Heads, ModelShape, Scene};

/// One step for every channel, so that a test can compute symbols by itself.
const STEPS: QuantisationSteps = QuantisationSteps { feature: 0.02, log_scale: 0.02, offset: 0.02 };

/// A scene of random anchors in a cube before the camera, the same for the same arguments.
fn random_scene(shape: ModelShape, n_anchors: usize, seed: u64) -> Scene<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // The sum of four uniform numbers: roughly a Gaussian of deviation 0.58.
    let mut bell = |width: f32| (0..4).map(|_| rng.random_range(-0.5..0.5_f32)).sum::<f32>() * width;
    let anchors = Anchors {
        lattice: (0..n_anchors).map(|_| core::array::from_fn(|_| (bell(200.0)) as i32)).collect(),
        features: (0..n_anchors * shape.feature_dim).map(|_| bell(0.6)).collect(),
        log_scales: (0..n_anchors * 6).map(|_| -2.5 + bell(0.7)).collect(),
        offsets: (0..n_anchors * 3 * shape.n_offsets).map(|_| bell(1.0)).collect(),
        mask_logits: vec![1.0; n_anchors * shape.n_offsets],
    };
    let mut heads = Heads::filled(&shape, 0.0);
    for head in heads.each_mut() {
        for group in head.groups_mut() {
            group.iter_mut().for_each(|weight| *weight = bell(0.5));
        }
    }
    // About two offsets in three are visible.
    heads.opacity.b2.iter_mut().for_each(|bias| *bias += 0.3);
    Scene { shape, voxel_size: 0.01, anchors, heads, context: None }
}

/// A small shape with every effect.
const SMALL: ModelShape =
    ModelShape { feature_dim: 6, n_offsets: 3, view_direction: true, view_distance: true, dilation_compensation: true };

fn camera(width_px: u32, height_px: u32) -> Camera {
    Camera {
        rotation: DMat3::from_rotation_y(0.2),
        translation: DVec3::new(0.1, -0.1, 3.0),
        focal_px: [f64::from(width_px), f64::from(width_px)],
        principal_px: [f64::from(width_px) / 2.0, f64::from(height_px) / 2.0],
        width_px,
        height_px,
    }
}

fn info() -> BundleInfo {
    BundleInfo {
        normalisation: Normalisation { centre: DVec3::new(1.0, -2.0, 0.5), scale: 2.5 },
        background: [10, 20, 30],
        training_px: [64, 48],
        preview: camera(64, 48),
    }
}

fn write_random(shape: ModelShape, n_anchors: usize, seed: u64, chunk_anchors: u16) -> (Scene<f32>, Vec<u8>) {
    let scene = random_scene(shape, n_anchors, seed);
    let bytes = super::write_chunked(&scene, &info(), &STEPS, chunk_anchors);
    (scene, bytes.expect("a sound scene"))
}
