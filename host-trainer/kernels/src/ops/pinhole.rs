//! The camera as the operations see it.

use glam::{DMat3, DQuat, DVec3};

use crate::real::Real;
use pocketsplat_capture::camera::Camera;
use pocketsplat_format::rules;

/// Centres at this depth or nearer are not drawn, normalised units: the same number in every precision.
pub const NEAR: f64 = rules::NEAR as f64;

/// A pinhole camera in the number type of the operations; conventions of [`Camera`].
#[derive(Clone, Copy, Debug)]
pub struct Pinhole<R> {
    /// World to camera, rows.
    pub rotation: [[R; 3]; 3],
    /// World to camera.
    pub translation: [R; 3],
    /// Camera centre, world frame.
    pub centre_world: [R; 3],
    /// `[fx, fy]`, pixels.
    pub focal_px: [R; 2],
    /// `[cx, cy]`, pixels.
    pub principal_px: [R; 2],
    /// `[width, height]`, pixels.
    pub size_px: [usize; 2],
}

impl<R: Real> Pinhole<R> {
    /// Rounds `camera` to the number type.
    pub fn new(camera: &Camera) -> Self {
        let rotation = camera.rotation.transpose().to_cols_array_2d();
        Self {
            rotation: rotation.map(|row| row.map(R::real)),
            translation: camera.translation.to_array().map(R::real),
            centre_world: camera.centre_world().to_array().map(R::real),
            focal_px: camera.focal_px.map(R::real),
            principal_px: camera.principal_px.map(R::real),
            size_px: [camera.width_px as usize, camera.height_px as usize],
        }
    }

    /// The camera after a small motion in its own frame: rotation exp(ω)·R and translation exp(ω)·t + τ for a twist `[ω, τ]` in radians
    /// and normalised units (exp by Rodrigues' formula). A twist of 0 leaves it as it is, to the bit.
    #[must_use]
    pub fn moved(&self, twist: [f64; 6]) -> Self {
        if twist == [0.0; 6] {
            return *self;
        }
        let [x, y, z, tau @ ..] = twist;
        let turn = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(x, y, z)));
        let rotation = turn * DMat3::from_cols_array_2d(&self.rotation.map(|row| row.map(Into::into))).transpose();
        let translation = turn * DVec3::from_array(self.translation.map(Into::into)) + DVec3::from_array(tau);
        let centre_world = -(rotation.transpose() * translation);
        Self {
            rotation: rotation.transpose().to_cols_array_2d().map(|row| row.map(R::real)),
            translation: translation.to_array().map(R::real),
            centre_world: centre_world.to_array().map(R::real),
            ..*self
        }
    }

    /// `R·v`: a vector of the world in the camera frame.
    #[inline(always)]
    pub fn turned(&self, world: [R; 3]) -> [R; 3] {
        self.rotation.map(|row| row[0] * world[0] + row[1] * world[1] + row[2] * world[2])
    }

    /// `R·p + t`.
    #[inline(always)]
    pub fn to_cam(&self, point_world: [R; 3]) -> [R; 3] {
        let mut point_cam = self.translation;
        for (out, row) in point_cam.iter_mut().zip(&self.rotation) {
            *out += row[0] * point_world[0] + row[1] * point_world[1] + row[2] * point_world[2];
        }
        point_cam
    }

    /// `Rᵀ·g`: takes the gradient of a camera-frame vector to the world frame.
    #[inline(always)]
    pub fn gradient_to_world(&self, gradient_cam: [R; 3]) -> [R; 3] {
        let mut world = [R::ZERO; 3];
        for (row, g) in self.rotation.iter().zip(gradient_cam) {
            for (out, r) in world.iter_mut().zip(row) {
                *out += *r * g;
            }
        }
        world
    }

    /// Bounds of x/z (axis 0) or y/z (axis 1) inside which the EWA Jacobian is evaluated: the image's own bounds plus
    /// 15 % of its size on either side, which for a central principal point is 3DGS's 1.3·tan(fov/2).
    #[inline(always)]
    pub fn slope_bounds(&self, axis: usize) -> [R; 2] {
        let size = R::real(self.size_px[axis] as f64);
        let (focal, principal) = (self.focal_px[axis], self.principal_px[axis]);
        let margin = R::real(0.15) * size;
        [-(principal + margin) / focal, (size - principal + margin) / focal]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step::example::camera;

    #[test]
    fn a_camera_moves_in_its_own_frame() {
        let given: Pinhole<f64> = Pinhole::new(&camera());
        let (twist, point) = ([0.3, -0.2, 0.1, 0.4, 0.5, -0.6], [0.7, -0.8, 0.9]);
        let moved = given.moved(twist);
        let turn = DQuat::from_scaled_axis(DVec3::from_slice(&twist[..3]));
        let expected = turn * DVec3::from_array(given.to_cam(point)) + DVec3::from_slice(&twist[3..]);
        assert!((DVec3::from_array(moved.to_cam(point)) - expected).length() < 1e-12);
        assert!(DVec3::from_array(moved.to_cam(moved.centre_world)).length() < 1e-12, "its centre is where it stands");
        let single: Pinhole<f32> = Pinhole::new(&camera());
        assert_eq!(single.moved([0.0; 6]).centre_world, single.centre_world, "to the bit");
    }
}
