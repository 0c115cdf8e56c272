//! The lens of a photograph: a pinhole behind the distortion of Brown's model, or a fisheye.

use std::path::Path;

use super::ViewFault;
use crate::camera::Camera;

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

/// Focal lengths of cameras without a fisheye, in the image's longer side: fields of view of 157 to 0.6 degrees.
pub(super) const USUAL_FOCAL_LENGTHS: [f64; 2] = [0.1, 100.0];

/// No lens has a skew: one that moves a pixel at the border by less than this many pixels is left out without a word.
pub(super) const MAX_SKEW_PX: f64 = 0.5;

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

    /// Whether its focal length can be a camera's; a fisheye's says nothing of its field of view.
    pub(super) fn has_usual_field_of_view(&self) -> bool {
        let longer_px = f64::from(self.size_px.0.max(self.size_px.1));
        let [least, most] = USUAL_FOCAL_LENGTHS.map(|focal| focal * longer_px);
        self.projection != Projection::Perspective
            || self.focal_px.iter().all(|focal_px| (least..=most).contains(focal_px))
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
        self.nonsense()
    }

    /// Why the distortion is none of a lens: it moves a ray within the image by more than half the image, or turns back within it.
    /// A calibration that failed gives such numbers.
    fn nonsense(&self) -> Option<String> {
        if self.coefficients().all(|k| k == 0.0) {
            return None;
        }
        let (width_px, height_px) = self.size_px;
        let needed = "needed: coefficients of a calibration that fits, or none";
        // A fisheye moves rays by design: from where the one without coefficients shows them.
        let plain = Self { radial: [0.0; 4], divisor: [0.0; 3], tangential: [0.0; 2], ..self.clone() };
        let shift_px = self.largest_shift_px_from(|direction| plain.distorted(direction));
        let most_px = 0.5 * f64::from(width_px.max(height_px));
        // NaN is more than anything.
        if !(shift_px <= most_px) {
            return Some(format!(
                "the distortion moves a ray by {shift_px:.0} px in an image of {width_px}×{height_px} px, more than half of it, {needed}"
            ));
        }
        let corner_squared = self.corner_squared();
        let fold_squared = self.fold_squared(corner_squared);
        (fold_squared < corner_squared).then(|| {
            format!(
                "the distortion turns back at {:.0} % of the way from the principal point to the corner of the image, so it shows \
                 the same twice, {needed}",
                100.0 * (fold_squared / corner_squared).sqrt()
            )
        })
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

    /// How far the lens moves a point of the border of the pinhole image at most, pixels.
    pub(super) fn largest_shift_px(&self) -> f64 {
        self.largest_shift_px_from(|direction| direction)
    }

    /// The same from where something else shows the point.
    fn largest_shift_px_from(&self, shown: impl Fn([f64; 2]) -> [f64; 2]) -> f64 {
        let (width_px, height_px) = (f64::from(self.size_px.0), f64::from(self.size_px.1));
        let steps = (0..=16).map(|i| f64::from(i) / 16.0);
        let border = steps.flat_map(|t| {
            [[t * width_px, 0.0], [t * width_px, height_px], [0.0, t * height_px], [width_px, t * height_px]]
        });
        let shift = |at: [f64; 2]| {
            let direction = self.direction(at);
            let [from, to] = [shown(direction), self.distorted(direction)].map(|at| self.pixel(at));
            (to[0] - from[0]).hypot(to[1] - from[1])
        };
        // Unlike `f64::max` this keeps what is no number.
        border.map(shift).fold(0.0, |most, shift| if shift <= most { most } else { shift })
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
mod tests;
