//! A scene and a view in which everything that a step does shows, for checks of its gradients.

use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::coding::Coding;
use super::{Loss, StepReport, TargetView, Workspace};
use crate::finite_difference::random;
use crate::ops::Pinhole;
use crate::real::Real;
use crate::scene::init::initial_scene;
use crate::scene::{ContextNetwork, Head, ModelShape, Scene};

/// Width and height of the view, px.
const SIZE: [u32; 2] = [26, 19];

/// The camera of the view.
pub fn camera() -> Camera {
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
pub fn scene(seed: u64, shape: ModelShape) -> Scene<f64> {
    let points: Vec<DVec3> = random(seed, 60).chunks_exact(3).map(|p| DVec3::from_slice(p) * 0.6).collect();
    let mut scene = initial_scene(shape, 0.01, &points, &mut ChaCha8Rng::seed_from_u64(seed)).cast::<f64>();
    scene.anchors.features = random(seed + 1, scene.anchors.features.len());
    scene.anchors.offsets = random(seed + 2, scene.anchors.offsets.len());
    for (s, r) in scene.anchors.log_scales.iter_mut().zip(random(seed + 3, 20 * 6)) {
        *s += 0.3 * r - 0.5;
    }
    // Most Gaussians drawn, some not.
    scene.heads.opacity.b2.fill(0.3);
    if let Some(detail) = &mut scene.heads.detail {
        detail.w2 = random(seed + 4, detail.w2.len());
    }
    scene
}

/// Shapes that between them have every effect.
pub fn shapes() -> [ModelShape; 7] {
    let base = ModelShape { view_colour: true, view_geometry: true, ..ModelShape::plain(6, 3) };
    [
        base,
        ModelShape { view_distance: true, dilation_compensation: true, ..base },
        ModelShape { view_colour: false, view_geometry: false, n_offsets: 1, ..base },
        ModelShape { view_geometry: false, view_distance: true, ..base },
        ModelShape { view_colour: false, ..base },
        ModelShape { detail_hidden: 5, colour_hidden: 8, ..base },
        ModelShape { anisotropic: false, ..base },
    ]
}

/// The photograph of the view, planes `[3, height, width]`.
pub fn truth() -> Vec<f64> {
    random(77, 3 * (SIZE[0] * SIZE[1]) as usize).iter().map(|v| 0.5 + 0.5 * v).collect()
}

/// Every parameter of a scene in one vector that is no sign or mask: features, log-scales, offsets, the heads in file
/// order, the context network.
pub fn flatten<R: Real>(scene: &mut Scene<R>) -> Vec<&mut R> {
    let Scene { anchors, heads, context, .. } = scene;
    let mut all: Vec<&mut R> =
        anchors.features.iter_mut().chain(&mut anchors.log_scales).chain(&mut anchors.offsets).collect();
    for group in heads.each_mut().flat_map(Head::groups_mut) {
        all.extend(group.iter_mut());
    }
    for group in context.iter_mut().flat_map(|context| &mut context.networks).flat_map(ContextNetwork::groups_mut) {
        all.extend(group.iter_mut());
    }
    all
}

/// The gradients in the order of [`flatten`].
pub fn gradients<R: Real>(scene: &Scene<R>, workspace: &Workspace<R>) -> Vec<f64> {
    let mut d = scene.clone();
    for g in flatten(&mut d) {
        *g = R::ZERO;
    }
    workspace.blocks().iter().for_each(|block| block.copy_gradients(&scene.shape, &mut d.anchors));
    d.heads = workspace.d_heads.clone();
    if let (Some(context), Some(found)) = (&mut d.context, &workspace.d_context) {
        context.networks = found.networks.clone();
    }
    flatten(&mut d).into_iter().map(|g| (*g).into()).collect()
}

/// Every fifth pixel does not count, for one of the shapes.
pub fn mask(shape: &ModelShape) -> Option<Vec<bool>> {
    shape.view_distance.then(|| (0..SIZE[0] * SIZE[1]).map(|i| i % 5 != 0).collect())
}

/// A step on the view.
pub fn step_with<R: Real>(
    scene: &Scene<R>,
    coding: &Coding<'_, R>,
    loss: &Loss<'_, R>,
) -> (StepReport<R>, Workspace<R>) {
    let mut workspace = Workspace::new(&scene.shape);
    let mask = mask(&scene.shape);
    let truth: Vec<R> = truth().into_iter().map(R::real).collect();
    let pinhole = Pinhole::new(&camera());
    let target = TargetView::new(&pinhole, truth, mask.as_deref(), [0.1, 0.2, 0.3].map(R::real));
    let report = workspace.step(scene, &target, loss, coding);
    assert!(report.n_splats > 5, "the scene must be seen: {report:?}");
    (report, workspace)
}
