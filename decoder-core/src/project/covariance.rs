//! The covariance of a splat on the image plane.

use pocketsplat_format::rules::DILATION_PX2;

use super::view::dot;

/// Added to both variances, px².
pub(super) const DILATION: f32 = DILATION_PX2 as f32;

/// Σ' = P·Pᵀ + 0.3·I with P = J·R·S, the 2×3 map from the Gaussian's unit sphere to pixels.
pub(super) struct Covariance {
    /// Variances and covariance, px².
    pub(super) xx: f32,
    pub(super) xy: f32,
    pub(super) yy: f32,
    /// det Σ', px⁴.
    pub(super) det: f32,
    /// det P·Pᵀ, the determinant without dilation, px⁴.
    pub(super) det_bare: f32,
}

impl Covariance {
    /// From the rows of P.
    ///
    /// The determinants come from |p × q|² (Cauchy–Binet) and a sum of positive terms instead of xx·yy − xy²: for a
    /// needle of 300 by 1 pixels that difference would lose five of f32's seven digits.
    #[inline]
    pub(super) fn from_rows([p, q]: [[f32; 3]; 2]) -> Self {
        let [p0, p1, p2] = p;
        let [q0, q1, q2] = q;
        let cross = [p1 * q2 - p2 * q1, p2 * q0 - p0 * q2, p0 * q1 - p1 * q0];
        let [pp, qq] = [dot(p, p), dot(q, q)];
        let det_bare = dot(cross, cross);
        Self {
            xx: pp + DILATION,
            xy: dot(p, q),
            yy: qq + DILATION,
            det: det_bare + DILATION * (pp + qq) + DILATION * DILATION,
            det_bare,
        }
    }

    /// Of a Gaussian of one deviation, for which R and its own rotation cancel: Σ' = σ²·J·Jᵀ + 0.3·I.
    ///
    /// With a = σ·fx/z, b = σ·fy/z that is [a²(1 + tx²), ab·tx·ty; ab·tx·ty, b²(1 + ty²)], whose determinant without dilation,
    /// (ab)²(1 + tx² + ty²), has no difference in it.
    ///
    /// * `[tx, ty]`: slopes within the clamp. * `[a, b]`: the deviation along either axis in front of the camera, pixels.
    #[inline]
    pub(super) fn of_isotropic([tx, ty]: [f32; 2], [a, b]: [f32; 2]) -> Self {
        let [tx_2, ty_2] = [tx * tx, ty * ty];
        let [pp, qq] = [a * a * (1.0 + tx_2), b * b * (1.0 + ty_2)];
        let ab = a * b;
        let det_bare = ab * ab * (1.0 + tx_2 + ty_2);
        Self {
            xx: pp + DILATION,
            xy: ab * (tx * ty),
            yy: qq + DILATION,
            det: det_bare + DILATION * (pp + qq) + DILATION * DILATION,
            det_bare,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Covariance;

    #[test]
    fn of_an_isotropic_gaussian_it_is_that_of_the_rows_of_its_jacobian() {
        for (tx, ty) in [(0.0, 0.0), (0.3, -0.7), (-1.9, 0.02), (5.0, 6.0)] {
            for (a, b) in [(1e-4_f32, 2e-4_f32), (0.7, 0.5), (300.0, 310.0), (6e3, 1e4)] {
                let rows = Covariance::from_rows([[a, 0.0, -a * tx], [0.0, b, -b * ty]]);
                let short = Covariance::of_isotropic([tx, ty], [a, b]);
                let near = |found: f32, expected: f32| (found - expected).abs() <= 1e-6 * expected.abs();
                assert!(near(short.xx, rows.xx) && near(short.xy, rows.xy) && near(short.yy, rows.yy), "{tx} {ty} {a}");
                assert!(near(short.det, rows.det) && near(short.det_bare, rows.det_bare), "{tx} {ty} {a}");
            }
        }
    }
}
