//! From the numbers that files of explicit Gaussians store to the Gaussians of a view.

use pocketsplat_gaussians::Degree;

use super::spherical_harmonics;
use crate::ops::heads::neural_gaussians::Gaussian;
use crate::real::{Real, per_axis};

/// Vectors shorter than this are divided by it instead of by their length.
const NORM_FLOOR: f64 = 1e-12;

/// What is stored of a Gaussian besides its colour, or gradients of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stored<R> {
    /// Centre, world frame.
    pub centre: [R; 3],
    /// ln of the deviations along its own axes.
    pub log_scale: [R; 3],
    /// Quaternion (w, x, y, z) of any length.
    pub rotation: [R; 4],
    /// ln(o/(1 − o)) of the opacity o.
    pub opacity_logit: R,
}

/// The Gaussian without its colour, which is 0: scale = e^s, rotation = q/‖q‖, opacity = sigmoid (Kerbl et al. 2023, section 5.1).
#[inline(always)]
pub fn shape<R: Real>(stored: &Stored<R>) -> Gaussian<R> {
    let inverse = R::ONE / length(&stored.rotation).larger(R::real(NORM_FLOOR));
    let [w, x, y, z] = stored.rotation;
    Gaussian {
        centre: stored.centre,
        scale: per_axis(|i| stored.log_scale[i].exp()),
        rotation: [w * inverse, x * inverse, y * inverse, z * inverse],
        opacity: stored.opacity_logit.sigmoid(),
        colour: [R::ZERO; 3],
    }
}

/// The colour that a camera sees: [`spherical_harmonics::forward`] at the direction from the camera to the centre.
///
/// * `eye`: camera centre, world frame. * `harmonics`: coefficients of `degree` at least.
#[inline(always)]
pub fn colour<R: Real>(eye: [R; 3], degree: Degree, centre: [R; 3], harmonics: &[[R; 3]]) -> [R; 3] {
    spherical_harmonics::forward(degree, towards(eye, centre).0, harmonics)
}

/// Gradient of [`shape`] and [`colour`] together.
///
/// * `d`: dL/d(Gaussian). * `d_harmonics`: those of `degree` are added to. * returns the gradient of what is stored.
#[inline(always)]
pub fn backward<R: Real>(
    eye: [R; 3],
    degree: Degree,
    stored: &Stored<R>,
    harmonics: &[[R; 3]],
    d: &Gaussian<R>,
    d_harmonics: &mut [[R; 3]],
) -> Stored<R> {
    let (direction, inverse_distance) = towards(eye, stored.centre);
    let d_direction = spherical_harmonics::backward(degree, direction, harmonics, d.colour, d_harmonics);
    // The direction has length 1: what the gradient has along it is lost.
    let along = d_direction[0] * direction[0] + d_direction[1] * direction[1] + d_direction[2] * direction[2];
    let Gaussian { scale, rotation, opacity, .. } = shape(stored);
    let norm = length(&stored.rotation);
    // Below the floor the division is by a constant, and nothing is projected out.
    let radial = if norm > R::real(NORM_FLOOR) {
        (0..4).fold(R::ZERO, |sum, i| sum + rotation[i] * d.rotation[i])
    } else {
        R::ZERO
    };
    let inverse_norm = R::ONE / norm.larger(R::real(NORM_FLOOR));
    let turned = |i: usize| (d.rotation[i] - rotation[i] * radial) * inverse_norm;
    Stored {
        centre: per_axis(|i| d.centre[i] + (d_direction[i] - along * direction[i]) * inverse_distance),
        log_scale: per_axis(|i| d.scale[i] * scale[i]),
        rotation: [turned(0), turned(1), turned(2), turned(3)],
        opacity_logit: d.opacity * opacity * (R::ONE - opacity),
    }
}

/// The unit vector from `eye` to `centre`, and 1 over their distance.
#[inline(always)]
fn towards<R: Real>(eye: [R; 3], centre: [R; 3]) -> ([R; 3], R) {
    let v = per_axis(|i| centre[i] - eye[i]);
    let inverse = R::ONE / (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt().larger(R::real(NORM_FLOOR));
    (per_axis(|i| v[i] * inverse), inverse)
}

#[inline(always)]
fn length<R: Real>(q: &[R; 4]) -> R {
    (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_gradient, random};

    const EYE: [f64; 3] = [0.4, -3.0, 0.2];

    fn split(x: &[f64]) -> (Stored<f64>, Vec<[f64; 3]>) {
        let stored = Stored {
            centre: [x[0], x[1], x[2]],
            log_scale: [x[3], x[4], x[5]],
            rotation: [x[6], x[7], x[8], x[9]],
            opacity_logit: x[10],
        };
        (stored, x[11..].chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect())
    }

    #[test]
    fn backward_agrees_with_finite_differences() {
        for (seed, degree) in (0..6).flat_map(|seed| Degree::ALL.map(|degree| (seed, degree))) {
            let n = degree.n_coefficients();
            let mut x = random(seed, 11 + 3 * n);
            if seed == 3 {
                // A short quaternion, and an opacity near 1.
                x[6..10].iter_mut().for_each(|q| *q *= 1e-3);
                x[10] = 7.0;
            }
            let w = random(seed + 50, 14);
            let f = |x: &[f64]| {
                let (stored, harmonics) = split(x);
                let g = shape(&stored);
                let colour = colour(EYE, degree, stored.centre, &harmonics);
                let parts = [&g.centre[..], &g.scale, &g.rotation, &[g.opacity], &colour].concat();
                parts.iter().zip(&w).map(|(part, w)| part * w).sum::<f64>()
            };
            let d = Gaussian {
                centre: [w[0], w[1], w[2]],
                scale: [w[3], w[4], w[5]],
                rotation: [w[6], w[7], w[8], w[9]],
                opacity: w[10],
                colour: [w[11], w[12], w[13]],
            };
            let (stored, harmonics) = split(&x);
            let mut d_harmonics = vec![[0.0; 3]; n];
            let found = backward(EYE, degree, &stored, &harmonics, &d, &mut d_harmonics);
            let analytic = [
                &found.centre[..],
                &found.log_scale,
                &found.rotation,
                &[found.opacity_logit],
                d_harmonics.as_flattened(),
            ];
            assert_gradient("explicit gaussians", &x, &analytic.concat(), f);
        }
    }

    #[test]
    fn a_zero_quaternion_and_a_camera_at_the_centre_give_no_infinity() {
        let stored = Stored { centre: EYE, ..Stored::default() };
        let harmonics = [[1.0; 3]; 16];
        let mut d_harmonics = [[0.0; 3]; 16];
        let d = Gaussian { rotation: [1.0; 4], colour: [1.0; 3], ..Gaussian::default() };
        let found = backward(EYE, Degree::Three, &stored, &harmonics, &d, &mut d_harmonics);
        assert!(found.rotation.iter().chain(&found.centre).all(|x| x.is_finite()), "{found:?}");
        assert!(colour(EYE, Degree::Three, EYE, &harmonics).iter().all(|c| c.is_finite()));
        assert_eq!(shape(&stored).rotation, [0.0; 4]);
    }
}
