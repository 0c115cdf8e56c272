//! Cameras between the host's double precision and the decoder's single precision.

use glam::{DMat3, DVec3};
use pocketsplat_format::{DecodeError, Field, Rotation};

use pocketsplat_capture::camera::Camera;

/// The host's camera of a decoder's, number for number: [`core_camera`] takes it back unchanged.
pub fn host_camera(camera: &pocketsplat_format::Camera) -> Camera {
    Camera {
        // glam stores columns.
        rotation: DMat3::from_cols_array(&camera.rotation.to_array().map(f64::from)).transpose(),
        translation: DVec3::from(camera.translation.map(f64::from)),
        focal_px: camera.focal_px.map(f64::from),
        principal_px: camera.principal_px.map(f64::from),
        width_px: camera.width_px.into(),
        height_px: camera.height_px.into(),
    }
}

/// Rounds a camera to the decoder's single precision.
///
/// # Errors
/// [`DecodeError::OutOfRange`] when the image is larger than the decoder draws, and what [`Rotation::new`] and
/// [`pocketsplat_format::Camera::check`] find.
pub fn core_camera(camera: &Camera) -> Result<pocketsplat_format::Camera, DecodeError> {
    let size = |field, px: u32| {
        u16::try_from(px).map_err(|_| DecodeError::OutOfRange { field, found: px, limit: u16::MAX.into() })
    };
    let core = pocketsplat_format::Camera {
        // glam stores columns.
        rotation: Rotation::new(camera.rotation.transpose().to_cols_array().map(|x| x as f32))?,
        translation: camera.translation.to_array().map(|x| x as f32),
        focal_px: camera.focal_px.map(|x| x as f32),
        principal_px: camera.principal_px.map(|x| x as f32),
        width_px: size(Field::FrameWidth, camera.width_px)?,
        height_px: size(Field::FrameHeight, camera.height_px)?,
    };
    core.check()?;
    Ok(core)
}

#[cfg(test)]
mod tests {
    use pocketsplat_format::Rotation;

    use super::{core_camera, host_camera};

    #[test]
    fn a_decoders_camera_survives_the_way_to_the_host_and_back() {
        let camera = pocketsplat_format::Camera {
            rotation: Rotation::new([0.6, 0.0, 0.8, 0.48, 0.8, -0.36, -0.64, 0.6, 0.48]).expect("a rotation"),
            translation: [1.1, -2.2, 3.3],
            focal_px: [100.1, 99.9],
            principal_px: [40.3, 29.7],
            width_px: 80,
            height_px: 60,
        };
        assert_eq!(core_camera(&host_camera(&camera)), Ok(camera), "f32 → f64 → f32 loses nothing");
    }
}
