//! The whole step against finite differences, and f32 against f64.

use glam::{DMat3, DVec3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::camera::Camera;
use crate::ops::finite_difference::{assert_piecewise_gradient, random};
use crate::scene::init::initial_scene;

const SIZE: [u32; 2] = [26, 19];

fn camera() -> Camera {
    Camera {
        rotation: DMat3::from_rotation_y(0.2),
        translation: DVec3::new(0.05, -0.1, 2.0),
        focal_px: [30.0, 31.0],
        principal_px: [13.5, 9.0],
        width_px: SIZE[0],
        height_px: SIZE[1],
    }
}

/// A scene in which every parameter matters: nothing at its initial zero.
fn scene(seed: u64, shape: ModelShape) -> Scene<f64> {
    let points: Vec<DVec3> = random(seed, 60).chunks_exact(3).map(|p| DVec3::from_slice(p) * 0.6).collect();
    let mut scene = initial_scene(shape, 0.01, &points, &mut ChaCha8Rng::seed_from_u64(seed)).cast::<f64>();
    scene.anchors.features = random(seed + 1, scene.anchors.features.len());
    scene.anchors.offsets = random(seed + 2, scene.anchors.offsets.len());
    for (s, r) in scene.anchors.log_scales.iter_mut().zip(random(seed + 3, 20 * 6)) {
        *s += 0.3 * r - 0.5;
    }
    // Most Gaussians drawn, some not.
    scene.heads.opacity.b2.fill(0.3);
    scene
}

fn shapes() -> [ModelShape; 3] {
    let base = ModelShape {
        feature_dim: 6,
        n_offsets: 3,
        view_direction: true,
        view_distance: false,
        dilation_compensation: false,
    };
    [
        base,
        ModelShape { view_distance: true, dilation_compensation: true, ..base },
        ModelShape { view_direction: false, n_offsets: 1, ..base },
    ]
}

fn truth() -> Vec<f64> {
    random(77, 3 * (SIZE[0] * SIZE[1]) as usize).iter().map(|v| 0.5 + 0.5 * v).collect()
}

/// Every parameter of a scene in one vector: features, log-scales, offsets, then the heads in file order.
fn flatten<R: Real>(scene: &mut Scene<R>) -> Vec<&mut R> {
    let Scene { anchors, heads, .. } = scene;
    let mut all: Vec<&mut R> =
        anchors.features.iter_mut().chain(&mut anchors.log_scales).chain(&mut anchors.offsets).collect();
    for head in heads.each_mut() {
        for group in head.groups_mut() {
            all.extend(group.iter_mut());
        }
    }
    all
}

/// The gradients in the order of [`flatten`].
fn gradients<R: Real>(scene: &Scene<R>, workspace: &Workspace<R>) -> Vec<f64> {
    let mut d = scene.clone();
    for g in flatten(&mut d) {
        *g = R::ZERO;
    }
    let (f, o) = (scene.shape.feature_dim, 3 * scene.shape.n_offsets);
    for block in workspace.blocks() {
        for (row, a) in block.anchors.iter().map(|a| *a as usize).enumerate() {
            d.anchors.features[a * f..(a + 1) * f].copy_from_slice(&block.d_features[row * f..(row + 1) * f]);
            d.anchors.log_scales[a * 6..(a + 1) * 6].copy_from_slice(&block.d_log_scales[row * 6..(row + 1) * 6]);
            d.anchors.offsets[a * o..(a + 1) * o].copy_from_slice(&block.d_offsets[row * o..(row + 1) * o]);
        }
    }
    d.heads = workspace.d_heads.clone();
    flatten(&mut d).into_iter().map(|g| (*g).into()).collect()
}

/// Every fifth pixel does not count, for one of the shapes.
fn mask(shape: &ModelShape) -> Option<Vec<bool>> {
    shape.view_distance.then(|| (0..SIZE[0] * SIZE[1]).map(|i| i % 5 != 0).collect())
}

fn step<R: Real>(scene: &Scene<R>) -> (f64, Vec<f64>) {
    let mut workspace = Workspace::new(&scene.shape);
    let mask = mask(&scene.shape);
    let mut truth: Vec<R> = truth().into_iter().map(R::real).collect();
    clear_masked(&mut truth, mask.as_deref());
    let target = Target {
        camera: &Pinhole::new(&camera()),
        truth: &truth,
        mask: mask.as_deref(),
        background: [0.1, 0.2, 0.3].map(R::real),
    };
    let report = workspace.step(scene, &target, &LossWeights::default());
    assert!(report.n_splats > 5, "the scene must be seen: {report:?}");
    (report.loss.into(), gradients(scene, &workspace))
}

#[test]
fn the_whole_step_agrees_with_finite_differences() {
    for (seed, shape) in (1..).zip(shapes()) {
        let mut scene = scene(seed, shape);
        let (_, analytic) = step(&scene);
        let x: Vec<f64> = flatten(&mut scene).into_iter().map(|p| *p).collect();
        assert_piecewise_gradient("step", &x, &analytic, |x| {
            let mut moved = scene.clone();
            for (p, v) in flatten(&mut moved).into_iter().zip(x) {
                *p = *v;
            }
            step(&moved).0
        });
    }
}

#[test]
fn f32_agrees_with_f64() {
    for (seed, shape) in (11..).zip(shapes()) {
        let scene = scene(seed, shape);
        let (loss, exact) = step(&scene);
        let (rounded_loss, rounded) = step(&scene.cast::<f32>());
        assert!((loss - rounded_loss).abs() <= 1e-5 * loss);
        let scale = exact.iter().fold(0.0f64, |s, g| s.max(g.abs()));
        for (i, (a, b)) in exact.iter().zip(&rounded).enumerate() {
            assert!((a - b).abs() <= 1e-3 * a.abs().max(1e-2 * scale), "parameter {i}: f64 {a}, f32 {b}");
        }
    }
}

#[test]
fn a_view_that_sees_nothing_has_zero_gradients() {
    let mut scene = scene(3, shapes()[0]);
    for cell in &mut scene.anchors.lattice {
        cell[2] -= 5000;
    }
    let mut workspace = Workspace::new(&scene.shape);
    let truth = truth();
    let target = Target { camera: &Pinhole::new(&camera()), truth: &truth, mask: None, background: [0.0; 3] };
    let report = workspace.step(&scene, &target, &LossWeights::default());
    assert!(report.loss.is_finite() && report.n_splats == 0);
    assert!(gradients(&scene, &workspace).iter().all(|g| *g == 0.0));
}

#[test]
fn blocks_of_anchors_add_up() {
    // The heads' gradients are sums over blocks; along random directions, because there are hundreds of weights.
    let shape = shapes()[0];
    let points: Vec<DVec3> = random(5, 3 * 700).chunks_exact(3).map(|p| DVec3::from_slice(p) * 0.6).collect();
    let mut scene = initial_scene(shape, 0.001, &points, &mut ChaCha8Rng::seed_from_u64(5)).cast::<f64>();
    assert!(scene.anchors.len() > 2 * BLOCK, "several blocks");
    scene.anchors.features = random(6, scene.anchors.features.len());
    scene.anchors.log_scales.iter_mut().for_each(|s| *s -= 0.5);
    let (_, analytic) = step(&scene);
    let x: Vec<f64> = flatten(&mut scene).into_iter().map(|p| *p).collect();
    let first_weight = x.len() - scene.heads.each().iter().map(|h| h.n_params()).sum::<usize>();
    for seed in 0..4 {
        let direction = random(90 + seed, x.len() - first_weight);
        let along: f64 = direction.iter().zip(&analytic[first_weight..]).map(|(d, g)| d * g).sum();
        assert_piecewise_gradient("heads", &[0.0], &[along], |t| {
            let mut moved = scene.clone();
            for (p, d) in flatten(&mut moved).into_iter().skip(first_weight).zip(&direction) {
                *p += t[0] * d;
            }
            step(&moved).0
        });
    }
}
