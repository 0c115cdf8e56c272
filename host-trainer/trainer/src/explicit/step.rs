//! One view through the whole chain, forward and backward.

use rayon::prelude::*;

use super::Cloud;
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::heads::neural_gaussians::Gaussian;
use pocketsplat_kernels::ops::image::explicit_gaussians::{self, Stored};
use pocketsplat_kernels::ops::image::project::{self, Footprint, Splat};
use pocketsplat_kernels::ops::image::rasterise::{self, TiledImage};
use pocketsplat_kernels::ops::image::spherical_harmonics::MOST;
use pocketsplat_kernels::ops::image::tiles::{self, TileLists};
use pocketsplat_kernels::ops::loss::{l1, ssim};
use pocketsplat_kernels::ops::simd::Level;
use pocketsplat_kernels::real::Real;
use pocketsplat_kernels::step::{TargetView, clear_masked};

/// Gaussians one task evaluates; nothing is summed within, so that no result depends on it.
const BLOCK: usize = 1024;

/// A drawn view and what its backward pass needs.
pub struct Drawing<R> {
    /// The picture.
    pub image: TiledImage<R>,
    /// Which Gaussians reached it, ascending.
    pub drawn: Vec<u32>,
    /// Their splats.
    pub splats: Vec<Splat<R>>,
    /// How far these reach.
    pub footprints: Vec<Footprint<R>>,
    lists: TileLists,
}

impl<R: Real> Drawing<R> {
    /// Σ α·T over the pixels for each splat: what it gives the image, and the derivative of a channel's sum by its colour.
    pub fn light(&self, level: Level, size_px: [usize; 2]) -> Vec<R> {
        let Self { image, splats, footprints, lists, .. } = self;
        let ones = TiledImage::from_planes(&vec![R::ONE; 3 * size_px[0] * size_px[1]], size_px);
        rasterise::backward(level, splats, footprints, lists, image, &ones).iter().map(|d| d.colour[0]).collect()
    }
}

/// What a step gives back.
pub struct CloudGradients<R> {
    /// The loss.
    pub loss: R,
    /// Mean squared difference of image and photograph over the pixels that count, before any rounding.
    pub squared_error: f64,
    /// Gaussians that reached the image, ascending; the other arrays have their rows in this order.
    pub drawn: Vec<u32>,
    /// dL/d(what is stored).
    pub stored: Vec<Stored<R>>,
    /// dL/d(coefficients), 0 beyond the degree that is drawn.
    pub harmonics: Vec<[[R; 3]; MOST]>,
    /// Length of dL/d(mean), in units of half the image: what density control asks for.
    pub screen: Vec<R>,
}

/// A Gaussian that reaches the image, and how.
type DrawnSplat<R> = (u32, Splat<R>, Footprint<R>);

/// Draws a view.
///
/// * `background`: RGB in 0..1.
pub fn draw<R: Real>(level: Level, cloud: &Cloud<R>, camera: &Pinhole<R>, background: [R; 3]) -> Drawing<R> {
    let parts: Vec<Vec<DrawnSplat<R>>> = cloud
        .centres
        .par_chunks(BLOCK)
        .enumerate()
        .map(|(block, centres)| {
            let first = block * BLOCK;
            level.run(
                #[inline(always)]
                || (first..first + centres.len()).filter_map(|i| splat(cloud, camera, i)).collect(),
            )
        })
        .collect();
    let n = parts.iter().map(Vec::len).sum();
    let (mut drawn, mut splats, mut footprints) = (Vec::with_capacity(n), Vec::with_capacity(n), Vec::with_capacity(n));
    for (index, splat, footprint) in parts.into_iter().flatten() {
        drawn.push(index);
        splats.push(splat);
        footprints.push(footprint);
    }
    let lists = tiles::build(&splats, &footprints, camera.size_px);
    let image = rasterise::forward(level, &splats, &footprints, &lists, background);
    Drawing { image, drawn, splats, footprints, lists }
}

/// The splat of one Gaussian, where it reaches the image. Most of the work is its colour, so that comes last.
#[inline(always)]
fn splat<R: Real>(cloud: &Cloud<R>, camera: &Pinhole<R>, index: usize) -> Option<DrawnSplat<R>> {
    let gaussian = explicit_gaussians::shape(&cloud.stored(index));
    let (mut splat, footprint) = project::forward(camera, &gaussian, cloud.compensation)?;
    splat.colour =
        explicit_gaussians::colour(camera.centre_world, cloud.degree, gaussian.centre, cloud.harmonics_of(index));
    Some((u32::try_from(index).expect("fewer than 2³² Gaussians"), splat, footprint))
}

/// Loss and gradients of one view: L = (1 − λ)·L1 + λ·(1 − SSIM) (Kerbl et al. 2023, eq. 7).
///
/// * `dssim`: λ.
pub fn step<R: Real>(level: Level, cloud: &Cloud<R>, target: &TargetView<'_, R>, dssim: f64) -> CloudGradients<R> {
    let size_px = target.camera.size_px;
    let lambda = R::real(dssim);
    step_of(level, cloud, target, |image, d_image| {
        let (similarity, partials) = ssim::forward(level, image, target.truth(), size_px);
        l1::backward(image, target.truth(), R::ONE - lambda, d_image);
        ssim::backward(level, image, target.truth(), size_px, &partials, -lambda, d_image);
        (R::ONE - lambda) * l1::forward(image, target.truth()) + lambda * (R::ONE - similarity)
    })
}

/// Loss and gradients of one view, for any loss of its picture.
///
/// * `loss`: given planes `[3, height, width]`, which are 0 where pixels do not count, and as many zeros, to which it adds its gradient.
pub fn step_of<R: Real>(
    level: Level,
    cloud: &Cloud<R>,
    target: &TargetView<'_, R>,
    loss: impl FnOnce(&[R], &mut [R]) -> R,
) -> CloudGradients<R> {
    let camera = target.camera;
    let size_px = camera.size_px;
    let drawing = draw(level, cloud, camera, target.background);
    let mut image = drawing.image.to_planes(size_px);
    clear_masked(&mut image, target.mask);
    let mut d_image = vec![R::ZERO; image.len()];
    let loss = loss(&image, &mut d_image);
    clear_masked(&mut d_image, target.mask);

    let d_tiled = TiledImage::from_planes(&d_image, size_px);
    let Drawing { image: tiled, drawn, splats, footprints, lists } = drawing;
    let d_splats = rasterise::backward(level, &splats, &footprints, &lists, &tiled, &d_tiled);
    let n = drawn.len();
    let mut stored = vec![Stored::default(); n];
    let mut harmonics = vec![[[R::ZERO; 3]; MOST]; n];
    let mut screen = vec![R::ZERO; n];
    let half = size_px.map(|side| R::real(0.5 * side as f64));
    let rows = stored.par_chunks_mut(BLOCK).zip(harmonics.par_chunks_mut(BLOCK)).zip(screen.par_chunks_mut(BLOCK));
    rows.zip(drawn.par_chunks(BLOCK)).zip(d_splats.par_chunks(BLOCK)).for_each(
        |((((stored, harmonics), screen), drawn), d_splats)| {
            level.run(
                #[inline(always)]
                || {
                    for (row, (index, d_splat)) in drawn.iter().zip(d_splats).enumerate() {
                        stored[row] = splat_backward(cloud, camera, *index as usize, d_splat, &mut harmonics[row]);
                        let [x, y] = [d_splat.mean_px[0] * half[0], d_splat.mean_px[1] * half[1]];
                        screen[row] = (x * x + y * y).sqrt();
                    }
                },
            );
        },
    );
    let squared_error = target.squared_sum(&image) / (3 * target.n_counted()) as f64;
    CloudGradients { loss, squared_error, drawn, stored, harmonics, screen }
}

#[inline(always)]
fn splat_backward<R: Real>(
    cloud: &Cloud<R>,
    camera: &Pinhole<R>,
    index: usize,
    d_splat: &Splat<R>,
    d_harmonics: &mut [[R; 3]; MOST],
) -> Stored<R> {
    let stored = cloud.stored(index);
    let gaussian: Gaussian<R> = explicit_gaussians::shape(&stored);
    let d = project::backward(camera, &gaussian, cloud.compensation, d_splat);
    let harmonics = cloud.harmonics_of(index);
    explicit_gaussians::backward(camera.centre_world, cloud.degree, &stored, harmonics, &d, d_harmonics)
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};
    use pocketsplat_capture::camera::Camera;
    use pocketsplat_gaussians::{Degree, Gaussians};

    use super::*;
    use crate::explicit::render::Renderer;
    use pocketsplat_kernels::finite_difference::{assert_piecewise_gradient, random};

    const N: usize = 5;
    const PER_GAUSSIAN: usize = 11 + 3 * MOST;

    fn camera() -> Camera {
        Camera {
            rotation: DMat3::from_rotation_y(0.2),
            translation: DVec3::new(0.1, -0.05, 2.0),
            focal_px: [22.0, 24.0],
            principal_px: [10.5, 9.0],
            width_px: 21,
            height_px: 18,
        }
    }

    fn cloud(degree: Degree, x: &[f64]) -> Cloud<f64> {
        let mut cloud = Cloud { degree, ..Cloud::empty(Degree::Three) };
        for row in x.chunks_exact(PER_GAUSSIAN) {
            let harmonics: Vec<[f64; 3]> = row[11..].chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
            let stored = Stored {
                centre: [0.5 * row[0], 0.5 * row[1], 0.5 * row[2]],
                log_scale: [row[3] - 1.5, row[4] - 1.5, row[5] - 1.5],
                rotation: [row[6], row[7], row[8], row[9]],
                opacity_logit: 2.0 * row[10],
            };
            cloud.push(&stored, &harmonics);
        }
        cloud
    }

    #[test]
    fn the_whole_step_agrees_with_finite_differences() {
        let pinhole = Pinhole::new(&camera());
        let truth: Vec<f64> = random(7, 3 * 21 * 18).iter().map(|v| 0.5 + 0.5 * v).collect();
        let target = TargetView::new(&pinhole, truth, None, [0.2, 0.1, 0.4]);
        for (seed, degree) in Degree::ALL.into_iter().enumerate() {
            let x = random(seed as u64 + 20, N * PER_GAUSSIAN);
            let found = step(Level::detect(), &cloud(degree, &x), &target, 0.2);
            let mut analytic = vec![0.0; x.len()];
            assert!(found.drawn.len() >= 3, "{} drawn", found.drawn.len());
            for (row, index) in found.drawn.iter().enumerate() {
                let out = &mut analytic[*index as usize * PER_GAUSSIAN..][..PER_GAUSSIAN];
                let d = &found.stored[row];
                let geometry = [&d.centre.map(|c| 0.5 * c)[..], &d.log_scale, &d.rotation, &[2.0 * d.opacity_logit]];
                out[..11].copy_from_slice(&geometry.concat());
                out[11..].copy_from_slice(found.harmonics[row].as_flattened());
            }
            let f = |x: &[f64]| step(Level::detect(), &cloud(degree, x), &target, 0.2).loss;
            assert_piecewise_gradient("explicit step", &x, &analytic, f);
        }
    }

    #[test]
    fn a_picture_is_what_the_definition_says() {
        // One round Gaussian in front of the camera, and one behind it that must not show.
        let camera = camera();
        let gaussians = Gaussians {
            degree: Degree::Zero,
            centres: vec![[0.0; 3], [0.0, 0.0, -9.0]],
            log_scales: vec![[-1.5; 3]; 2],
            rotations: vec![[2.0, 0.0, 0.0, 0.0]; 2],
            opacity_logits: vec![1.0; 2],
            harmonics: vec![[1.0, 0.0, -1.0]; 2],
        };
        let planes = Renderer::new(&gaussians).planes(&camera, [0.25; 3]);
        let point = camera.rotation * DVec3::ZERO + camera.translation;
        let [fx, fy] = camera.focal_px;
        let (u, v) = (fx * point.x / point.z + 10.5, fy * point.y / point.z + 9.0);
        let variance = (-3.0f64).exp();
        let row = |f: f64, at: f64| DVec3::new(1.0, 0.0, -at / point.z) * (f / point.z);
        let (jx, jy) = (row(fx, point.x), {
            let r = row(fy, point.y);
            DVec3::new(0.0, r.x, r.z)
        });
        let (a, b, c) = (jx.dot(jx) * variance + 0.3, jx.dot(jy) * variance, jy.dot(jy) * variance + 0.3);
        let det = a * c - b * b;
        let colour = [0.5 + 0.282_094_791_773_878, 0.5, 0.5 - 0.282_094_791_773_878];
        for (y, x) in (0..18).flat_map(|y| (0..21).map(move |x| (y, x))) {
            let (dx, dy) = (f64::from(x) + 0.5 - u, f64::from(y) + 0.5 - v);
            let power = -0.5 * (c * dx * dx - 2.0 * b * dx * dy + a * dy * dy) / det;
            let alpha = power.exp() / (1.0 + (-1f64).exp());
            let alpha = if alpha < 1.0 / 255.0 { 0.0 } else { alpha };
            for (channel, colour) in colour.into_iter().enumerate() {
                let expected = alpha * colour + (1.0 - alpha) * 0.25;
                let found = f64::from(planes[(channel * 18 + y as usize) * 21 + x as usize]);
                assert!((found - expected).abs() < 1e-4, "({x}, {y}): {found}, expected {expected}");
            }
        }
    }
}
