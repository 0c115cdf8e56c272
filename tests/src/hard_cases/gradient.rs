//! The trainer's gradients of a whole step: finite, right in f64, and about the same in f32.

use pocketsplat_capture::camera::Camera;
use pocketsplat_kernels::finite_difference::random;
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::real::Real;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::LossWeights;
use pocketsplat_kernels::step::coding::Coding;
use pocketsplat_kernels::step::{Loss, TargetView, Workspace};

use crate::difference::worse;

/// Steps of the differences; where one crosses a cutoff of the blending, a smaller one may not.
const STEPS: [f64; 7] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10];
/// No smaller step is tried once a difference is as near as this.
const ENOUGH: f64 = 1e-7;
/// Directions below are judged as if their terms summed to it: the loss itself is only known to 1e-16.
const LEAST_SLOPE: f64 = 1e-4;
/// Least difference of a channel to its truth.
const LEAST_RESIDUAL: f64 = 1e-3;
/// Gradients below are judged as if they were this large.
const LEAST_GRADIENT: f64 = 1e-6;

/// How far a slope is from a fourth-order central difference of `f` around 0, of `scale`: the first as near as
/// 10⁻⁷, or the best.
pub fn difference_error(slope: f64, scale: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
    let mut best = f64::INFINITY;
    for h in STEPS {
        let found = (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h);
        best = best.min((found - slope).abs() / scale.max(LEAST_SLOPE));
        if best <= ENOUGH {
            break;
        }
    }
    best
}

/// The trained numbers of a scene by kind: features, log-scales, offsets, weights of the heads.
fn kinds<R: Real>(scene: &mut Scene<R>) -> [Vec<&mut R>; 4] {
    let Scene { anchors, heads, .. } = scene;
    [
        anchors.features.iter_mut().collect(),
        anchors.log_scales.iter_mut().collect(),
        anchors.offsets.iter_mut().collect(),
        heads.each_mut().flat_map(|head| head.groups_mut()).flatten().collect(),
    ]
}

/// Loss and gradients of a step towards a picture of noise, without the term on volumes, which would drown the others.
fn step<R: Real>(scene: &Scene<R>, camera: &Camera, truth: &[f64], background: [f64; 3]) -> (f64, [Vec<f64>; 4]) {
    let truth: Vec<R> = truth.iter().map(|v| R::real(*v)).collect();
    let camera = Pinhole::new(camera);
    let target = TargetView::new(&camera, truth, None, background.map(R::real));
    let weights = LossWeights { volume: 0.0, ..LossWeights::default() };
    let mut workspace = Workspace::new(&scene.shape);
    let report = workspace.step(scene, &target, &Loss::plain(weights), &Coding::Raw);
    let mut d = scene.clone();
    kinds(&mut d).into_iter().flatten().for_each(|g| *g = R::ZERO);
    workspace.blocks().iter().for_each(|block| block.copy_gradients(&scene.shape, &mut d.anchors));
    d.heads = workspace.d_heads.clone();
    let gradients = kinds(&mut d).map(|kind| kind.into_iter().map(|g| (*g).into()).collect());
    (report.loss.into(), gradients)
}

/// `truth`, or what is [`LEAST_RESIDUAL`] from `drawn` where it is nearer: which side of an absolute value's kink a pixel is on is not
/// for rounding to decide.
fn beside(truth: f64, drawn: f64) -> f64 {
    let residual = truth - drawn;
    if residual.abs() < LEAST_RESIDUAL { drawn + LEAST_RESIDUAL.copysign(residual) } else { truth }
}

/// Error of the gradients in f32 against f64, and in f64 against differences; infinite where one is not finite.
pub fn errors(scene: &Scene<f32>, camera: &Camera, background: [f64; 3]) -> [f64; 2] {
    let n_pixels = (camera.width_px * camera.height_px) as usize;
    let mut exact_scene = scene.cast::<f64>();
    let image = Workspace::new(&scene.shape).image(&exact_scene, &Pinhole::new(camera), background);
    let towards = |seed| -> Vec<f64> {
        let noise = random(seed, 3 * n_pixels);
        noise.iter().zip(&image).map(|(v, drawn)| beside(0.5 + 0.5 * v, *drawn)).collect()
    };
    let truth = towards(77);
    let (rounded_loss, rounded) = step(scene, camera, &truth, background);
    let (loss, exact) = step(&exact_scene, camera, &truth, background);
    if !exact.iter().chain(&rounded).flatten().chain([&loss, &rounded_loss]).all(|v| v.is_finite()) {
        return [f64::INFINITY; 2];
    }
    // Towards one picture of noise a splat's few pixels may pull against each other and leave a gradient of next to nothing.
    let others = [78, 79, 80].map(|seed| step(&exact_scene, camera, &towards(seed), background).1);
    let mut worst = [0.0_f64; 2];
    for kind in 0..4 {
        let all = exact[kind].iter().chain(others.iter().flat_map(|other| &other[kind]));
        let scale = all.fold(LEAST_GRADIENT, |scale, g| scale.max(g.abs()));
        let error = exact[kind].iter().zip(&rounded[kind]).fold(0.0, |worst, (a, b)| worse(worst, (a - b).abs()));
        worst[0] = worse(worst[0], error / scale);

        // Every number moves in proportion to itself.
        let start: Vec<f64> = kinds(&mut exact_scene)[kind].iter().map(|x| **x).collect();
        let direction: Vec<f64> =
            random(5, start.len()).iter().zip(&start).map(|(r, x)| r * x.abs().max(1e-2)).collect();
        let terms = exact[kind].iter().zip(&direction).map(|(g, d)| g * d);
        let (slope, scale) = terms.fold((0.0, 0.0), |(slope, scale), term| (slope + term, scale + term.abs()));
        let mut moved = exact_scene.clone();
        let error = difference_error(slope, scale, |t| {
            for ((x, start), d) in kinds(&mut moved)[kind].iter_mut().zip(&start).zip(&direction) {
                **x = start + t * d;
            }
            step(&moved, camera, &truth, background).0
        });
        worst[1] = worse(worst[1], error);
    }
    worst
}
