//! A camera, with what depends on it alone computed once a frame.

use pocketsplat_format::bundle::Header;
use pocketsplat_format::{Camera, DecodeError};

use super::dilation::Dilation;

/// Beyond the image by this part of its size the Jacobian stops growing.
const CLAMP_MARGIN: f32 = 0.15;

/// ln 255.
const LN_255: f32 = 5.541_263_5;

/// −ln(`steps`/255): a splat reaches as far as its opacity times this as a power of e is 1.
pub(crate) fn log_cut(steps: u8) -> f32 {
    LN_255 - libm::logf(steps.max(1).into())
}

/// A camera ready to project.
#[derive(Debug)]
pub(crate) struct View {
    pub(super) rotation: [[f32; 3]; 3],
    pub(super) translation: [f32; 3],
    /// Where the camera stands, normalised frame.
    pub(crate) eye: [f32; 3],
    pub(super) focal_px: [f32; 2],
    pub(super) principal_px: [f32; 2],
    pub(super) size_px: [f32; 2],
    /// Limits of x/z and y/z in the Jacobian.
    pub(super) slope_min: [f32; 2],
    pub(super) slope_max: [f32; 2],
    /// What is added to the variances of splats.
    pub(super) dilation: Dilation,
    /// −ln of the alpha below which a splat draws nothing.
    pub(super) log_cut: f32,
    /// How much more of a splat's rim that leaves out than in training, as opacity.
    pub(super) lost_opacity: f32,
}

impl View {
    /// Checks the camera and prepares it for a scene.
    pub(crate) fn of(header: &Header, camera: &Camera) -> Result<Self, DecodeError> {
        let view = Self::new(camera)?;
        Ok(Self { dilation: Dilation::of(header, camera), ..view })
    }

    /// The same for a scene without compensation whose training images were as large as the camera's.
    pub(crate) fn new(camera: &Camera) -> Result<Self, DecodeError> {
        camera.check()?;
        let [fx, fy] = camera.focal_px;
        let [cx, cy] = camera.principal_px;
        let [width, height] = [f32::from(camera.width_px), f32::from(camera.height_px)];
        let [margin_x, margin_y] = [CLAMP_MARGIN * width / fx, CLAMP_MARGIN * height / fy];
        Ok(Self {
            rotation: camera.rotation.rows(),
            translation: camera.translation,
            eye: camera.centre(),
            focal_px: camera.focal_px,
            principal_px: camera.principal_px,
            size_px: [width, height],
            slope_min: [-(cx / fx + margin_x), -(cy / fy + margin_y)],
            slope_max: [(width - cx) / fx + margin_x, (height - cy) / fy + margin_y],
            dilation: Dilation::AS_TRAINED,
            log_cut: LN_255,
            lost_opacity: 0.0,
        })
    }

    /// The same with splats drawn down to an alpha of `steps`/255 only, and so much more opaque that each keeps its sum.
    ///
    /// The sum of o·exp(−r²/2) over the plane down to alpha c is 2πσ²·(o − c): what a higher c takes off the rim, a higher o
    /// puts in the middle.
    pub(crate) fn cutting_at(self, steps: u8) -> Self {
        let lost_opacity = f32::from(steps.saturating_sub(1)) / 255.0;
        Self { log_cut: log_cut(steps), lost_opacity, ..self }
    }

    /// Takes a point of the normalised frame to the camera's.
    #[inline]
    pub(super) fn to_camera(&self, point: [f32; 3]) -> [f32; 3] {
        let [row_x, row_y, row_z] = self.rotation;
        let [tx, ty, tz] = self.translation;
        [dot(row_x, point) + tx, dot(row_y, point) + ty, dot(row_z, point) + tz]
    }

    /// Projects a point of the camera frame.
    #[inline]
    pub(super) fn to_image(&self, [x, y, z]: [f32; 3]) -> [f32; 2] {
        let [fx, fy] = self.focal_px;
        let [cx, cy] = self.principal_px;
        [fx * x / z + cx, fy * y / z + cy]
    }

    /// x/z and y/z within the clamp.
    #[inline]
    pub(super) fn slopes(&self, [x, y, z]: [f32; 3]) -> [f32; 2] {
        let [min_x, min_y] = self.slope_min;
        let [max_x, max_y] = self.slope_max;
        [clamp(x / z, min_x, max_x), clamp(y / z, min_y, max_y)]
    }

    /// The two rows of J·R, which takes small displacements at `point_cam` from the normalised frame to pixels.
    ///
    /// J = [fx/z, 0, −fx·tx/z; 0, fy/z, −fy·ty/z], tx and ty being the [slopes](Self::slopes).
    #[inline]
    pub(super) fn jacobian(&self, point_cam: [f32; 3]) -> [[f32; 3]; 2] {
        let [row_x, row_y, row_z] = self.rotation;
        let [fx, fy] = self.focal_px;
        let [_, _, z] = point_cam;
        let [slope_x, slope_y] = self.slopes(point_cam);
        let row = |scale: f32, [a0, a1, a2]: [f32; 3], slope: f32| {
            let [z0, z1, z2] = row_z;
            [scale * (a0 - slope * z0), scale * (a1 - slope * z1), scale * (a2 - slope * z2)]
        };
        [row(fx / z, row_x, slope_x), row(fy / z, row_y, slope_y)]
    }
}

#[inline]
pub(super) fn dot([a0, a1, a2]: [f32; 3], [b0, b1, b2]: [f32; 3]) -> f32 {
    a0 * b0 + a1 * b1 + a2 * b2
}

#[inline]
fn clamp(x: f32, min: f32, max: f32) -> f32 {
    let x = if x < min { min } else { x };
    if x > max { max } else { x }
}
