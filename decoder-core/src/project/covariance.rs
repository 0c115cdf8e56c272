//! The covariance of a splat on the image plane.

use super::view::dot;

/// Added to both variances, so that no splat is thinner than about a pixel, px².
pub(super) const DILATION: f32 = 0.3;

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
}
