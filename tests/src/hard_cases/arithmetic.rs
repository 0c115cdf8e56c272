//! Single operations at the ends of their arguments.

use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_format::math::{exp, sigmoid, tanh};
use pocketsplat_kernels::finite_difference::random;
use pocketsplat_kernels::ops::heads::head_input;
use pocketsplat_kernels::ops::loss::normality::{ChannelMoments, Weights};
use pocketsplat_kernels::ops::loss::ssim;
use pocketsplat_kernels::ops::rate::normal_bits;
use pocketsplat_kernels::ops::simd::Level;
use pocketsplat_kernels::ops::{Pinhole, adam};
use pocketsplat_kernels::scene::ModelShape;

use super::blobs::{Blob, Blobs};
use super::gradient::difference_error;
use super::picture::{Picture, camera};
use super::{Case, Family, error, n_not_finite, picture};
use crate::difference::worse;

const ANSWER: &str = "\
No sum overflows, and every operation is finite and right at the ends of its arguments.";

const ANALYSIS: &str = "\
Operation by operation:

- Heads sum in f32, whose largest number is 3·10³⁸. Weights are halves and features 16-bit symbols, so the largest sum a bundle can
  hold is 10²⁰: far beyond a half's 65,504 and far below f32's end. Saturated activations are exact.
- The exponential is right to 2e-7 inside its range and clamped outside. So sigmoid and tanh are right to 4e-7 of 1 for every argument.
- Variances are summed about the mean. The mean's own error of a column of mean μ adds (1e-7·μ)² to them: a column of mean 100 and
  deviation 0.01 keeps four digits. ln v is replaced by its tangent below 10⁻⁶, so columns without variance and columns of one row
  have finite terms and right gradients.
- The rate's probability p is a difference of two tails. 6e-8/p of it is lost, and p is held at 10⁻⁶ or more. So bits are right to 0.09
  at the floor and to 0.01 above 10⁻⁵.
- SSIM's variances are differences of blurred squares, 1e-7 against the constant 9e-4 that is added to them: a thousandth at most.
- Differences of smooth operations agree with their gradients in f64 to 10⁻⁵.";

/// Largest error of `ours` against `exact` over hard arguments.
fn worst_of(ours: impl Fn(f32) -> f32, exact: impl Fn(f64) -> f64) -> f64 {
    let sizes =
        [0.0, 1e-45, 1e-38, 1e-10, 1e-4, 0.3, 0.499_999_97, 0.5, 1.0, 8.7, 16.6, 40.0, 86.99, 88.0, 104.0, 1e9, 3e38];
    let arguments = sizes.into_iter().chain([f32::INFINITY]).flat_map(|x| [x, -x]);
    arguments.map(|x| (f64::from(ours(x)) - exact(f64::from(x))).abs()).fold(0.0, worse)
}

/// Columns without variance, with less than the floor, of a mean of 100, and plain ones.
fn columns(n_rows: usize) -> Vec<f64> {
    let mut x = random(3, 4 * n_rows);
    for row in x.chunks_exact_mut(4) {
        row[0] = 0.25;
        row[1] *= 1e-20;
        row[2] = 100.0 + 0.01 * row[2];
    }
    x.iter().map(|x| f64::from(*x as f32)).collect()
}

const WEIGHTS: Weights<f64> = Weights { divergence: 0.3, spread: 0.7 };

/// The gradient of the divergence in f64 against differences, over a few numbers of rows.
fn divergence_gradient() -> f64 {
    let mut worst = 0.0_f64;
    for n_rows in [1, 2, 40] {
        let x = columns(n_rows);
        let direction = random(8, x.len());
        let moved = |t: f64| -> Vec<f64> { x.iter().zip(&direction).map(|(x, d)| x + t * d).collect() };
        let slope = |d: &[f64]| {
            d.iter().zip(&direction).map(|(g, d)| g * d).fold((0.0, 0.0), |(s, t): (f64, f64), x| (s + x, t + x.abs()))
        };
        let mut d = vec![0.0; x.len()];
        ChannelMoments::of(&[&x], 4).backward(&WEIGHTS, &x, &mut d);
        let (slope, scale) = slope(&d);
        worst = worse(worst, difference_error(slope, scale, |t| ChannelMoments::of(&[&moved(t)], 4).term(&WEIGHTS)));
    }
    worst
}

/// The divergence in f32 against f64, of the term.
fn divergence_rounding() -> f64 {
    let weights = Weights { divergence: 0.3_f32, spread: 0.7 };
    let of = |n_rows: usize| {
        let x = columns(n_rows);
        let rounded: Vec<f32> = x.iter().map(|x| *x as f32).collect();
        let exact = ChannelMoments::of(&[&x], 4).term(&WEIGHTS);
        (f64::from(ChannelMoments::of(&[&rounded], 4).term(&weights)) / exact - 1.0).abs()
    };
    [1, 2, 40].map(of).into_iter().fold(0.0, worse)
}

/// Bits in f32 against f64: values near and far, scales from 2⁻⁵⁰ to 2⁵⁰; those of a probability at the floor apart.
fn bits_rounding() -> f64 {
    let mut worst = 0.0_f64;
    for log2_scale in [-50.0, -20.0, -4.0, -1.0, 0.0, 2.0, 3.875, 12.0, 20.0, 50.0] {
        for distance in [0.0, 1e-6, 0.25, 0.5, 0.75, 3.0, 17.0, 1e4, 1e30] {
            let exact = normal_bits::bits(distance, 0.0, log2_scale);
            let found = normal_bits::bits(distance as f32, 0.0, log2_scale as f32);
            if !(found.d_value.is_finite() && found.d_log2_scale.is_finite()) {
                return f64::INFINITY;
            }
            worst = worse(worst, (f64::from(found.bits) - exact.bits).abs());
        }
    }
    worst
}

/// SSIM of even images in f32 against f64, values and gradients; equal, different, black and white.
fn even_images() -> f64 {
    let size_px = [24, 16];
    let n = 3 * size_px[0] * size_px[1];
    let of = |x: f64, y: f64| {
        let (exact, partials) = ssim::forward(Level::detect(), &vec![x; n], &vec![y; n], size_px);
        let mut d = vec![0.0; n];
        ssim::backward(Level::detect(), &vec![x; n], &vec![y; n], size_px, &partials, n as f64, &mut d);
        let (image, truth) = (vec![x as f32; n], vec![y as f32; n]);
        let (found, partials) = ssim::forward(Level::detect(), &image, &truth, size_px);
        let mut rounded = vec![0.0; n];
        ssim::backward(Level::detect(), &image, &truth, size_px, &partials, n as f32, &mut rounded);
        let gradients = d.iter().zip(&rounded).map(|(a, b)| (a - f64::from(*b)).abs());
        let scale = d.iter().fold(1.0_f64, |scale, g| scale.max(g.abs()));
        worse(gradients.fold(0.0, worse) / scale, (exact - f64::from(found)).abs())
    };
    [(0.0, 0.0), (1.0, 1.0), (0.0, 1.0), (1.0, 0.0), (0.5, 0.5), (0.5, 0.500_01)]
        .map(|(x, y)| of(x, y))
        .into_iter()
        .fold(0.0, worse)
}

/// Numbers of head inputs and of a camera's own that are not finite, at the camera and one ulp from it.
fn at_the_camera() -> f64 {
    let shape = ModelShape { view_colour: true, view_geometry: true, view_distance: true, ..ModelShape::plain(2, 1) };
    let eye = DVec3::new(0.3, -0.2, 0.7);
    let camera = Pinhole::<f32>::new(&Camera {
        rotation: DMat3::from_rotation_y(0.4),
        translation: -(DMat3::from_rotation_y(0.4) * eye),
        ..camera()
    });
    let [x, y, z] = camera.centre_world;
    let positions = [[x, y, z], [x.next_up(), y, z], [x, y + 1e-23, z]];
    let mut rows = vec![0.0; 3 * shape.head_inputs()];
    head_input::forward(&shape, &camera, &[1.0; 6], &positions, &mut rows);
    n_not_finite(rows)
}

/// Parameters that are not finite after gradients from none to the largest that the watchdog lets pass.
fn extreme_gradients() -> f64 {
    let gradients = [0.0_f32, 1e-45, 1e-38, 1e-30, 1e-15, 1.0, 1e10, 1e18, -1e18];
    let mut parameters = [0.5_f32; 9];
    let mut moments = adam::Moments::zeros(9);
    for t in 1..2000 {
        // Now and then the other way round.
        let turned = gradients.map(|g| if t % 97 == 0 { -g } else { g });
        adam::update(adam::Step::new(0.01, t), &mut parameters, &mut moments.first, &mut moments.second, Some(&turned));
    }
    n_not_finite(parameters.into_iter().chain(moments.first).chain(moments.second))
}

/// Hidden units of 6·10⁵ and outputs of 3·10¹⁰.
fn beyond_halves(output: f32) -> Picture {
    let blob = Blob { scale: [0.3, 0.1, 0.03], quaternion: [0.7, 0.3, -0.2, 0.5], ..Blob::default() };
    let mut scene = Blobs::of([blob, Blob { position: [0.2, 0.1, 2.5], ..blob }]).scene();
    scene.anchors.features.iter_mut().for_each(|feature| *feature *= 10.0);
    for head in scene.heads.each_mut() {
        head.w1.iter_mut().for_each(|weight| *weight *= 60_000.0);
        // A feature is 10 now, and biases are halves.
        head.b1.iter_mut().for_each(|bias| *bias *= 2e5);
        head.w2.iter_mut().for_each(|weight| {
            *weight = if output > 0.0 { weight.signum() * output * f32::from(*weight != 0.0) } else { *weight / 6e5 }
        });
    }
    Picture::of(scene)
}

pub(super) fn family() -> Family {
    let cases: Vec<Case> = vec![
        picture("sums beyond a half", "hidden units of 600,000 that a second layer takes back", || beyond_halves(0.0)),
        picture("outputs beyond a half", "outputs of 3·10¹⁰: everything saturated", || beyond_halves(60_000.0)),
        error(
            "exponential",
            "arguments from 10⁻⁴⁵ to infinity, up to its clamps",
            "worst relative error",
            2e-7,
            || {
                let exact = |x: f64| x.clamp(-87.0, 88.0).exp();
                let relative = |x: f32| f64::from(exp(x)) / exact(f64::from(x)) - 1.0;
                worst_of(|x| relative(x) as f32, |_| 0.0)
            },
        ),
        error("sigmoid", "the same arguments", "worst error", 4e-7, || worst_of(sigmoid, |x| 1.0 / (1.0 + (-x).exp()))),
        error("tanh", "the same arguments", "worst error", 4e-7, || worst_of(tanh, f64::tanh)),
        error(
            "divergence, rounding",
            "columns without variance, of one row, far from 0",
            "of the term",
            1e-3,
            divergence_rounding,
        ),
        error("divergence, gradient", "the same", "of the direction's terms", 1e-5, divergence_gradient),
        error("bits", "values 10³⁰ steps away, scales of 2⁻⁵⁰ to 2⁵⁰", "worst error, bits", 0.1, bits_rounding),
        error(
            "SSIM of even images",
            "no variance at all: black, white, equal, different",
            "of the largest value or gradient",
            1e-3,
            even_images,
        ),
        error(
            "distance 0",
            "an anchor at the camera, and one ulp from it",
            "inputs that are not finite",
            0.0,
            at_the_camera,
        ),
        error(
            "extreme gradients",
            "0 to 10¹⁸ through 2,000 steps of Adam",
            "numbers that are not finite",
            0.0,
            extreme_gradients,
        ),
    ];
    Family { title: "Arithmetic", answer: ANSWER, analysis: ANALYSIS, cases }
}
