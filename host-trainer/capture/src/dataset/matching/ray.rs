//! The ray of a pixel as another camera sees it.

use glam::{DVec2, Vec2, Vec3};

use super::picture::Window;
use crate::camera::Camera;

/// What a pixel of one camera becomes in another for every inverse depth.
///
/// The point at depth z on the ray `r` of a pixel of the camera at `c` is `c + z·r`; the camera `R, c′` sees it along `R·r + R·(c − c′)/z`.
/// Its neighbours of the same depth are seen along the same plus `R·∂r`.
pub(super) struct Ray {
    along: Vec3,
    across: Vec3,
    column: Vec3,
    row: Vec3,
    focal_px: Vec2,
    principal_px: Vec2,
}

impl Ray {
    /// * `at`: a position in the image of `from`.
    /// * `scale`: pixels of the size that is searched for one of the cameras' size.
    pub(super) fn new(from: &Camera, at: [f64; 2], to: &Camera, scale: f64) -> Self {
        let [fx, fy] = from.focal_px;
        let direction = glam::DVec3::new((at[0] - from.principal_px[0]) / fx, (at[1] - from.principal_px[1]) / fy, 1.0);
        let turn = to.rotation * from.rotation.transpose();
        let across = to.rotation * (from.centre_world() - to.centre_world());
        Self {
            along: (turn * direction).as_vec3(),
            across: across.as_vec3(),
            column: (turn.x_axis / (fx * scale)).as_vec3(),
            row: (turn.y_axis / (fy * scale)).as_vec3(),
            focal_px: (DVec2::from(to.focal_px) * scale).as_vec2(),
            principal_px: (DVec2::from(to.principal_px) * scale).as_vec2(),
        }
    }

    /// Where the other camera sees the patch at this inverse depth, taken to face the first camera; `None` behind it, or where it is
    /// seen at more than twice or less than half the size.
    pub(super) fn window(&self, inverse_depth: f32) -> Option<Window> {
        let seen = self.along + inverse_depth * self.across;
        if seen.z <= 1e-3 {
            return None;
        }
        let on_plane = seen.truncate() / seen.z;
        let step = |d: Vec3| self.focal_px * (d.truncate() - on_plane * d.z) / seen.z;
        let (column, row) = (step(self.column), step(self.row));
        let area = column.perp_dot(row);
        (0.25..4.0).contains(&area).then(|| Window {
            middle: self.focal_px * on_plane + self.principal_px,
            column,
            row,
        })
    }
}
