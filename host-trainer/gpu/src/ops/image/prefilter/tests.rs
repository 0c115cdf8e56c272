//! Against the CPU. Bound: the same anchors in the same order, but for those whose reach ends within a rounding of the image's edge or of a
//! whole pixel, where the radius is rounded up: at most one in 500, none of the hard ones.

use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;

use super::*;
use crate::ops::primitives::compact::NO_ROW;
use crate::parity::{SIZES, gpu};
use pocketsplat_kernels::finite_difference::random;
use pocketsplat_kernels::ops::image::prefilter as cpu;
use pocketsplat_kernels::scene::{Anchors, Heads, Scene};

pub(in crate::ops) fn camera() -> Pinhole<f32> {
    Pinhole::new(&Camera {
        rotation: DMat3::from_rotation_y(0.3) * DMat3::from_rotation_x(-0.4),
        translation: DVec3::new(0.1, -0.2, 2.0),
        focal_px: [120.0, 110.0],
        principal_px: [52.0, 47.0],
        width_px: 100,
        height_px: 96,
    })
}

fn scene(shape: ModelShape, n: usize) -> Scene<f32> {
    let (k, s) = (shape.n_offsets, shape.n_log_scales());
    let of =
        |seed: u64, len: usize, f: fn(f64) -> f64| random(seed, len).iter().map(|v| f(*v) as f32).collect::<Vec<_>>();
    let lattice = random(1, 3 * n).chunks_exact(3).map(|v| std::array::from_fn(|i| (300.0 * v[i]) as i32)).collect();
    Scene {
        shape,
        voxel_size: 0.01,
        anchors: Anchors {
            lattice,
            features: vec![0.0; n * shape.feature_dim],
            log_scales: of(2, n * s, |v| 3.0 * v - 3.0),
            offsets: of(3, 3 * n * k, |v| 4.0 * v),
            // A third of the offsets is masked.
            mask_logits: of(4, n * k, |v| 8.0 * v - 2.0),
            prune_rank: of(5, n, f64::abs),
            view_weights: Vec::new(),
        },
        heads: Heads::filled(&shape, 0.0),
        context: None,
    }
}

/// How many anchors only one of CPU and device shows.
fn compare(gpu: &Gpu, scene: &Scene<f32>, pruned_share: f32) -> usize {
    let (camera, n) = (camera(), scene.anchors.len());
    let upload = |values: &[f32]| Buffer::upload(gpu, "test", values).expect("room");
    let positions: Vec<f32> = (0..n).flat_map(|a| scene.position(a)).collect();
    let Anchors { log_scales, offsets, mask_logits, prune_rank, .. } = &scene.anchors;
    let shown = Shown {
        positions: &upload(&positions),
        log_scales: &upload(log_scales),
        offsets: &upload(offsets),
        mask_logits: &upload(mask_logits),
        prune_rank: &upload(prune_rank),
    };
    let mut prefilter = Prefilter::new(gpu).expect("room");
    let n_visible = prefilter.run(gpu, Commands::new(gpu), &camera, &scene.shape, shown, pruned_share).expect("runs");
    let anchors = prefilter.visible.items.read(gpu).expect("runs");
    assert_eq!(anchors.len(), n_visible);
    assert!(anchors.windows(2).all(|pair| pair[0] < pair[1]), "ascending");
    let mut rows = vec![NO_ROW; n];
    for (row, anchor) in (0..).zip(&anchors) {
        rows[*anchor as usize] = row;
    }
    assert!(prefilter.visible.row_of_item.read(gpu).expect("runs") == rows, "rows of anchors");
    let expected =
        |a: usize| prune_rank[a] >= pruned_share && scene.anchors.has_drawn(a) && cpu::shows(scene, a, &camera);
    (0..n).filter(|a| expected(*a) != (rows[*a] != NO_ROW)).count()
}

#[test]
fn the_same_anchors_are_visible_as_on_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for n in SIZES.into_iter().chain([5000]) {
        for (view_colour, anisotropic) in [(true, true), (false, true), (false, false)] {
            let shape = ModelShape { view_colour, anisotropic, ..ModelShape::plain(4, 3) };
            let scene = scene(shape, n);
            for pruned_share in [0.0, 0.4] {
                assert!(compare(gpu, &scene, pruned_share) <= n / 500, "{n} anchors");
            }
        }
    }
}

/// Anchors on the near plane and behind the camera, needles, huge and tiny ones, one far beside the image, all masked, none kept.
#[test]
fn hard_anchors_are_visible_as_on_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for view_colour in [true, false] {
        let shape = ModelShape { view_colour, ..ModelShape::plain(4, 2) };
        let mut scene = scene(shape, 12);
        let camera = camera();
        let at = |z: f32| camera.gradient_to_world(std::array::from_fn(|i| [0.0, 0.0, z][i] - camera.translation[i]));
        let lattice = |p: [f32; 3]| p.map(|x| (x / 0.01).round() as i32);
        let anchors = &mut scene.anchors;
        anchors.mask_logits.fill(1.0);
        anchors.mask_logits[20..].fill(-5.0);
        anchors.prune_rank[9] = 0.2;
        anchors.prune_rank[..9].fill(0.9);
        for (anchor, z) in [0.21, 0.19, -3.0, 2.0, 2.0, 2.0, 2.0, 50.0, 1e4, 2.0].into_iter().enumerate() {
            anchors.lattice[anchor] = lattice(at(z));
        }
        anchors.lattice[10] = [100_000, 0, 0];
        anchors.log_scales[18..24].copy_from_slice(&[5.0, -7.0, -7.0, 5.0, -7.0, -7.0]);
        anchors.log_scales[24..30].fill(80.0);
        anchors.log_scales[30..36].fill(-80.0);
        assert_eq!(compare(gpu, &scene, 0.5), 0);
        assert_eq!(compare(gpu, &scene, 2.0), 0, "none is kept");
    }
}
