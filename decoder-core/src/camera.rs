//! The pinhole camera of a frame.

use crate::{DecodeError, error::Field};

/// A pinhole camera in the normalised frame of a bundle: x right, y down, z forward (OpenCV).
///
/// `(x, y, z) = R·p + t`, `u = fx·x/z + cx`, `v = fy·y/z + cy`; the centre of pixel `(i, j)` is `(i + 0.5, j + 0.5)`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Camera {
    /// World to camera rotation, row-major.
    pub rotation: [f32; 9],
    /// World to camera translation, normalised units.
    pub translation: [f32; 3],
    /// Focal lengths `[fx, fy]`, pixels.
    pub focal_px: [f32; 2],
    /// Principal point `[cx, cy]`, pixels from the outer corner of the first pixel.
    pub principal_px: [f32; 2],
    /// Frame width, pixels.
    pub width_px: u16,
    /// Frame height, pixels.
    pub height_px: u16,
}

impl Camera {
    /// The same camera with its frame scaled to `width_px × height_px`.
    ///
    /// ```
    /// # use pocketsplat_core::Camera;
    /// let camera = Camera {
    ///     rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
    ///     translation: [0.0; 3],
    ///     focal_px: [100.0, 100.0],
    ///     principal_px: [40.0, 30.0],
    ///     width_px: 80,
    ///     height_px: 60,
    /// };
    /// assert_eq!(camera.resized(160, 120).focal_px, [200.0, 200.0]);
    /// ```
    #[must_use]
    pub fn resized(&self, width_px: u16, height_px: u16) -> Self {
        let x_scale = f32::from(width_px) / f32::from(self.width_px);
        let y_scale = f32::from(height_px) / f32::from(self.height_px);
        let [fx, fy] = self.focal_px;
        let [cx, cy] = self.principal_px;
        Self {
            focal_px: [fx * x_scale, fy * y_scale],
            principal_px: [cx * x_scale, cy * y_scale],
            width_px,
            height_px,
            ..*self
        }
    }

    /// Where the camera stands, normalised frame: −Rᵀ·t.
    #[must_use]
    pub fn centre(&self) -> [f32; 3] {
        let [r00, r01, r02, r10, r11, r12, r20, r21, r22] = self.rotation;
        let [x, y, z] = self.translation;
        [-(r00 * x + r10 * y + r20 * z), -(r01 * x + r11 * y + r21 * z), -(r02 * x + r12 * y + r22 * z)]
    }

    /// Checks that every float is finite, the focal lengths positive and the frame not empty.
    ///
    /// # Errors
    /// [`DecodeError::BadFloat`] or [`DecodeError::OutOfRange`] naming the field.
    pub fn check(&self) -> Result<(), DecodeError> {
        let pose = self.rotation.iter().chain(&self.translation);
        check_floats(Field::CameraPose, pose, |x| x.is_finite())?;
        check_floats(Field::CameraFocal, self.focal_px.iter(), |x| x.is_finite() && x > 0.0)?;
        check_floats(Field::CameraPrincipal, self.principal_px.iter(), |x| x.is_finite())?;
        for (field, size_px) in [(Field::FrameWidth, self.width_px), (Field::FrameHeight, self.height_px)] {
            if size_px == 0 {
                return Err(DecodeError::OutOfRange { field, found: 0, limit: 1 });
            }
        }
        Ok(())
    }
}

/// Names the first float that is not `good`.
fn check_floats<'f>(
    field: Field,
    floats: impl Iterator<Item = &'f f32>,
    good: impl Fn(f32) -> bool,
) -> Result<(), DecodeError> {
    for (index, &x) in (0..).zip(floats) {
        if !good(x) {
            return Err(DecodeError::BadFloat { field, index });
        }
    }
    Ok(())
}
