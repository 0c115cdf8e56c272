//! Cameras across the border.

use pocketsplat_core::{Bundle, Rotation};

use crate::plan::bytes_of;
use crate::status::{Failure, Message, Status, status_of};

/// A pinhole camera in the frame of a bundle: x right, y down, z forward (OpenCV).
///
/// A point p of the scene is at (x, y, z) = R·p + t for the camera and at u = fx·x/z + cx, v = fy·y/z + cy on its image; the centre of
/// pixel (i, j) is at (i + 0.5, j + 0.5).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Camera {
    /// R, row by row: scene to camera.
    pub rotation: [f32; 9],
    /// t, units of the scene.
    pub translation: [f32; 3],
    /// fx, fy, pixels.
    pub focal_px: [f32; 2],
    /// cx, cy, pixels from the outer corner of the first pixel.
    pub principal_px: [f32; 2],
    /// Frame width, pixels.
    pub width_px: u16,
    /// Frame height, pixels.
    pub height_px: u16,
}

impl Camera {
    pub(crate) fn to_core(self) -> Result<pocketsplat_core::Camera, Failure> {
        let Self { rotation, translation, focal_px, principal_px, width_px, height_px } = self;
        let rotation = Rotation::new(rotation)?;
        let camera = pocketsplat_core::Camera { rotation, translation, focal_px, principal_px, width_px, height_px };
        camera.check()?;
        Ok(camera)
    }
}

impl From<pocketsplat_core::Camera> for Camera {
    fn from(camera: pocketsplat_core::Camera) -> Self {
        let pocketsplat_core::Camera { rotation, translation, focal_px, principal_px, width_px, height_px } = camera;
        Self { rotation: rotation.to_array(), translation, focal_px, principal_px, width_px, height_px }
    }
}

/// The bundle's own camera, with which a device may begin: for frames of width_px by height_px, or of its own size for 0 by 0.
///
/// Other proportions than its own stretch the picture.
///
/// bundle: bundle_len bytes of a .psb, which are checked. message: NULL, or where to say what was wrong.
///
/// # Safety
/// Pointers are NULL or point to what the call says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psb_preview(
    bundle: *const u8,
    bundle_len: usize,
    width_px: u16,
    height_px: u16,
    camera: *mut Camera,
    message: *mut Message,
) -> Status {
    // SAFETY: the caller's promise.
    let (bundle, camera, message) = unsafe { (bytes_of(bundle, bundle_len), camera.as_mut(), message.as_mut()) };
    let outcome = (|| {
        let preview = Bundle::parse(bundle.ok_or(Failure::Misuse("bundle is NULL"))?)?.header().preview;
        let sized = if (width_px, height_px) == (0, 0) { preview } else { preview.resized(width_px, height_px) };
        sized.check()?;
        *camera.ok_or(Failure::Misuse("camera is NULL"))? = sized.into();
        Ok(())
    })();
    status_of(outcome, message)
}

/// Carries a camera by an angle, radians, at most 8192 in size, around the upright axis through what it looks at.
///
/// turned may be camera itself. message: NULL, or where to say what was wrong.
///
/// # Safety
/// Pointers are NULL or point to what the call says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psb_orbit(
    camera: *const Camera,
    angle: f32,
    turned: *mut Camera,
    message: *mut Message,
) -> Status {
    // SAFETY: the caller's promise; the camera is copied before `turned`, which may be the same, is borrowed.
    let (camera, message) = unsafe { (camera.as_ref().copied(), message.as_mut()) };
    // SAFETY: as above.
    let turned = unsafe { turned.as_mut() };
    let outcome = (|| {
        let camera = camera.ok_or(Failure::Misuse("camera is NULL"))?.to_core()?;
        let most = pocketsplat_core::Camera::MAX_ANGLE;
        if !(-most..=most).contains(&angle) {
            return Err(Failure::Misuse("angle is no number from -8192 to 8192"));
        }
        *turned.ok_or(Failure::Misuse("turned is NULL"))? = camera.orbited(angle).into();
        Ok(())
    })();
    status_of(outcome, message)
}
