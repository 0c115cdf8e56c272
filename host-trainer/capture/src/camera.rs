//! The pinhole camera of the host, in f64; decoder-core has its own in f32.

use glam::{DMat3, DVec3};

/// A pinhole camera in the OpenCV frame: x right, y down, z forward.
///
/// A point projects as `u = fx·x/z + cx`, `v = fy·y/z + cy` with `(x, y, z) = R·p + t`; pixel `(i, j)` covers
/// `[i, i+1) × [j, j+1)`, so its centre is at `(i + 0.5, j + 0.5)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// World to camera rotation.
    pub rotation: DMat3,
    /// World to camera translation, in units of the world.
    pub translation: DVec3,
    /// Focal lengths `[fx, fy]`, pixels.
    pub focal_px: [f64; 2],
    /// Principal point `[cx, cy]`, pixels from the outer corner of the first pixel.
    pub principal_px: [f64; 2],
    /// Image width, pixels.
    pub width_px: u32,
    /// Image height, pixels.
    pub height_px: u32,
}

impl Camera {
    /// The camera's centre in world coordinates: `−Rᵀ·t`.
    pub fn centre_world(&self) -> DVec3 {
        -(self.rotation.transpose() * self.translation)
    }

    /// The same lens at `eye`, looking at `target`, the image's up as near to `up` as that allows.
    ///
    /// The three must not lie on one line: there is no such camera.
    pub fn looking_at(&self, eye: DVec3, target: DVec3, up: DVec3) -> Self {
        let forward = (target - eye).normalize();
        let right = forward.cross(up).normalize();
        let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
        Self { rotation, translation: -(rotation * eye), ..self.clone() }
    }

    /// The same camera with its image scaled to `width_px × height_px`.
    pub fn resized(&self, width_px: u32, height_px: u32) -> Self {
        let sx = f64::from(width_px) / f64::from(self.width_px);
        let sy = f64::from(height_px) / f64::from(self.height_px);
        Self {
            focal_px: [self.focal_px[0] * sx, self.focal_px[1] * sy],
            principal_px: [self.principal_px[0] * sx, self.principal_px[1] * sy],
            width_px,
            height_px,
            ..self.clone()
        }
    }
}

/// Cameras share a focus where the mean projector across their optical axes has at least this determinant; parallel axes give 0, axes from
/// all sides (2/3)³.
pub(crate) const MIN_DETERMINANT: f64 = 1e-3;

/// The point nearest to all optical axes in the least-squares sense; `None` where the mean projector across them has a determinant of no
/// more than `least_determinant`, as for parallel axes.
pub fn nearest_to_axes<'a>(cameras: impl Iterator<Item = &'a Camera>, least_determinant: f64) -> Option<DVec3> {
    nearest_to_lines(cameras.map(|camera| (camera.centre_world(), camera.rotation.row(2))), least_determinant)
}

/// The point nearest to all lines `c + s·d`, in the least-squares sense: it solves `Σ(I − d·dᵀ)·p = Σ(I − d·dᵀ)·c`.
///
/// `None` where the mean of `I − d·dᵀ` has a determinant of no more than `least_determinant`, as for parallel lines.
///
/// * `lines`: each a point `c` and a direction `d` of length 1.
pub(crate) fn nearest_to_lines(lines: impl Iterator<Item = (DVec3, DVec3)>, least_determinant: f64) -> Option<DVec3> {
    let (mut n, mut across_sum, mut across_centres) = (0, DMat3::ZERO, DVec3::ZERO);
    for (centre, axis) in lines {
        let across = DMat3::IDENTITY - DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
        n += 1;
        across_sum += across;
        across_centres += across * centre;
    }
    let mean = across_sum * (1.0 / f64::from(n));
    (mean.determinant() > least_determinant).then(|| across_sum.inverse() * across_centres)
}
