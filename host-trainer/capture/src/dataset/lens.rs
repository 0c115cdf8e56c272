//! The lens of a photograph: a pinhole behind the distortion of Brown's model, or a fisheye.

use std::path::Path;

use super::ViewFault;
use crate::camera::Camera;

/// Camera models whose distortion is undone, for messages.
pub(super) const READABLE_MODELS: &str = "PINHOLE, SIMPLE_PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV, \
                                          OPENCV_FISHEYE, SIMPLE_RADIAL_FISHEYE or RADIAL_FISHEYE";

/// What the radius of a direction becomes in the image before its distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Projection {
    /// The tangent of the angle to the axis: straight lines stay straight.
    Perspective,
    /// The angle to the axis itself.
    Fisheye,
}

/// How many steps the search for the fold of a distortion takes from the axis to the corner.
const FOLD_STEPS: u32 = 4096;

/// Intrinsics of a photograph as it was taken, for an image of `size_px`.
///
/// A direction `(x, y, 1)` of the camera frame meets the image at `(fx·xd + cx, fy·yd + cy)`, with `r² = x² + y²`. Through a
/// perspective lens, with `d = (1 + k1·r² + k2·r⁴ + k3·r⁶ + k4·r⁸) / (1 + q1·r² + q2·r⁴ + q3·r⁶)`,
/// `xd = x·d + 2·p1·x·y + p2·(r² + 2x²)`, `yd = y·d + p1·(r² + 2y²) + 2·p2·x·y`
/// (Brown 1966; as COLMAP's OPENCV, with k3 and q its FULL_OPENCV, with k3 and k4 nerfstudio's OPENCV).
/// Through a fisheye, with the angle `θ = atan r`, `(xd, yd) = (x, y)·θd/r`, `θd = θ·(1 + k1·θ² + k2·θ⁴ + k3·θ⁶ + k4·θ⁸)`
/// (Kannala and Brandt 2006; as COLMAP's and nerfstudio's OPENCV_FISHEYE).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lens {
    /// Width and height of the image the numbers are for, pixels.
    pub(super) size_px: (u32, u32),
    /// `[fx, fy]`, pixels.
    pub(super) focal_px: [f64; 2],
    /// `[cx, cy]`, pixels from the outer corner of the first pixel.
    pub(super) principal_px: [f64; 2],
    pub(super) projection: Projection,
    /// `[k1, k2, k3, k4]`.
    pub(super) radial: [f64; 4],
    /// `[q1, q2, q3]`; 0 for a fisheye.
    pub(super) divisor: [f64; 3],
    /// `[p1, p2]`; 0 for a fisheye.
    pub(super) tangential: [f64; 2],
}

impl Lens {
    /// A lens without distortion, its principal point in the middle.
    pub(super) fn central(size_px: (u32, u32), focal_px: [f64; 2]) -> Self {
        let principal_px = [0.5 * f64::from(size_px.0), 0.5 * f64::from(size_px.1)];
        Self {
            size_px,
            focal_px,
            principal_px,
            projection: Projection::Perspective,
            radial: [0.0; 4],
            divisor: [0.0; 3],
            tangential: [0.0; 2],
        }
    }

    /// Whether straight lines stay straight.
    pub(super) fn is_pinhole(&self) -> bool {
        self.projection == Projection::Perspective && self.coefficients().all(|k| k == 0.0)
    }

    fn coefficients(&self) -> impl Iterator<Item = f64> {
        self.radial.into_iter().chain(self.divisor).chain(self.tangential)
    }

    /// What no lens has, in words, or `None` where the numbers can be a lens.
    pub(super) fn fault(&self) -> Option<String> {
        let (width_px, height_px) = self.size_px;
        if width_px == 0 || height_px == 0 {
            return Some(format!("the image size is {width_px}×{height_px} px, needed: at least 1×1"));
        }
        if let Some(focal_px) = self.focal_px.into_iter().find(|f| !(f.is_finite() && *f > 0.0)) {
            return Some(format!("the focal length is {focal_px} px, needed: a positive number"));
        }
        let mut others = self.principal_px.into_iter().chain(self.coefficients());
        if let Some(number) = others.find(|number| !number.is_finite()) {
            return Some(format!(
                "the principal point or a distortion coefficient is {number}, needed: finite numbers"
            ));
        }
        None
    }

    /// The same lens for the image scaled to `size_px`, or `None` where that is no scaling of the image: the sides of
    /// both must be in one ratio, each to a rounding of 1 px.
    pub(super) fn scaled_to(&self, size_px: (u32, u32)) -> Option<Self> {
        let x = f64::from(size_px.0) / f64::from(self.size_px.0);
        let y = f64::from(size_px.1) / f64::from(self.size_px.1);
        is_scaling(self.size_px, size_px).then(|| Self {
            size_px,
            focal_px: [self.focal_px[0] * x, self.focal_px[1] * y],
            principal_px: [self.principal_px[0] * x, self.principal_px[1] * y],
            ..self.clone()
        })
    }

    /// The checked lens for the image file `path` of `size_px`.
    ///
    /// # Errors
    /// [`ViewFault::Lens`] where the numbers are no lens, [`ViewFault::Shape`] where they are for an image of another
    /// shape.
    pub(super) fn for_image(self, path: &Path, size_px: (u32, u32)) -> Result<Self, ViewFault> {
        if let Some(found) = self.fault() {
            return Err(ViewFault::Lens { found });
        }
        let shape = || ViewFault::Shape { path: path.to_owned(), found_px: size_px, needed_px: self.size_px };
        self.scaled_to(size_px).ok_or_else(shape)
    }

    /// Where the direction `(x, y, 1)` goes on the plane at distance 1 once it has passed the lens.
    pub(super) fn distorted(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [k1, k2, k3, k4] = self.radial;
        let r2 = x * x + y * y;
        if self.projection == Projection::Fisheye {
            let r = r2.sqrt();
            let angle = r.atan();
            let t = angle * angle;
            // θ/r goes to 1 on the axis.
            let d = if r > 0.0 { angle / r } else { 1.0 } * (1.0 + t * (k1 + t * (k2 + t * (k3 + t * k4))));
            return [x * d, y * d];
        }
        let [q1, q2, q3] = self.divisor;
        let [p1, p2] = self.tangential;
        let d = (1.0 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * k4)))) / (1.0 + r2 * (q1 + r2 * (q2 + r2 * q3)));
        [x * d + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), y * d + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y]
    }

    /// The direction of a pixel position of the pinhole image: `((u − cx)/fx, (v − cy)/fy)`.
    pub(super) fn direction(&self, [u_px, v_px]: [f64; 2]) -> [f64; 2] {
        [(u_px - self.principal_px[0]) / self.focal_px[0], (v_px - self.principal_px[1]) / self.focal_px[1]]
    }

    /// The pixel position of a point of the plane at distance 1: the inverse of [`Self::direction`].
    pub(super) fn pixel(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.focal_px[0] * x + self.principal_px[0], self.focal_px[1] * y + self.principal_px[1]]
    }

    /// The squared radius from which the radial part turns back, infinite where it does not before `limit`.
    ///
    /// With `s = r²` and `d = n/q`, `r·d` has the slope `(n·q + 2s·(n'·q − n·q')) / q²`; beyond its first zero, or one of q, the
    /// model shows again what it has shown already, which no lens does. A fisheye's is that of `θd`, with `s = θ²` and `q = 1`.
    pub(super) fn fold_squared(&self, limit: f64) -> f64 {
        let ([k1, k2, k3, k4], [q1, q2, q3]) = (self.radial, self.divisor);
        let slope = |r2: f64| {
            let s = match self.projection {
                Projection::Perspective => r2,
                Projection::Fisheye => r2.sqrt().atan().powi(2),
            };
            let n = 1.0 + s * (k1 + s * (k2 + s * (k3 + s * k4)));
            let q = 1.0 + s * (q1 + s * (q2 + s * q3));
            let n_slope = k1 + s * (2.0 * k2 + s * (3.0 * k3 + s * 4.0 * k4));
            let q_slope = q1 + s * (2.0 * q2 + s * 3.0 * q3);
            if q > 0.0 { n * q + 2.0 * s * (n_slope * q - n * q_slope) } else { 0.0 }
        };
        let steps = (1..=FOLD_STEPS).map(|i| limit * f64::from(i) / f64::from(FOLD_STEPS));
        steps.into_iter().find(|&s| slope(s) <= 0.0).unwrap_or(f64::INFINITY)
    }

    /// The largest squared radius of the pinhole image: that of its farthest corner.
    pub(super) fn corner_squared(&self) -> f64 {
        let (width_px, height_px) = (f64::from(self.size_px.0), f64::from(self.size_px.1));
        let corners = [[0.0, 0.0], [width_px, 0.0], [0.0, height_px], [width_px, height_px]];
        corners.map(|corner| self.direction(corner)).map(|[x, y]| x * x + y * y).into_iter().fold(0.0, f64::max)
    }

    /// How far the distortion moves a point of the border of the pinhole image at most, pixels.
    pub(super) fn largest_shift_px(&self) -> f64 {
        let (width_px, height_px) = (f64::from(self.size_px.0), f64::from(self.size_px.1));
        let steps = (0..=16).map(|i| f64::from(i) / 16.0);
        let border = steps.flat_map(|t| {
            [[t * width_px, 0.0], [t * width_px, height_px], [0.0, t * height_px], [width_px, t * height_px]]
        });
        let shift = |from: [f64; 2]| {
            let to = self.pixel(self.distorted(self.direction(from)));
            (to[0] - from[0]).hypot(to[1] - from[1])
        };
        border.map(shift).fold(0.0, f64::max)
    }

    /// The pinhole camera of the undistorted image: same size, same focal lengths, same principal point.
    pub(super) fn camera(&self, rotation: glam::DMat3, translation: glam::DVec3) -> Camera {
        let (width_px, height_px) = self.size_px;
        let (focal_px, principal_px) = (self.focal_px, self.principal_px);
        Camera { rotation, translation, focal_px, principal_px, width_px, height_px }
    }
}

/// Whether an image of one size can be one of the other scaled: each side may be rounded by 1 px.
pub(super) fn is_scaling(from_px: (u32, u32), to_px: (u32, u32)) -> bool {
    let ratio = |to_px: u32, from_px: u32| {
        let (to, from) = (f64::from(to_px), f64::from(from_px));
        ((to - 1.0) / from, (to + 1.0) / from)
    };
    let (x, y) = (ratio(to_px.0, from_px.0), ratio(to_px.1, from_px.1));
    x.0 <= y.1 && y.0 <= x.1
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn opencv() -> Lens {
        Lens {
            size_px: (540, 960),
            focal_px: [687.8, 687.2],
            principal_px: [277.3, 482.6],
            projection: Projection::Perspective,
            radial: [0.0578, -0.0805, 0.01, -0.002],
            divisor: [0.0; 3],
            tangential: [-9.8e-4, 1.6e-4],
        }
    }

    fn full_opencv() -> Lens {
        Lens { radial: [0.31, -0.12, 0.02, 0.0], divisor: [0.27, -0.05, 0.004], ..opencv() }
    }

    /// 118° from side to side.
    fn fisheye() -> Lens {
        Lens {
            focal_px: [300.0, 290.0],
            projection: Projection::Fisheye,
            radial: [0.03, -0.02, 0.006, -0.001],
            tangential: [0.0; 2],
            ..opencv()
        }
    }

    /// [`Lens::distorted`] as the models are written down, each power by itself and the fisheye on the sphere.
    fn slowly_distorted(lens: &Lens, [x, y]: [f64; 2]) -> [f64; 2] {
        let power = |k: &[f64], s: f64| {
            k.iter().zip(1..).map(|(k, i)| k * (0..i).map(|_| s).product::<f64>()).fold(1.0, |sum, term| sum + term)
        };
        if lens.projection == Projection::Fisheye {
            let length = (x * x + y * y + 1.0).sqrt();
            let (angle, turn) = ((1.0 / length).acos(), y.atan2(x));
            let bent = angle * power(&lens.radial, angle * angle);
            return [bent * turn.cos(), bent * turn.sin()];
        }
        let r = x.hypot(y);
        let d = power(&lens.radial, r * r) / power(&lens.divisor, r * r);
        let [p1, p2] = lens.tangential;
        let shift = [2.0 * p1 * x * y + p2 * (r * r + 2.0 * x * x), p1 * (r * r + 2.0 * y * y) + 2.0 * p2 * x * y];
        [x * d + shift[0], y * d + shift[1]]
    }

    #[test]
    fn every_model_follows_the_slow_reference() {
        for lens in [opencv(), full_opencv(), fisheye()] {
            for i in -10..=10 {
                for j in -10..=10 {
                    let direction = [0.09 * f64::from(i), 0.17 * f64::from(j)];
                    let (found, expected) = (lens.distorted(direction), slowly_distorted(&lens, direction));
                    let miss = (found[0] - expected[0]).hypot(found[1] - expected[1]);
                    // The arc cosine loses half the digits near the axis.
                    assert!(miss < 1e-8, "{:?} {direction:?}: {found:?}, {expected:?}", lens.projection);
                }
            }
        }
    }

    /// The direction that the lens sends to `target`, by Newton's iteration with a numerical Jacobian.
    fn undistorted(lens: &Lens, target: [f64; 2]) -> [f64; 2] {
        let mut at = target;
        for _ in 0..20 {
            let (here, h) = (lens.distorted(at), 1e-7);
            let dx = lens.distorted([at[0] + h, at[1]]).map(|v| v / h);
            let dy = lens.distorted([at[0], at[1] + h]).map(|v| v / h);
            let (a, c) = (dx[0] - here[0] / h, dx[1] - here[1] / h);
            let (b, d) = (dy[0] - here[0] / h, dy[1] - here[1] / h);
            let (ex, ey) = (target[0] - here[0], target[1] - here[1]);
            let determinant = a * d - b * c;
            at = [at[0] + (d * ex - b * ey) / determinant, at[1] + (a * ey - c * ex) / determinant];
        }
        at
    }

    #[test]
    fn the_inverse_undoes_the_distortion_all_over_the_image() {
        for (lens, most) in [(opencv(), 1e-12), (full_opencv(), 1e-12), (fisheye(), 1e-10)] {
            for i in 0..=10 {
                for j in 0..=10 {
                    let direction = lens.direction([54.0 * f64::from(i), 96.0 * f64::from(j)]);
                    let back = undistorted(&lens, lens.distorted(direction));
                    let miss = (back[0] - direction[0]).hypot(back[1] - direction[1]);
                    assert!(miss < most, "{:?}: {direction:?} came back as {back:?}", lens.projection);
                }
            }
        }
    }

    #[test]
    fn a_point_off_the_axes_follows_the_formula_by_hand() {
        let lens = Lens { radial: [0.1, 0.01, 0.0, 0.0], tangential: [0.02, 0.03], ..opencv() };
        // r² = 0.25, d = 1 + 0.025 + 0.000625; x: 0.3·d + 2·0.02·0.12 + 0.03·(0.25 + 0.18).
        let [x, y] = lens.distorted([0.3, 0.4]);
        assert!((x - (0.3 * 1.025_625 + 0.0048 + 0.0129)).abs() < 1e-15, "{x}");
        assert!((y - (0.4 * 1.025_625 + 0.02 * 0.57 + 0.0072)).abs() < 1e-15, "{y}");
    }

    #[test]
    fn the_fold_lies_where_the_slope_vanishes() {
        let lens = Lens { radial: [-0.5, 0.0, 0.0, 0.0], ..opencv() };
        assert!((lens.fold_squared(1.0) - 2.0 / 3.0).abs() < 1e-3, "1 − 1.5·r² = 0");
        assert_eq!(lens.fold_squared(0.5), f64::INFINITY);
        assert_eq!(opencv().fold_squared(0.7), f64::INFINITY);
        assert_eq!(full_opencv().fold_squared(0.7), f64::INFINITY);
        assert_eq!(fisheye().fold_squared(100.0), f64::INFINITY);
        // θ·(1 − 0.5·θ²) turns where 1 = 1.5·θ²; r/(1 + 2r²) where 1 = 2r²; and 1 − 2r² has no lens beyond its zero.
        let bent = Lens { radial: [-0.5, 0.0, 0.0, 0.0], ..fisheye() };
        assert!((bent.fold_squared(4.0) - (2.0_f64 / 3.0).sqrt().tan().powi(2)).abs() < 2e-3);
        for q1 in [2.0, -2.0] {
            let lens = Lens { radial: [0.0; 4], divisor: [q1, 0.0, 0.0], ..opencv() };
            assert!((lens.fold_squared(1.0) - 0.5).abs() < 1e-3, "{q1}");
        }
    }

    #[test]
    fn scaling_keeps_ratios_and_refuses_other_shapes() {
        let lens = Lens { size_px: (3118, 2078), ..opencv() };
        let eighth = lens.scaled_to((389, 259)).expect("both sides rounded down");
        assert!((eighth.focal_px[0] - 687.8 * 389.0 / 3118.0).abs() < 1e-12);
        assert!(lens.scaled_to((390, 260)).is_some() && lens.scaled_to((1559, 1039)).is_some());
        assert_eq!(lens.scaled_to((2078, 3118)), None, "turned on its side");
        assert_eq!(lens.scaled_to((3118, 2000)), None, "cut");
    }
}
