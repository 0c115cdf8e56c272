//! Which anchors a view may show.

use pocketsplat_format::rules::{DILATION_PX2, DILATION_REACH_PX, INK_DEVIATIONS};

use crate::ops::Pinhole;
use crate::ops::pinhole::NEAR;
use crate::real::Real;
use crate::scene::Scene;

/// Whether the view draws anything of an anchor: by [`anchor_is_visible`] where the heads see the view; where they don't, by
/// `offset_reaches`, which leaves nothing out, because a decoder that evaluates such Gaussians once knows no anchors any more.
pub fn shows<R: Real>(scene: &Scene<R>, anchor: usize, camera: &Pinhole<R>) -> bool {
    let position = scene.position(anchor);
    let n_log_scales = scene.shape.n_log_scales();
    let (extent, base) = scene.anchors.log_scales[anchor * n_log_scales..][..n_log_scales].split_at(3);
    let extent = [extent[0].exp(), extent[1].exp(), extent[2].exp()];
    if scene.shape.sees_view() {
        return anchor_is_visible(camera, position, extent);
    }
    let radius = R::real(INK_DEVIATIONS) * base.iter().fold(R::ZERO, |widest, size| widest.larger(size.exp()));
    let n_offsets = scene.shape.n_offsets;
    (anchor * n_offsets..(anchor + 1) * n_offsets).filter(|offset| scene.anchors.is_drawn(*offset)).any(|offset| {
        let along = &scene.anchors.offsets[offset * 3..][..3];
        offset_reaches(camera, std::array::from_fn(|i| position[i] + along[i] * extent[i]), radius)
    })
}

/// Whether a Gaussian whose ink lies in a ball may reach the image; true more often than needed, never false wrongly.
///
/// At slope t within the limits of the Jacobian it reaches r·f/z·√(1 + t²) and the dilation's reach from its centre.
fn offset_reaches<R: Real>(camera: &Pinhole<R>, centre: [R; 3], radius: R) -> bool {
    let [x, y, z] = camera.to_cam(centre);
    if !(z > R::real(NEAR)) {
        return false;
    }
    [(0, x / z), (1, y / z)].into_iter().all(|(axis, slope)| {
        let [low, high] = camera.slope_bounds(axis);
        let t = slope.larger(low).smaller(high);
        let stretch = (R::ONE + t * t).sqrt();
        let focal_px = camera.focal_px[axis];
        let reach = radius * focal_px / z * stretch + R::real(DILATION_REACH_PX);
        let at = focal_px * slope + camera.principal_px[axis];
        at + reach > R::ZERO && at - reach < R::real(camera.size_px[axis] as f64)
    })
}

/// Whether an anchor, taken as a Gaussian of scale `size` and identity rotation, reaches the image.
///
/// Σ' = J·W·diag(size²)·Wᵀ·Jᵀ + 0.3·I, radius = ⌈3·√λmax⌉ with λmax = m + √max(0.1, m² − det Σ'), m the mean of the
/// diagonal (the frustum filter of Scaffold-GS); visible when the depth exceeds [`NEAR`] and the square of that radius
/// around the projected centre overlaps the image. No gradient.
///
/// * `position`: world frame, normalised units. * `size`: `exp(log_scales[0..3])`.
#[inline]
pub fn anchor_is_visible<R: Real>(camera: &Pinhole<R>, position: [R; 3], size: [R; 3]) -> bool {
    let [x, y, z] = camera.to_cam(position);
    if !(z > R::real(NEAR)) {
        return false;
    }
    let [fx, fy] = camera.focal_px;
    let slope = [x / z, y / z];
    let [x_lo, x_hi] = camera.slope_bounds(0);
    let [y_lo, y_hi] = camera.slope_bounds(1);
    let (tx, ty) = (slope[0].larger(x_lo).smaller(x_hi), slope[1].larger(y_lo).smaller(y_hi));
    let mut cov = [R::real(DILATION_PX2), R::ZERO, R::real(DILATION_PX2)];
    for axis in 0..3 {
        let column =
            [camera.rotation[0][axis], camera.rotation[1][axis], camera.rotation[2][axis]].map(|r| r * size[axis]);
        let a = fx / z * (column[0] - tx * column[2]);
        let b = fy / z * (column[1] - ty * column[2]);
        cov[0] += a * a;
        cov[1] += a * b;
        cov[2] += b * b;
    }
    let half = R::real(0.5);
    let half_difference = half * (cov[0] - cov[2]);
    // m² − det Σ' without the difference of two large numbers, which for a needle's rounding could even make det negative.
    let spread = half_difference * half_difference + cov[1] * cov[1];
    let lambda_max = half * (cov[0] + cov[2]) + spread.larger(R::real(0.1)).sqrt();
    let radius: f64 = (R::real(3.0) * lambda_max.sqrt()).into();
    let radius = R::real(radius.ceil());
    let (u, v) = (fx * slope[0] + camera.principal_px[0], fy * slope[1] + camera.principal_px[1]);
    let [width, height] = camera.size_px.map(|s| R::real(s as f64));
    u + radius > R::ZERO && u - radius < width && v + radius > R::ZERO && v - radius < height
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::heads::neural_gaussians::Gaussian;
    use crate::ops::image::project;
    use glam::{DMat3, DVec3};
    use pocketsplat_capture::camera::Camera;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn camera() -> Pinhole<f64> {
        Pinhole::new(&Camera {
            rotation: DMat3::IDENTITY,
            translation: DVec3::ZERO,
            focal_px: [100.0; 2],
            principal_px: [50.0; 2],
            width_px: 100,
            height_px: 100,
        })
    }

    #[test]
    fn whatever_draws_a_pixel_may_reach_the_image() {
        let camera = camera();
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let (mut n_drawn, mut n_left_out) = (0, 0);
        for _ in 0..50_000 {
            let depth = rng.random_range(-0.5..4.0);
            let centre = [rng.random_range(-4.0..4.0), rng.random_range(-4.0..4.0), depth];
            let scale = [0; 3].map(|_| 10.0_f64.powf(rng.random_range(-4.0..0.5)));
            let rotation = [0; 4].map(|_| rng.random_range(-1.0..1.0_f64));
            let norm = rotation.iter().map(|q| q * q).sum::<f64>().sqrt();
            let gaussian =
                Gaussian { centre, scale, rotation: rotation.map(|q| q / norm), opacity: 1.0, colour: [0.5; 3] };
            let widest = scale.into_iter().fold(0.0, f64::max);
            let reaches = offset_reaches(&camera, centre, INK_DEVIATIONS * widest);
            let is_drawn = project::forward(&camera, &gaussian, false).is_some();
            assert!(reaches || !is_drawn, "{gaussian:?}");
            n_drawn += u32::from(is_drawn);
            n_left_out += u32::from(!reaches);
        }
        assert!(n_drawn > 5_000 && n_left_out > 5_000, "{n_drawn} drawn, {n_left_out} left out");
    }

    #[test]
    fn an_anchor_outside_counts_only_if_it_reaches_in() {
        let camera = camera();
        assert!(anchor_is_visible(&camera, [0.0, 0.0, 1.0], [0.001; 3]));
        assert!(!anchor_is_visible(&camera, [0.0, 0.0, 0.2], [0.001; 3]), "on the near plane");
        assert!(!anchor_is_visible(&camera, [0.0, 0.0, -1.0], [0.5; 3]), "behind");
        // 30 px outside on the right: a radius of 3 px does not reach, one of 60 px does.
        assert!(!anchor_is_visible(&camera, [0.8, 0.0, 1.0], [0.001; 3]));
        assert!(anchor_is_visible(&camera, [0.8, 0.0, 1.0], [0.2; 3]));
        assert!(!anchor_is_visible(&camera, [f64::NAN, 0.0, 1.0], [0.2; 3]));
    }

    #[test]
    fn a_needle_of_an_anchor_is_seen_in_f32() {
        // Seen askew it lies across the image's diagonal: det Σ' is a small difference of large numbers.
        for turn in 0..40 {
            let rotation = DMat3::from_rotation_z(0.6 + 0.01 * f64::from(turn));
            let camera = Camera {
                rotation,
                translation: DVec3::new(0.0, 0.0, 2.0),
                focal_px: [100.0; 2],
                principal_px: [50.0; 2],
                width_px: 100,
                height_px: 100,
            };
            let camera = Pinhole::<f32>::new(&camera);
            assert!(anchor_is_visible(&camera, [0.0; 3], [200.0, 1e-3, 1e-3]), "turned by {turn} hundredths");
        }
    }
}
