//! Scenes and cameras, the same on every machine: arithmetic and one documented random stream, no `libm` of the host.

use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_format::context::{GridFrame, GridLevel, LevelKind};
use pocketsplat_kernels::scene::{Anchors, ContextModel, Heads, MASK_THRESHOLD, ModelShape, Scene};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A named model shape.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// For messages.
    pub name: &'static str,
    /// Widths and effects.
    pub shape: ModelShape,
    /// Anchors of the scene.
    pub n_anchors: usize,
    /// Seeds everything.
    pub seed: u64,
}

const fn shape(feature_dim: usize, n_offsets: usize, effects: [bool; 3]) -> ModelShape {
    let [sees_direction, view_distance, dilation_compensation] = effects;
    let (view_colour, view_geometry) = (sees_direction, sees_direction);
    ModelShape {
        view_colour,
        view_geometry,
        view_distance,
        dilation_compensation,
        ..ModelShape::plain(feature_dim, n_offsets)
    }
}

/// A residual on the colours, and a colour head of a width of its own.
const DETAILED: ModelShape = ModelShape { colour_hidden: 20, detail_hidden: 9, ..shape(12, 4, [true, false, false]) };

/// Isotropic Gaussians.
const ISOTROPIC: ModelShape = ModelShape { anisotropic: false, ..shape(12, 4, [true, false, false]) };

/// Isotropic Gaussians that look the same from everywhere, so that they may be baked.
const PLAIN_ISOTROPIC: ModelShape = ModelShape { anisotropic: false, ..shape(8, 3, [false, false, true]) };

/// The direction of view for the colours alone, and for all but them.
const COLOURED: ModelShape = ModelShape { view_geometry: false, ..shape(9, 3, [true, true, false]) };
const SHAPED: ModelShape = ModelShape { view_colour: false, ..shape(12, 3, [true, true, false]) };

/// Every effect on and off, narrow and wide, fewer anchors than a chunk holds and several chunks.
pub const CASES: [Case; 11] = [
    Case { name: "device", shape: shape(16, 4, [true, true, false]), n_anchors: 700, seed: 1 },
    Case { name: "plain", shape: shape(8, 2, [false, false, false]), n_anchors: 300, seed: 2 },
    Case { name: "direction", shape: shape(12, 3, [true, false, false]), n_anchors: 129, seed: 3 },
    Case { name: "distance", shape: shape(5, 1, [false, true, false]), n_anchors: 128, seed: 4 },
    Case { name: "compensated", shape: shape(16, 4, [true, true, true]), n_anchors: 500, seed: 5 },
    Case { name: "wide", shape: shape(32, 10, [true, true, true]), n_anchors: 150, seed: 6 },
    Case { name: "detailed", shape: DETAILED, n_anchors: 400, seed: 8 },
    Case { name: "isotropic", shape: ISOTROPIC, n_anchors: 400, seed: 12 },
    Case { name: "plain isotropic", shape: PLAIN_ISOTROPIC, n_anchors: 300, seed: 13 },
    Case { name: "view colour", shape: COLOURED, n_anchors: 300, seed: 14 },
    Case { name: "view geometry", shape: SHAPED, n_anchors: 300, seed: 15 },
];

/// Few bytes, so that every one of them can be damaged in turn.
pub const TINY: Case = Case { name: "tiny", shape: shape(4, 2, [true, false, true]), n_anchors: 5, seed: 7 };

/// The same with a detail head.
pub const TINY_DETAILED: Case = Case { shape: ModelShape { detail_hidden: 3, ..TINY.shape }, ..TINY };

/// A random ball of anchors around the origin, of radius 1.5, with heads of random weights.
///
/// About half of the offsets are transparent, sizes spread over a factor of ten, and colours over most of the cube.
pub fn random_scene(case: &Case) -> Scene<f32> {
    const VOXEL_SIZE: f64 = 1.0 / 64.0;
    const RADIUS_CELLS: i32 = 96;
    let mut rng = ChaCha8Rng::seed_from_u64(case.seed);
    let (f, k) = (case.shape.feature_dim, case.shape.n_offsets);
    let mut anchors = Anchors::default();
    while anchors.len() < case.n_anchors {
        let cell: [i32; 3] = std::array::from_fn(|_| rng.random_range(-RADIUS_CELLS..=RADIUS_CELLS));
        let inside = cell.iter().map(|c| c * c).sum::<i32>() <= RADIUS_CELLS * RADIUS_CELLS;
        // Anchors are voxels: no two share a cell.
        if inside && !anchors.lattice.contains(&cell) {
            anchors.lattice.push(cell);
        }
    }
    let n = case.n_anchors;
    anchors.features = (0..n * f).map(|_| rng.random_range(-1.0..1.0)).collect();
    // e^-3.2 … e^-1.2: 0.04 … 0.3 units.
    anchors.log_scales = (0..n * case.shape.n_log_scales()).map(|_| rng.random_range(-3.2..-1.2)).collect();
    anchors.mask_logits = vec![1.0; n * k];
    anchors.offsets = (0..n * k * 3).map(|_| rng.random_range(-1.0..1.0)).collect();
    let mut heads = Heads::filled(&case.shape, 0.0_f32);
    for head in heads.each_mut() {
        // Wide enough for every activation to leave its linear part now and then.
        let [reach_in, reach_out] = [head.n_in, head.n_hidden].map(|width| 3.0 / (width as f32).sqrt());
        head.w1.fill_with(|| rng.random_range(-reach_in..reach_in));
        head.b1.fill_with(|| rng.random_range(-0.3..0.3));
        head.w2.fill_with(|| rng.random_range(-reach_out..reach_out));
        head.b2.fill_with(|| rng.random_range(-0.3..0.3));
    }
    Scene { shape: case.shape, voxel_size: VOXEL_SIZE, anchors, heads, context: None }
}

/// The scene with about a third of its offsets masked, and now and then all of an anchor's.
pub fn masked(mut scene: Scene<f32>, seed: u64) -> Scene<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for logit in &mut scene.anchors.mask_logits {
        let drawn = rng.random_range(0..3) > 0;
        *logit = MASK_THRESHOLD as f32 + if drawn { 1.0 } else { -1.0 };
    }
    scene
}

/// The scene with a context model of random weights around its own statistics: hashed and dense levels of all kinds.
pub fn with_context(scene: Scene<f32>, seed: u64) -> Scene<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let level = |kind, resolution, n_rows| GridLevel { kind, resolution, n_rows };
    let levels = vec![
        level(LevelKind::Volume, 4, 64),
        level(LevelKind::Volume, 50, 256),
        level(LevelKind::Xy, 9, 81),
        level(LevelKind::Xz, 30, 64),
        level(LevelKind::Yz, 30, 64),
    ];
    let along = |axis: usize| scene.anchors.lattice.iter().map(move |cell| cell[axis]);
    let frame = GridFrame::spanning(
        std::array::from_fn(|axis| along(axis).min().unwrap_or(0)),
        std::array::from_fn(|axis| along(axis).max().unwrap_or(1)),
    );
    let base_steps = [0.1, 0.05, 0.1];
    let mut model = ContextModel::filled(&scene.shape, frame, levels, 8, base_steps, 0.0);
    model.rows.fill_with(|| rng.random_range(-1.0..1.0));
    for group in model.networks[0].mlp.groups_mut() {
        group.fill_with(|| rng.random_range(-0.3..0.3));
    }
    // The values of `random_scene` are uniform: deviations of 0.58, log-scales around −2.2.
    let (f, n_channels) = (scene.shape.feature_dim, scene.shape.values_per_anchor());
    for channel in 0..n_channels {
        let group = usize::from(channel >= f) + usize::from(channel >= f + 6);
        model.networks[0].mlp.b2[channel] += [0.0, -44.0, 0.0][group];
        model.networks[0].mlp.b2[n_channels + channel] += [2.5, 3.5, 2.5][group];
    }
    let mut model = model.with_taps(&scene.shape, 3, 0.0);
    model.networks[0].taps.fill_with(|| rng.random_range(-0.5..0.5));
    Scene { context: Some(model), ..scene }
}

/// The scene with a context of random weights in which anchors follow anchors.
pub fn with_levels(scene: Scene<f32>, seed: u64) -> Scene<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let frame = GridFrame::spanning([-100; 3], [100; 3]);
    let mut model = ContextModel::following(&scene.shape, frame, [4, 6, 8], 8, [0.1, 0.05, 0.1], 0.0);
    let (f, n_channels) = (scene.shape.feature_dim, scene.shape.values_per_anchor());
    for network in &mut model.networks {
        for group in network.mlp.groups_mut() {
            group.fill_with(|| rng.random_range(-0.3..0.3));
        }
        for channel in 0..n_channels {
            let group = usize::from(channel >= f) + usize::from(channel >= f + 6);
            network.mlp.b2[channel] += [0.0, -44.0, 0.0][group];
            network.mlp.b2[n_channels + channel] += [2.5, 3.5, 2.5][group];
        }
    }
    Scene { context: Some(model), ..scene }
}

/// A camera at `eye` that looks at `target`, with the world's z up.
///
/// * `focal`: focal length in units of the image's width.
pub fn look_at(eye: DVec3, target: DVec3, focal: f64, [width_px, height_px]: [u32; 2]) -> Camera {
    let focal_px = focal * f64::from(width_px);
    let lens = Camera {
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
        focal_px: [focal_px, focal_px],
        principal_px: [f64::from(width_px) / 2.0, f64::from(height_px) / 2.0],
        width_px,
        height_px,
    };
    lens.looking_at(eye, target, DVec3::Z)
}

/// Cameras on a circle around the ball of [`random_scene`], of the size of the first of [`cameras`].
pub fn orbit(n_cameras: usize) -> Vec<Camera> {
    let (mut eye, mut cameras) = (DVec3::new(4.0, 0.3, 1.3), Vec::new());
    // A turn by about 360°/n as a matrix of rational numbers: no sine of the host's.
    let half = 3.0 / n_cameras as f64;
    let (cos, sin) = ((1.0 - half * half) / (1.0 + half * half), 2.0 * half / (1.0 + half * half));
    for _ in 0..n_cameras {
        cameras.push(look_at(eye, DVec3::ZERO, 1.2, [160, 120]));
        eye = DVec3::new(cos * eye.x - sin * eye.y, sin * eye.x + cos * eye.y, eye.z);
    }
    cameras
}

/// Named cameras around and inside the ball of [`random_scene`]: sizes that tiles divide and sizes that they do not,
/// skewed focal lengths, a principal point off the centre, and a view that misses everything.
pub fn cameras() -> Vec<(&'static str, Camera)> {
    let outside = DVec3::new(3.7, -2.9, 1.3);
    let off_centre = {
        let mut camera = look_at(outside, DVec3::ZERO, 1.1, [97, 71]);
        camera.principal_px = [30.25, 50.5];
        camera.focal_px[1] *= 1.2;
        camera
    };
    vec![
        ("orbit", look_at(outside, DVec3::ZERO, 1.2, [160, 120])),
        ("opposite", look_at(DVec3::new(-4.1, 1.7, -1.1), DVec3::ZERO, 1.2, [128, 128])),
        ("off-centre", off_centre),
        ("inside", look_at(DVec3::new(0.31, -0.23, 0.17), DVec3::new(1.0, 0.4, -0.2), 0.6, [80, 60])),
        ("one pixel", look_at(outside, DVec3::ZERO, 40.0, [1, 1])),
        ("strip", look_at(outside, DVec3::ZERO, 1.2, [200, 3])),
        ("away", look_at(outside, 2.0 * outside, 1.2, [33, 17])),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_is_a_scene() {
        assert_eq!(random_scene(&TINY), random_scene(&TINY), "same seed, same scene");
        let other = Case { seed: 8, ..TINY };
        assert_ne!(random_scene(&TINY).anchors, random_scene(&other).anchors, "another seed, another scene");
    }

    #[test]
    fn a_camera_sees_its_target_in_the_middle_and_up_upwards() {
        let camera = look_at(DVec3::new(3.0, 1.0, 0.5), DVec3::ZERO, 1.0, [64, 48]);
        let in_camera = |p: DVec3| camera.rotation * p + camera.translation;
        let target = in_camera(DVec3::ZERO);
        assert!(target.x.abs() < 1e-12 && target.y.abs() < 1e-12 && target.z > 0.0, "target at {target}");
        assert!(in_camera(DVec3::Z).y < 0.0, "y points down");
        assert!((camera.rotation.determinant() - 1.0).abs() < 1e-12, "a rotation, not a reflection");
    }
}
