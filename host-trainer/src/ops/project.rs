//! From a 3-D Gaussian to its splat on the image plane.

use super::neural_gaussians::Gaussian;
use super::pinhole::NEAR;
use super::real::per_axis;
use super::{Pinhole, Real};

/// Low-pass term added to both diagonal entries of a projected covariance, px² (3DGS).
pub const DILATION_PX2: f64 = 0.3;

/// A contribution below one 8-bit step is not drawn, in training as in the decoder (Kerbl et al. 2023).
pub const ALPHA_CUTOFF: f64 = 1.0 / 255.0;

/// What the rasteriser reads of a splat.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Splat<R> {
    /// Centre, pixels.
    pub mean_px: [R; 2],
    /// Inverse covariance `[xx, xy, yy]`, px⁻².
    pub conic: [R; 3],
    /// Opacity, dilation compensated where the model asks for it.
    pub opacity: R,
    /// RGB.
    pub colour: [R; 3],
}

/// How far a splat reaches and when it is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footprint<R> {
    /// Depth of the centre in the camera frame, normalised units.
    pub depth: R,
    /// Half extents of the ellipse on which alpha falls to [`ALPHA_CUTOFF`], pixels.
    pub half_extent_px: [R; 2],
}

/// What forward computes and backward needs again.
struct Projection<R> {
    point_cam: [R; 3],
    /// x/z and y/z inside the slope bounds, and whether they were inside already.
    slope: [R; 2],
    free: [bool; 2],
    /// W·R(q), the Gaussian's axes in the camera frame.
    axes_cam: [[R; 3]; 3],
    /// J·W·R(q)·S, so that Σ' = T·Tᵀ + 0.3·I.
    t: [[R; 3]; 2],
    /// Σ' without the dilation `[xx, xy, yy]`.
    sharp: [R; 3],
    det_sharp: R,
    det: R,
}

/// R(q) of a unit quaternion (w, x, y, z).
#[inline(always)]
fn rotation_matrix<R: Real>([w, x, y, z]: [R; 4]) -> [[R; 3]; 3] {
    let two = R::real(2.0);
    [
        [R::ONE - two * (y * y + z * z), two * (x * y - w * z), two * (x * z + w * y)],
        [two * (x * y + w * z), R::ONE - two * (x * x + z * z), two * (y * z - w * x)],
        [two * (x * z - w * y), two * (y * z + w * x), R::ONE - two * (x * x + y * y)],
    ]
}

#[inline(always)]
fn prepare<R: Real>(camera: &Pinhole<R>, gaussian: &Gaussian<R>) -> Option<Projection<R>> {
    let point_cam = camera.to_cam(gaussian.centre);
    let [x, y, z] = point_cam;
    if !(z > R::real(NEAR)) {
        return None;
    }
    let exact = [x / z, y / z];
    let bounded = |i: usize| {
        let [low, high] = camera.slope_bounds(i);
        exact[i].larger(low).smaller(high)
    };
    let slope = [bounded(0), bounded(1)];
    let free = [slope[0] == exact[0], slope[1] == exact[1]];
    let world = rotation_matrix(gaussian.rotation);
    let axes_cam = per_axis(|i| {
        per_axis(|j| {
            let w = &camera.rotation[i];
            w[0] * world[0][j] + w[1] * world[1][j] + w[2] * world[2][j]
        })
    });
    let lever = |i: usize| {
        let f = camera.focal_px[i] / z;
        per_axis(|j| f * (axes_cam[i][j] - slope[i] * axes_cam[2][j]) * gaussian.scale[j])
    };
    let t = [lever(0), lever(1)];
    let dot = |a: &[R; 3], b: &[R; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let sharp = [dot(&t[0], &t[0]), dot(&t[0], &t[1]), dot(&t[1], &t[1])];
    let dilation = R::real(DILATION_PX2);
    let det_sharp = sharp[0] * sharp[2] - sharp[1] * sharp[1];
    // det(A + d·I) expanded: no cancellation when the ellipse is thin.
    let det = det_sharp.larger(R::ZERO) + dilation * (sharp[0] + sharp[2]) + dilation * dilation;
    (det.is_finite()).then_some(Projection { point_cam, slope, free, axes_cam, t, sharp, det_sharp, det })
}

/// √(det Σ / det(Σ + 0.3·I)), the share of its opacity that a dilated splat keeps (Yu et al. 2024, Mip-Splatting).
fn compensation<R: Real>(p: &Projection<R>) -> R {
    (p.det_sharp.larger(R::ZERO) / p.det).sqrt()
}

/// Projects one Gaussian, or says that it is not drawn.
///
/// Σ' = J·W·Σ·Wᵀ·Jᵀ + 0.3·I with the Jacobian J of the pinhole map at the centre, its slopes kept within
/// [`Pinhole::slope_bounds`] (Zwicker et al. 2001, EWA splatting). Not drawn: depth ≤ 0.2, opacity below
/// [`ALPHA_CUTOFF`], or an extent that covers no pixel centre. The extent is exactly where alpha reaches the cutoff:
/// dᵀ·Σ'⁻¹·d = 2·ln(255·opacity).
pub fn forward<R: Real>(
    camera: &Pinhole<R>,
    gaussian: &Gaussian<R>,
    compensated: bool,
) -> Option<(Splat<R>, Footprint<R>)> {
    let p = prepare(camera, gaussian)?;
    let opacity = if compensated { gaussian.opacity * compensation(&p) } else { gaussian.opacity };
    if !(opacity > R::real(ALPHA_CUTOFF)) {
        return None;
    }
    let dilation = R::real(DILATION_PX2);
    let cov = [p.sharp[0] + dilation, p.sharp[1], p.sharp[2] + dilation];
    let inverse = R::ONE / p.det;
    let mean = |i: usize| camera.focal_px[i] * (p.point_cam[i] / p.point_cam[2]) + camera.principal_px[i];
    let mean_px = [mean(0), mean(1)];
    let reach = R::real(2.0) * (opacity * R::real(1.0 / ALPHA_CUTOFF)).ln();
    let half_extent_px = [(reach * cov[0]).sqrt(), (reach * cov[2]).sqrt()];
    for i in 0..2 {
        let half = R::real(0.5);
        let last = R::real(camera.size_px[i] as f64) - half;
        if !(mean_px[i] + half_extent_px[i] >= half && mean_px[i] - half_extent_px[i] <= last) {
            return None;
        }
    }
    let conic = [cov[2] * inverse, -cov[1] * inverse, cov[0] * inverse];
    Some((
        Splat { mean_px, conic, opacity, colour: gaussian.colour },
        Footprint { depth: p.point_cam[2], half_extent_px },
    ))
}

/// Gradient of [`forward`] for a Gaussian that it drew.
pub fn backward<R: Real>(
    camera: &Pinhole<R>,
    gaussian: &Gaussian<R>,
    compensated: bool,
    d_splat: &Splat<R>,
) -> Gaussian<R> {
    let mut d = Gaussian { colour: d_splat.colour, opacity: d_splat.opacity, ..Gaussian::default() };
    let Some(p) = prepare(camera, gaussian) else { return d };
    let two = R::real(2.0);
    let dilation = R::real(DILATION_PX2);
    let inverse = R::ONE / p.det;
    let [a, b, c] = [(p.sharp[2] + dilation) * inverse, -p.sharp[1] * inverse, (p.sharp[0] + dilation) * inverse];

    // dΣ' = −Q·dQ·Q for Q = Σ'⁻¹; `g` holds the symmetric matrix [xx, xy, yy] of dL/dΣ'.
    let [da, db, dc] = [d_splat.conic[0], d_splat.conic[1] / two, d_splat.conic[2]];
    let [m00, m01, m10, m11] = [a * da + b * db, a * db + b * dc, b * da + c * db, b * db + c * dc];
    let mut g = [-(m00 * a + m01 * b), -(m00 * b + m01 * c), -(m10 * b + m11 * c)];
    if compensated {
        let share = compensation(&p);
        d.opacity = d_splat.opacity * share;
        if p.det_sharp > R::ZERO {
            let d_ratio = d_splat.opacity * gaussian.opacity / (two * share);
            let d_sharp = d_ratio * inverse;
            let d_det = -d_ratio * p.det_sharp * inverse * inverse;
            g[0] += d_sharp * p.sharp[2] + d_det * (p.sharp[2] + dilation);
            g[1] += -(d_sharp + d_det) * p.sharp[1];
            g[2] += d_sharp * p.sharp[0] + d_det * (p.sharp[0] + dilation);
        }
    }

    // Σ' = T·Tᵀ: dT = 2·G·T. T[i][j] = f_i/z·(axes[i][j] − slope_i·axes[2][j])·scale_j.
    let z = p.point_cam[2];
    let mut d_axes = [[R::ZERO; 3]; 3];
    let mut d_slope = [R::ZERO; 2];
    let mut d_z = R::ZERO;
    for i in 0..2 {
        let f = camera.focal_px[i] / z;
        for j in 0..3 {
            let (g0, g1) = if i == 0 { (g[0], g[1]) } else { (g[1], g[2]) };
            let d_t = two * (g0 * p.t[0][j] + g1 * p.t[1][j]);
            let lever = p.axes_cam[i][j] - p.slope[i] * p.axes_cam[2][j];
            let scaled = d_t * f * gaussian.scale[j];
            d_axes[i][j] += scaled;
            d_axes[2][j] += -scaled * p.slope[i];
            d_slope[i] += -scaled * p.axes_cam[2][j];
            d.scale[j] += d_t * f * lever;
            d_z += -d_t * p.t[i][j] / z;
        }
    }

    let mut d_cam = [R::ZERO; 3];
    for i in 0..2 {
        // The mean follows the exact slope; the Jacobian follows it only where it was not bounded.
        let d_exact = d_splat.mean_px[i] * camera.focal_px[i] + if p.free[i] { d_slope[i] } else { R::ZERO };
        d_cam[i] += d_exact / z;
        d_z += -d_exact * p.point_cam[i] / (z * z);
    }
    d_cam[2] = d_z;
    d.centre = camera.gradient_to_world(d_cam);

    // axes = W·R(q), so dR = Wᵀ·d_axes, column by column.
    let columns = per_axis(|j| camera.gradient_to_world([d_axes[0][j], d_axes[1][j], d_axes[2][j]]));
    d.rotation = quaternion_gradient(gaussian.rotation, &columns);
    d
}

/// dL/dq for L depending on R(q), with `columns[j][i]` = `∂L/∂R[i][j]`.
#[inline(always)]
fn quaternion_gradient<R: Real>([w, x, y, z]: [R; 4], columns: &[[R; 3]; 3]) -> [R; 4] {
    let two = R::real(2.0);
    let m = |i: usize, j: usize| columns[j][i];
    [
        two * (x * (m(2, 1) - m(1, 2)) + y * (m(0, 2) - m(2, 0)) + z * (m(1, 0) - m(0, 1))),
        two * (y * (m(0, 1) + m(1, 0)) + z * (m(0, 2) + m(2, 0)) + w * (m(2, 1) - m(1, 2))
            - two * x * (m(1, 1) + m(2, 2))),
        two * (x * (m(0, 1) + m(1, 0)) + z * (m(1, 2) + m(2, 1)) + w * (m(0, 2) - m(2, 0))
            - two * y * (m(0, 0) + m(2, 2))),
        two * (x * (m(0, 2) + m(2, 0)) + y * (m(1, 2) + m(2, 1)) + w * (m(1, 0) - m(0, 1))
            - two * z * (m(0, 0) + m(1, 1))),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::ops::finite_difference::{assert_gradient, random};
    use glam::{DMat3, DVec3};

    fn camera() -> Pinhole<f64> {
        Pinhole::new(&Camera {
            rotation: DMat3::from_rotation_y(0.3) * DMat3::from_rotation_x(-0.4),
            translation: DVec3::new(0.1, -0.2, 2.0),
            focal_px: [120.0, 110.0],
            principal_px: [52.0, 47.0],
            width_px: 100,
            height_px: 96,
        })
    }

    fn unpack(x: &[f64]) -> Gaussian<f64> {
        Gaussian {
            centre: [x[0], x[1], x[2]],
            scale: [x[3], x[4], x[5]],
            rotation: [x[6], x[7], x[8], x[9]],
            opacity: x[10],
            colour: [x[11], x[12], x[13]],
        }
    }

    fn pack(g: &Gaussian<f64>) -> Vec<f64> {
        [&g.centre[..], &g.scale, &g.rotation, &[g.opacity], &g.colour].concat()
    }

    fn parts(s: &Splat<f64>) -> Vec<f64> {
        [&s.mean_px[..], &s.conic, &[s.opacity], &s.colour].concat()
    }

    fn check(name: &str, camera: &Pinhole<f64>, x: &[f64], compensated: bool) {
        let splat = forward(camera, &unpack(x), compensated).unwrap_or_else(|| panic!("{name}: not drawn")).0;
        // Each output weighs as much as it is large, so that px and px⁻² are judged alike.
        let weights: Vec<f64> = random(9, 9).iter().zip(parts(&splat)).map(|(w, p)| w / p.abs().max(1e-3)).collect();
        let d_splat = Splat {
            mean_px: [weights[0], weights[1]],
            conic: [weights[2], weights[3], weights[4]],
            opacity: weights[5],
            colour: [weights[6], weights[7], weights[8]],
        };
        let analytic = pack(&backward(camera, &unpack(x), compensated, &d_splat));
        assert_gradient(name, x, &analytic, |x| {
            let splat = forward(camera, &unpack(x), compensated).expect("near a drawn Gaussian").0;
            parts(&splat).iter().zip(&weights).map(|(p, w)| p * w).sum()
        });
    }

    #[test]
    fn backward_agrees_with_finite_differences() {
        let camera = camera();
        for seed in 0..20 {
            let mut x = random(seed, 14);
            for v in &mut x[0..3] {
                *v *= 0.3;
            }
            for v in &mut x[3..6] {
                *v = 0.02 + 0.1 * v.abs();
            }
            let norm = x[6..10].iter().map(|q| q * q).sum::<f64>().sqrt();
            for v in &mut x[6..10] {
                *v /= norm;
            }
            x[10] = 0.3 + 0.5 * x[10].abs();
            check("random", &camera, &x, seed % 2 == 1);
        }
        let plain = [0.0, 0.0, 0.0, 0.05, 0.05, 0.05, 1.0, 0.0, 0.0, 0.0, 0.9, 0.5, 0.5, 0.5];
        let with = |edits: &[(usize, f64)]| {
            let mut x = plain;
            for (i, v) in edits {
                x[*i] = *v;
            }
            x
        };
        check("needle", &camera, &with(&[(3, 0.5), (4, 1e-3), (5, 1e-3)]), false);
        check("pancake", &camera, &with(&[(3, 0.4), (4, 0.4), (5, 1e-4)]), false);
        check("needle, compensated", &camera, &with(&[(3, 0.5), (4, 2e-2), (5, 2e-2)]), true);
        let grazing =
            camera.gradient_to_world(std::array::from_fn(|i| [0.05, -0.04, 0.202][i] - camera.translation[i]));
        let centre = [(0, grazing[0]), (1, grazing[1]), (2, grazing[2])];
        check("grazing the near plane", &camera, &with(&centre), false);
        check("centre beyond the slope bounds", &camera, &with(&[(0, 1.9), (3, 0.6), (4, 0.6), (5, 0.6)]), false);
    }

    #[test]
    fn behind_faint_or_outside_is_not_drawn() {
        let camera = camera();
        let mut g = unpack(&[0.0, 0.0, 0.0, 0.05, 0.05, 0.05, 1.0, 0.0, 0.0, 0.0, 0.9, 0.5, 0.5, 0.5]);
        assert!(forward(&camera, &g, false).is_some());
        g.opacity = 1.0 / 256.0;
        assert!(forward(&camera, &g, false).is_none());
        g.opacity = 0.9;
        g.centre = [0.0, 0.0, -30.0];
        assert!(forward(&camera, &g, false).is_none());
        g.centre = [4.0, 0.0, 0.0];
        assert!(forward(&camera, &g, false).is_none());
    }
}
