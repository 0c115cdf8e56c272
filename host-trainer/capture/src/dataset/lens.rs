//! The lens of a photograph: a pinhole and the radial and tangential distortion of Brown's model.

use std::path::Path;

use super::ViewFault;
use crate::camera::Camera;

/// How many steps the search for the fold of a distortion takes from the axis to the corner.
const FOLD_STEPS: u32 = 4096;

/// Intrinsics of a photograph as it was taken, for an image of `size_px`.
///
/// A direction `(x, y, 1)` of the camera frame meets the image at `(fx·xd + cx, fy·yd + cy)`, with `r² = x² + y²`,
/// `d = 1 + k1·r² + k2·r⁴ + k3·r⁶ + k4·r⁸` and
/// `xd = x·d + 2·p1·x·y + p2·(r² + 2x²)`, `yd = y·d + p1·(r² + 2y²) + 2·p2·x·y`
/// (Brown 1966; as COLMAP's OPENCV and, with k3 and k4, nerfstudio's).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lens {
    /// Width and height of the image the numbers are for, pixels.
    pub(super) size_px: (u32, u32),
    /// `[fx, fy]`, pixels.
    pub(super) focal_px: [f64; 2],
    /// `[cx, cy]`, pixels from the outer corner of the first pixel.
    pub(super) principal_px: [f64; 2],
    /// `[k1, k2, k3, k4]`.
    pub(super) radial: [f64; 4],
    /// `[p1, p2]`.
    pub(super) tangential: [f64; 2],
}

impl Lens {
    /// A lens without distortion, its principal point in the middle.
    pub(super) fn central(size_px: (u32, u32), focal_px: [f64; 2]) -> Self {
        let principal_px = [0.5 * f64::from(size_px.0), 0.5 * f64::from(size_px.1)];
        Self { size_px, focal_px, principal_px, radial: [0.0; 4], tangential: [0.0; 2] }
    }

    /// Whether straight lines stay straight.
    pub(super) fn is_pinhole(&self) -> bool {
        self.radial.iter().chain(&self.tangential).all(|&k| k == 0.0)
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
        let others = self.principal_px.iter().chain(&self.radial).chain(&self.tangential);
        if let Some(number) = others.into_iter().find(|number| !number.is_finite()) {
            return Some(format!(
                "the principal point or a distortion coefficient is {number}, needed: finite numbers"
            ));
        }
        None
    }

    /// The same lens for the image scaled to `size_px`, or `None` where that is no scaling of the image: the sides of
    /// both must be in one ratio, each to a rounding of 1 px.
    pub(super) fn scaled_to(&self, size_px: (u32, u32)) -> Option<Self> {
        let ratio = |side_px: u32, own_px: u32| {
            let (side, own) = (f64::from(side_px), f64::from(own_px));
            ((side - 1.0) / own, side / own, (side + 1.0) / own)
        };
        let (x, y) = (ratio(size_px.0, self.size_px.0), ratio(size_px.1, self.size_px.1));
        let alike = x.0 <= y.2 && y.0 <= x.2;
        alike.then(|| Self {
            size_px,
            focal_px: [self.focal_px[0] * x.1, self.focal_px[1] * y.1],
            principal_px: [self.principal_px[0] * x.1, self.principal_px[1] * y.1],
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
        let [p1, p2] = self.tangential;
        let r2 = x * x + y * y;
        let d = 1.0 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * k4)));
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
    /// `r·d(r²)` has the slope `1 + 3k1·r² + 5k2·r⁴ + 7k3·r⁶ + 9k4·r⁸`; beyond its first zero the model shows again
    /// what it has shown already, which no lens does.
    pub(super) fn fold_squared(&self, limit: f64) -> f64 {
        let [k1, k2, k3, k4] = self.radial;
        let slope = |s: f64| 1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * (7.0 * k3 + s * 9.0 * k4)));
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

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn opencv() -> Lens {
        Lens {
            size_px: (540, 960),
            focal_px: [687.8, 687.2],
            principal_px: [277.3, 482.6],
            radial: [0.0578, -0.0805, 0.01, -0.002],
            tangential: [-9.8e-4, 1.6e-4],
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
        let lens = opencv();
        for i in 0..=10 {
            for j in 0..=10 {
                let direction = lens.direction([54.0 * f64::from(i), 96.0 * f64::from(j)]);
                let back = undistorted(&lens, lens.distorted(direction));
                let miss = (back[0] - direction[0]).hypot(back[1] - direction[1]);
                assert!(miss < 1e-12, "{direction:?} came back as {back:?}");
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
