//! Cameras as Python has them: a tuple of numbers.

use pocketsplat_core::{Camera, Rotation};
use pyo3::prelude::*;

use crate::error::{BundleError, raised};

/// Rotation row by row, translation, focal lengths, principal point, width and height.
pub(crate) type CameraTuple = ([f32; 9], [f32; 3], [f32; 2], [f32; 2], u16, u16);

pub(crate) fn tuple_of(camera: &Camera) -> CameraTuple {
    let Camera { rotation, translation, focal_px, principal_px, width_px, height_px } = *camera;
    (rotation.to_array(), translation, focal_px, principal_px, width_px, height_px)
}

pub(crate) fn camera_of(tuple: &CameraTuple) -> PyResult<Camera> {
    let (rotation, translation, focal_px, principal_px, width_px, height_px) = *tuple;
    let rotation = Rotation::new(rotation).map_err(raised)?;
    let camera = Camera { rotation, translation, focal_px, principal_px, width_px, height_px };
    camera.check().map_err(raised)?;
    Ok(camera)
}

/// A camera carried around the scene, as a firmware turns it.
///
/// * `angle`: radians.
#[pyfunction]
pub(crate) fn orbited(camera: CameraTuple, angle: f32) -> PyResult<CameraTuple> {
    let most = Camera::MAX_ANGLE;
    if !(-most..=most).contains(&angle) {
        return Err(BundleError::new_err(format!("angle {angle}; needed: radians, at most {most} in size")));
    }
    Ok(tuple_of(&camera_of(&camera)?.orbited(angle)))
}
