//! The covariance of a splat on the image plane.

use super::dilation::Dilation;
use super::view::dot;

/// Σ' = P·Pᵀ + d·I with the frame's [dilation](Dilation) d and P = J·R·S, the 2×3 map from the Gaussian's unit sphere to pixels.
pub(super) struct Covariance {
    /// Variances and covariance, px².
    pub(super) xx: f32,
    pub(super) xy: f32,
    pub(super) yy: f32,
    /// det Σ', px⁴.
    pub(super) det: f32,
    /// The determinant with the dilation that opacities were trained with, px⁴.
    pub(super) det_trained: f32,
}

impl Covariance {
    /// From the rows of P.
    ///
    /// The determinants come from |p × q|² (Cauchy–Binet) and a sum of positive terms instead of xx·yy − xy²: for a
    /// needle of 300 by 1 pixels that difference would lose five of f32's seven digits.
    #[inline]
    pub(super) fn from_rows([p, q]: [[f32; 3]; 2], dilation: Dilation) -> Self {
        let [p0, p1, p2] = p;
        let [q0, q1, q2] = q;
        let cross = [p1 * q2 - p2 * q1, p2 * q0 - p0 * q2, p0 * q1 - p1 * q0];
        let [pp, qq] = [dot(p, p), dot(q, q)];
        Self::of([pp, qq], dot(p, q), dot(cross, cross), dilation)
    }

    /// Of a Gaussian of one deviation, for which R and its own rotation cancel: Σ' = σ²·J·Jᵀ + d·I.
    ///
    /// With a = σ·fx/z, b = σ·fy/z that is [a²(1 + tx²), ab·tx·ty; ab·tx·ty, b²(1 + ty²)], whose determinant without dilation,
    /// (ab)²(1 + tx² + ty²), has no difference in it.
    ///
    /// * `[tx, ty]`: slopes within the clamp. * `[a, b]`: the deviation along either axis in front of the camera, pixels.
    #[inline]
    pub(super) fn of_isotropic([tx, ty]: [f32; 2], [a, b]: [f32; 2], dilation: Dilation) -> Self {
        let [tx_2, ty_2] = [tx * tx, ty * ty];
        let [pp, qq] = [a * a * (1.0 + tx_2), b * b * (1.0 + ty_2)];
        let ab = a * b;
        Self::of([pp, qq], ab * (tx * ty), ab * ab * (1.0 + tx_2 + ty_2), dilation)
    }

    /// From the variances, covariance and determinant of P·Pᵀ.
    #[inline]
    fn of([pp, qq]: [f32; 2], xy: f32, det_bare: f32, dilation: Dilation) -> Self {
        let det_with = |added: f32| det_bare + added * (pp + qq) + added * added;
        let Dilation { added_px2, trained_px2, .. } = dilation;
        Self {
            xx: pp + added_px2,
            xy,
            yy: qq + added_px2,
            det: det_with(added_px2),
            det_trained: det_with(trained_px2),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Covariance;
    use crate::project::dilation::Dilation;

    #[test]
    fn of_an_isotropic_gaussian_it_is_that_of_the_rows_of_its_jacobian() {
        for (tx, ty) in [(0.0, 0.0), (0.3, -0.7), (-1.9, 0.02), (5.0, 6.0)] {
            for (a, b) in [(1e-4_f32, 2e-4_f32), (0.7, 0.5), (300.0, 310.0), (6e3, 1e4)] {
                let dilation = Dilation { trained_px2: 0.1, ..Dilation::AS_TRAINED };
                let rows = Covariance::from_rows([[a, 0.0, -a * tx], [0.0, b, -b * ty]], dilation);
                let short = Covariance::of_isotropic([tx, ty], [a, b], dilation);
                let near = |found: f32, expected: f32| (found - expected).abs() <= 1e-6 * expected.abs();
                assert!(near(short.xx, rows.xx) && near(short.xy, rows.xy) && near(short.yy, rows.yy), "{tx} {ty} {a}");
                assert!(near(short.det, rows.det) && near(short.det_trained, rows.det_trained), "{tx} {ty} {a}");
            }
        }
    }
}
