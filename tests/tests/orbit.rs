//! The decoder's orbit is the manifest's.

use std::f64::consts::TAU;

use conformance::frame::to_core;
use conformance::scenes::look_at;
use glam::DVec3;
use pocketsplat_capture::camera::Camera;
use pocketsplat_codec::manifest::cameras_to_measure;

#[test]
fn carrying_a_camera_around_the_scene_takes_the_manifests_circle() {
    let ring: Vec<Camera> = (0..12)
        .map(|i| {
            let (sin, cos) = (TAU * f64::from(i) / 12.0).sin_cos();
            look_at(DVec3::new(2.0 * cos, 2.0 * sin, 0.8), DVec3::ZERO, 1.25, [40, 30])
        })
        .collect();
    let orbit: Vec<_> = cameras_to_measure(&ring)[ring.len()..].iter().map(to_core).collect();
    assert_eq!(orbit.len(), 24, "cameras of the manifest's orbit");
    for (i, expected) in orbit.iter().enumerate() {
        let found = orbit[0].orbited((TAU * i as f64 / 24.0) as f32);
        let [pose, expected_pose] = [found, *expected]
            .map(|camera| camera.rotation.to_array().into_iter().chain(camera.translation).collect::<Vec<_>>());
        for (found, expected) in pose.into_iter().zip(expected_pose) {
            assert!((found - expected).abs() < 1e-5, "camera {i}: {found}, not {expected}");
        }
        assert_eq!(found.focal_px, expected.focal_px, "camera {i} has the same lens");
    }
}
