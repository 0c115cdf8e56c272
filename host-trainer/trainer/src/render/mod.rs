//! Whole images from a scene, at leisure.
//!
//! [`decoder`] draws what a device draws. [`mod@reference`] is the oracle: f64, slow, plain, and sharing no line with the
//! renderers that it judges.

pub mod decoder;
pub mod reference;

use glam::{DMat3, DVec3};

use pocketsplat_capture::camera::Camera;

/// The host's camera of a decoder's, number for number: [`decoder::core_camera`] takes it back unchanged.
pub fn host_camera(camera: &pocketsplat_core::Camera) -> Camera {
    Camera {
        // glam stores columns.
        rotation: DMat3::from_cols_array(&camera.rotation.map(f64::from)).transpose(),
        translation: DVec3::from(camera.translation.map(f64::from)),
        focal_px: camera.focal_px.map(f64::from),
        principal_px: camera.principal_px.map(f64::from),
        width_px: camera.width_px.into(),
        height_px: camera.height_px.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::{decoder, host_camera};

    #[test]
    fn a_decoders_camera_survives_the_way_to_the_host_and_back() {
        let camera = pocketsplat_core::Camera {
            rotation: [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9],
            translation: [1.1, -2.2, 3.3],
            focal_px: [100.1, 99.9],
            principal_px: [40.3, 29.7],
            width_px: 80,
            height_px: 60,
        };
        assert_eq!(decoder::core_camera(&host_camera(&camera)), Ok(camera), "f32 → f64 → f32 loses nothing");
    }
}
