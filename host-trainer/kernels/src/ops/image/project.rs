//! From a 3-D Gaussian to its splat on the image plane.

use pocketsplat_format::rules::DILATION_PX2;

use crate::ops::Pinhole;
use crate::ops::heads::neural_gaussians::Gaussian;
use crate::ops::pinhole::NEAR;
use crate::real::Real;
use crate::real::per_axis;

/// A contribution below one 8-bit step is not drawn, in training as in the decoder (Kerbl et al. 2023).
pub const ALPHA_CUTOFF: f64 = 1.0 / 255.0;

/// What the rasteriser reads of a splat.
///
/// Completing the square, dᵀΣ'⁻¹d = (dx − shear·dy)²·Σ'yy/det Σ' + dy²/Σ'yy: no term cancels another, which those of the
/// conic Σ'⁻¹ do for long thin splats. At a distance of 1,000 px along a needle they would leave an error of 0.1 in f32.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Splat<R> {
    /// Centre, pixels.
    pub mean_px: [R; 2],
    /// Σ'xy/Σ'yy: how far the centre of a row of pixels moves per row.
    pub shear: R,
    /// Σ'yy/det Σ': inverse variance along a row, px⁻².
    pub row_precision: R,
    /// 1/Σ'yy: inverse variance across rows, px⁻².
    pub column_precision: R,
    /// Opacity, dilation compensated where the model asks for it.
    pub opacity: R,
    /// RGB.
    pub colour: [R; 3],
}

/// How far a splat reaches and when it is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
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
    /// The product of the two rows of T.
    cross: [R; 3],
    /// Σ' `[xx, xy, yy]`.
    cov: [R; 3],
    /// det T·Tᵀ.
    det_sharp: R,
    /// det Σ' − det T·Tᵀ.
    det_added: R,
    /// det Σ'.
    det: R,
}

#[inline(always)]
fn dot<R: Real>(a: &[R; 3], b: &[R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(crate) fn cross<R: Real>(a: &[R; 3], b: &[R; 3]) -> [R; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
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
    let (squares, dilation) = ([dot(&t[0], &t[0]), dot(&t[1], &t[1])], R::real(DILATION_PX2));
    // |t₀ × t₁|² and a sum of positive terms (Cauchy–Binet): Σ'xx·Σ'yy − Σ'xy² would cancel when the ellipse is thin.
    let cross = cross(&t[0], &t[1]);
    let det_sharp = dot(&cross, &cross);
    let det_added = dilation * (squares[0] + squares[1]) + dilation * dilation;
    let det = det_sharp + det_added;
    let cov = [squares[0] + dilation, dot(&t[0], &t[1]), squares[1] + dilation];
    let projection = Projection { point_cam, slope, free, axes_cam, t, cross, cov, det_sharp, det_added, det };
    // Not `is_finite`: f64 draws what f32 does. NaN leaves as well.
    (det <= R::real(f32::MAX.into())).then_some(projection)
}

/// √(det Σ / det(Σ + 0.3·I)), the share of its opacity that a dilated splat keeps (Yu et al. 2024, Mip-Splatting).
fn compensation<R: Real>(p: &Projection<R>) -> R {
    (p.det_sharp / p.det).sqrt()
}

/// Projects one Gaussian, or says that it is not drawn.
///
/// Σ' = J·W·Σ·Wᵀ·Jᵀ + 0.3·I with the Jacobian J of the pinhole map at the centre, its slopes kept within
/// [`Pinhole::slope_bounds`] (Zwicker et al. 2001, EWA splatting). Not drawn: depth ≤ 0.2, opacity below
/// [`ALPHA_CUTOFF`], a determinant beyond f32, or an extent that covers no pixel centre. The extent is exactly where alpha reaches the cutoff:
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
    let mean = |i: usize| camera.focal_px[i] * (p.point_cam[i] / p.point_cam[2]) + camera.principal_px[i];
    let mean_px = [mean(0), mean(1)];
    let reach = R::real(2.0) * (opacity * R::real(1.0 / ALPHA_CUTOFF)).ln();
    let half_extent_px = [(reach * p.cov[0]).sqrt(), (reach * p.cov[2]).sqrt()];
    for i in 0..2 {
        let half = R::real(0.5);
        let last = R::real(camera.size_px[i] as f64) - half;
        if !(mean_px[i] + half_extent_px[i] >= half && mean_px[i] - half_extent_px[i] <= last) {
            return None;
        }
    }
    let splat = Splat {
        mean_px,
        shear: p.cov[1] / p.cov[2],
        row_precision: p.cov[2] / p.det,
        column_precision: R::ONE / p.cov[2],
        opacity,
        colour: gaussian.colour,
    };
    Some((splat, Footprint { depth: p.point_cam[2], half_extent_px }))
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
    let mut by_lever = ellipse_gradient(&p, d_splat);
    if compensated {
        d.opacity = add_compensation_gradient(&p, gaussian, d_splat, &mut by_lever);
    }
    let JacobianGradient { d_t, stretch } = by_lever;

    // T[i][j] = f_i/z·(axes[i][j] − slope_i·axes[2][j])·scale_j.
    let z = p.point_cam[2];
    let mut d_axes = [[R::ZERO; 3]; 3];
    let mut d_slope = [R::ZERO; 2];
    // All of T is in proportion to 1/z.
    let mut d_z = -(stretch[0] + stretch[1] + stretch[2]) / z;
    for j in 0..3 {
        d.scale[j] = if gaussian.scale[j] > R::ZERO { stretch[j] / gaussian.scale[j] } else { R::ZERO };
    }
    for i in 0..2 {
        let f = camera.focal_px[i] / z;
        for j in 0..3 {
            let scaled = d_t[i][j] * f * gaussian.scale[j];
            d_axes[i][j] += scaled;
            d_axes[2][j] += -scaled * p.slope[i];
            d_slope[i] += -scaled * p.axes_cam[2][j];
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

/// dL/dT, and by axis of the Gaussian `Σᵢ Tᵢⱼ·∂L/∂Tᵢⱼ`: what stretching it along that axis does.
struct JacobianGradient<R> {
    d_t: [[R; 3]; 2],
    stretch: [R; 3],
}

/// dL/dT through shear s, row precision p and column precision k.
///
/// ∂p/∂t₀ = −2p²·r, ∂p/∂t₁ = 2p²s·r, ∂s/∂t₀ = k·t₁, ∂s/∂t₁ = k·(r − s·t₁), ∂k/∂t₁ = −2k²·t₁ with r = t₀ − s·t₁, which
/// for a needle is the small difference of long vectors, and is taken as k·(0.3·t₀ + t₁ × (t₀ × t₁)) instead. Stretching a
/// needle hardly turns it, so the large terms of dL/dT cancel in `stretch`: it is written with r as well.
#[inline(always)]
fn ellipse_gradient<R: Real>(p: &Projection<R>, d_splat: &Splat<R>) -> JacobianGradient<R> {
    let (two, dilation, k) = (R::real(2.0), R::real(DILATION_PX2), R::ONE / p.cov[2]);
    let (shear, precision) = (p.cov[1] * k, p.cov[2] / p.det);
    let turned = cross(&p.t[1], &p.cross);
    let rest = per_axis(|j| k * (dilation * p.t[0][j] + turned[j]));
    let along = two * precision * precision * d_splat.row_precision;
    let sideways = k * d_splat.shear;
    let across = two * k * k * d_splat.column_precision;
    let t1 = &p.t[1];
    JacobianGradient {
        d_t: [
            per_axis(|j| sideways * t1[j] - along * rest[j]),
            per_axis(|j| (along * shear + sideways) * rest[j] - (sideways * shear + across) * t1[j]),
        ],
        stretch: per_axis(|j| (two * sideways * t1[j] - along * rest[j]) * rest[j] - across * t1[j] * t1[j]),
    }
}

/// Adds the gradient of the share √(det T·Tᵀ/det Σ') to dL/dT, and returns dL/d(opacity).
///
/// With ρ = share², ∂ρ/∂t₀ = 2·((1 − ρ)·t₁ × c − 0.3·ρ·t₀)/det Σ' for c = t₀ × t₁, and ∂ρ/∂t₁ likewise with c × t₀.
#[inline(always)]
fn add_compensation_gradient<R: Real>(
    p: &Projection<R>,
    gaussian: &Gaussian<R>,
    d_splat: &Splat<R>,
    by_lever: &mut JacobianGradient<R>,
) -> R {
    let share = compensation(p);
    if share > R::ZERO {
        // dL/dρ·2/det Σ', ρ being share².
        let scaled = d_splat.opacity * gaussian.opacity / (share * p.det);
        let (kept, lost) = (p.det_added / p.det, R::real(DILATION_PX2) * (p.det_sharp / p.det));
        let turned = [cross(&p.t[1], &p.cross), cross(&p.cross, &p.t[0])];
        for i in 0..2 {
            for j in 0..3 {
                let part = scaled * (kept * turned[i][j] - lost * p.t[i][j]);
                by_lever.d_t[i][j] += part;
                by_lever.stretch[j] += part * p.t[i][j];
            }
        }
    }
    d_splat.opacity * share
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
    use crate::finite_difference::{assert_gradient, random};
    use glam::{DMat3, DVec3};
    use pocketsplat_capture::camera::Camera;

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
        [&s.mean_px[..], &[s.shear, s.row_precision, s.column_precision, s.opacity], &s.colour].concat()
    }

    fn check(name: &str, camera: &Pinhole<f64>, x: &[f64], compensated: bool) {
        let splat = forward(camera, &unpack(x), compensated).unwrap_or_else(|| panic!("{name}: not drawn")).0;
        // Each output weighs as much as it is large, so that px and px⁻² are judged alike.
        let weights: Vec<f64> = random(9, 9).iter().zip(parts(&splat)).map(|(w, p)| w / p.abs().max(1e-3)).collect();
        let d_splat = Splat {
            mean_px: [weights[0], weights[1]],
            shear: weights[2],
            row_precision: weights[3],
            column_precision: weights[4],
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
    fn a_needle_of_thousands_of_pixels_keeps_its_width_in_f32() {
        let cast = |c: &Pinhole<f64>| Pinhole::<f32> {
            rotation: c.rotation.map(|row| row.map(|x| x as f32)),
            translation: c.translation.map(|x| x as f32),
            centre_world: c.centre_world.map(|x| x as f32),
            focal_px: c.focal_px.map(|x| x as f32),
            principal_px: c.principal_px.map(|x| x as f32),
            size_px: c.size_px,
        };
        let camera = camera();
        // 6,000 px by nothing, in some oblique direction.
        let exact = unpack(&[0.0, 0.0, 0.0, 100.0, 1e-4, 1e-4, 0.8, 0.2, -0.3, 0.48, 0.9, 0.5, 0.5, 0.5]);
        let round = |x: f64| x as f32;
        let rounded = Gaussian {
            centre: exact.centre.map(round),
            scale: exact.scale.map(round),
            rotation: exact.rotation.map(round),
            opacity: round(exact.opacity),
            colour: exact.colour.map(round),
        };
        let (exact, _) = forward(&camera, &exact, false).expect("drawn");
        let (found, _) = forward(&cast(&camera), &rounded, false).expect("drawn");
        assert!((f64::from(found.row_precision) / exact.row_precision - 1.0).abs() < 1e-4, "{found:?} for {exact:?}");
        assert!((f64::from(found.shear) / exact.shear - 1.0).abs() < 1e-5, "{found:?} for {exact:?}");
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
