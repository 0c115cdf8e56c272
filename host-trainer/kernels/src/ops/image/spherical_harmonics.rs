//! Colours that follow the view direction: real spherical harmonics of degree 0 to 3.
//!
//! Y_l^m = √((2l + 1)/4π · (l − |m|)!/(l + |m|)!) · P_l^|m|(z) · {√2·cos mφ, 1, √2·sin |m|φ} for m {> 0, = 0, < 0}, where P has the
//! Condon–Shortley sign (−1)^m (Sloan 2008, Stupid Spherical Harmonics Tricks, appendix A1); here as polynomials of a unit vector
//! (x, y, z). Coefficient l² + l + m stands for Y_l^m. These are the order and the signs of published `.ply` files (Kerbl et al. 2023).
//! The tests derive every polynomial from the definition.

use pocketsplat_gaussians::Degree;

use crate::real::{Real, per_axis};

/// Functions of the highest degree.
pub const MOST: usize = Degree::Three.n_coefficients();

/// √(1/4π).
const L0: f64 = 0.282_094_791_773_878_14;
/// √(3/4π).
const L1: f64 = 0.488_602_511_902_919_9;
/// √(15/4π), for xy, yz and xz; half of it for x² − y².
const L2: f64 = 1.092_548_430_592_079;
/// √(5/16π), for m = 0.
const L2_0: f64 = 0.315_391_565_252_520_05;
/// √(7/16π), √(21/32π), √(105/4π) and √(35/32π), for |m| = 0 to 3; half of the third for z(x² − y²).
const L3: [f64; 4] = [0.373_176_332_590_115_4, 0.457_045_799_464_465_8, 2.890_611_442_640_554, 0.590_043_589_926_643_5];

/// All functions up to `degree` at a unit vector; 0 beyond.
#[inline(always)]
pub fn basis<R: Real>(degree: Degree, [x, y, z]: [R; 3]) -> [R; MOST] {
    let r = R::real;
    let mut out = [R::ZERO; MOST];
    out[0] = r(L0);
    if degree >= Degree::One {
        out[1] = r(-L1) * y;
        out[2] = r(L1) * z;
        out[3] = r(-L1) * x;
    }
    let (xx, yy, zz) = (x * x, y * y, z * z);
    if degree >= Degree::Two {
        out[4] = r(L2) * (x * y);
        out[5] = r(-L2) * (y * z);
        out[6] = r(L2_0) * (r(3.0) * zz - R::ONE);
        out[7] = r(-L2) * (x * z);
        out[8] = r(L2 / 2.0) * (xx - yy);
    }
    if degree >= Degree::Three {
        let [c0, c1, c2, c3] = L3;
        out[9] = r(-c3) * (y * (r(3.0) * xx - yy));
        out[10] = r(c2) * (x * y * z);
        out[11] = r(-c1) * (y * (r(5.0) * zz - R::ONE));
        out[12] = r(c0) * (z * (r(5.0) * zz - r(3.0)));
        out[13] = r(-c1) * (x * (r(5.0) * zz - R::ONE));
        out[14] = r(c2 / 2.0) * (z * (xx - yy));
        out[15] = r(-c3) * (x * (xx - r(3.0) * yy));
    }
    out
}

/// Derivatives of the polynomials of [`basis`] by x, y and z.
#[inline(always)]
fn basis_gradient<R: Real>(degree: Degree, [x, y, z]: [R; 3]) -> [[R; 3]; MOST] {
    let r = R::real;
    let o = R::ZERO;
    let mut out = [[o; 3]; MOST];
    if degree >= Degree::One {
        out[1][1] = r(-L1);
        out[2][2] = r(L1);
        out[3][0] = r(-L1);
    }
    if degree >= Degree::Two {
        out[4] = [r(L2) * y, r(L2) * x, o];
        out[5] = [o, r(-L2) * z, r(-L2) * y];
        out[6] = [o, o, r(6.0 * L2_0) * z];
        out[7] = [r(-L2) * z, o, r(-L2) * x];
        out[8] = [r(L2) * x, r(-L2) * y, o];
    }
    if degree >= Degree::Three {
        let [c0, c1, c2, c3] = L3;
        let (xx, yy, zz) = (x * x, y * y, z * z);
        let difference = xx - yy;
        out[9] = [r(-6.0 * c3) * (x * y), r(-3.0 * c3) * difference, o];
        out[10] = [r(c2) * (y * z), r(c2) * (x * z), r(c2) * (x * y)];
        out[11] = [o, r(-c1) * (r(5.0) * zz - R::ONE), r(-10.0 * c1) * (y * z)];
        out[12] = [o, o, r(c0) * (r(15.0) * zz - r(3.0))];
        out[13] = [r(-c1) * (r(5.0) * zz - R::ONE), o, r(-10.0 * c1) * (x * z)];
        out[14] = [r(c2) * (x * z), r(-c2) * (y * z), r(c2 / 2.0) * difference];
        out[15] = [r(-3.0 * c3) * difference, r(6.0 * c3) * (x * y), o];
    }
    out
}

/// max(0, ½ + Σ Yᵢ(direction)·cᵢ) (Kerbl et al. 2023, section 5.2, and their files).
///
/// * `direction`: unit vector, from the camera to the centre. * `coefficients`: those of `degree` at least, RGB each.
#[inline(always)]
pub fn forward<R: Real>(degree: Degree, direction: [R; 3], coefficients: &[[R; 3]]) -> [R; 3] {
    unclamped(degree, direction, coefficients).map(
        #[inline(always)]
        |channel| channel.larger(R::ZERO),
    )
}

#[inline(always)]
fn unclamped<R: Real>(degree: Degree, direction: [R; 3], coefficients: &[[R; 3]]) -> [R; 3] {
    let mut colour = [R::real(0.5); 3];
    let n = degree.n_coefficients();
    for (y, c) in basis(degree, direction).iter().zip(&coefficients[..n]) {
        for channel in 0..3 {
            colour[channel] += *y * c[channel];
        }
    }
    colour
}

/// Gradient of [`forward`]; a channel that is cut off at 0 follows nothing.
///
/// * `d_coefficients`: those of `degree` are added to. * returns dL/d(direction), as of three free numbers.
#[inline(always)]
pub fn backward<R: Real>(
    degree: Degree,
    direction: [R; 3],
    coefficients: &[[R; 3]],
    d_colour: [R; 3],
    d_coefficients: &mut [[R; 3]],
) -> [R; 3] {
    let colour = unclamped(degree, direction, coefficients);
    let d = per_axis(|i| if colour[i] > R::ZERO { d_colour[i] } else { R::ZERO });
    let (values, slopes) = (basis(degree, direction), basis_gradient(degree, direction));
    let mut d_direction = [R::ZERO; 3];
    for i in 0..degree.n_coefficients() {
        let c = coefficients[i];
        let along = d[0] * c[0] + d[1] * c[1] + d[2] * c[2];
        for axis in 0..3 {
            d_coefficients[i][axis] += values[i] * d[axis];
            d_direction[axis] += along * slopes[i][axis];
        }
    }
    d_direction
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::finite_difference::{assert_gradient, random};

    fn unit(v: &[f64]) -> [f64; 3] {
        let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        [v[0] / length, v[1] / length, v[2] / length]
    }

    /// P_l^m with the Condon–Shortley sign, by its recurrences.
    fn legendre(l: usize, m: usize, z: f64) -> f64 {
        let odd = |n: usize| n as f64;
        let mut diagonal = 1.0;
        for i in 0..m {
            diagonal *= -odd(2 * i + 1) * (1.0 - z * z).sqrt();
        }
        let (mut older, mut newer) = (0.0, diagonal);
        for n in m + 1..=l {
            (older, newer) = (newer, (odd(2 * n - 1) * z * newer - odd(n + m - 1) * older) / odd(n - m));
        }
        newer
    }

    #[test]
    fn the_polynomials_are_those_of_the_definition() {
        let factorial = |n: usize| (1..=n).map(|i| i as f64).product::<f64>();
        for v in random(1, 300).chunks_exact(3) {
            let [x, y, z] = unit(v);
            let found = basis(Degree::Three, [x, y, z]);
            let phi = y.atan2(x);
            for l in 0..4usize {
                for m in 0..=l {
                    let norm = ((2 * l + 1) as f64 / (4.0 * PI) * factorial(l - m) / factorial(l + m)).sqrt();
                    let part = norm * legendre(l, m, z) * if m == 0 { 1.0 } else { 2f64.sqrt() };
                    let turn = m as f64 * phi;
                    assert!((found[l * l + l + m] - part * turn.cos()).abs() < 1e-12, "l {l}, m {m}");
                    if m > 0 {
                        assert!((found[l * l + l - m] - part * turn.sin()).abs() < 1e-12, "l {l}, m -{m}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_functions_are_orthonormal() {
        // Simpson's rule in z, equal steps in φ: exact for polynomials of this degree but for 1e-10.
        let (n_z, n_phi) = (1600, 16);
        let mut products = [[0.0; MOST]; MOST];
        for i in 0..=n_z {
            let z = -1.0 + 2.0 * f64::from(i) / f64::from(n_z);
            let simpson = if i == 0 || i == n_z { 1.0 } else { 2.0 + 2.0 * f64::from(i % 2) };
            let area = simpson * 2.0 / f64::from(n_z) / 3.0 * 2.0 * PI / f64::from(n_phi);
            for j in 0..n_phi {
                let (sin, cos) = (2.0 * PI * f64::from(j) / f64::from(n_phi)).sin_cos();
                let radius = (1.0 - z * z).sqrt();
                let y = basis(Degree::Three, [radius * cos, radius * sin, z]);
                for (row, a) in products.iter_mut().zip(y) {
                    row.iter_mut().zip(y).for_each(|(product, b)| *product += area * a * b);
                }
            }
        }
        for (i, row) in products.iter().enumerate() {
            for (j, product) in row.iter().enumerate() {
                let expected = f64::from(u8::from(i == j));
                assert!((product - expected).abs() < 1e-8, "∫Y{i}·Y{j} = {product}");
            }
        }
    }

    #[test]
    fn a_lower_degree_leaves_the_higher_functions_out() {
        let direction = unit(&[0.3, -0.5, 0.7]);
        let all = basis(Degree::Three, direction);
        for degree in Degree::ALL {
            let n = degree.n_coefficients();
            let found = basis(degree, direction);
            assert_eq!((&found[..n], &found[n..]), (&all[..n], vec![0.0; MOST - n].as_slice()));
        }
        assert_eq!(forward(Degree::Zero, direction, &[[-9.0, 0.0, 1.0]]), [0.0, 0.5, 0.5 + L0]);
    }

    #[test]
    fn backward_agrees_with_finite_differences() {
        for (seed, degree) in (0..12).flat_map(|seed| Degree::ALL.map(|degree| (seed, degree))) {
            let n = degree.n_coefficients();
            let mut x = random(seed, 3 + 3 * n);
            let weights = random(seed + 50, 3);
            // One channel is cut off.
            x[3] -= if seed % 2 == 0 { 20.0 } else { 0.0 };
            let split = |x: &[f64]| {
                let coefficients: Vec<[f64; 3]> = x[3..].chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
                ([x[0], x[1], x[2]], coefficients)
            };
            let f = |x: &[f64]| {
                let (direction, coefficients) = split(x);
                forward(degree, direction, &coefficients).iter().zip(&weights).map(|(c, w)| c * w).sum::<f64>()
            };
            let (direction, coefficients) = split(&x);
            let mut d = vec![[0.0; 3]; n];
            let d_direction = backward(degree, direction, &coefficients, [weights[0], weights[1], weights[2]], &mut d);
            assert_gradient("spherical harmonics", &x, &[&d_direction, d.as_flattened()].concat(), f);
        }
    }
}
