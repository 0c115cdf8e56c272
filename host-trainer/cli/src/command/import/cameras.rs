//! Cameras of a file, in the frame of the splats.

use std::path::Path;

use anyhow::{Context, Result};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{FrameCamera, FrameSize, cameras_of_transforms};

use super::super::render;

/// Reads a `transforms.json`, or what `render --camera` reads, scaled and cut to `size`, or to a longest side of at most `longest_px`.
///
/// A file that says no size has square pictures of `longest_px`.
pub(super) fn of_file(path: &Path, size: Option<FrameSize>, longest_px: u32) -> Result<Vec<Camera>> {
    let text = std::fs::read_to_string(path).with_context(|| format!("could not read {}", path.display()))?;
    let json: serde_json::Value =
        serde_json::from_str(&text).with_context(|| format!("{} is no JSON", path.display()))?;
    let cameras = if json.get("frames").is_some() {
        let named = |(name, camera): FrameCamera| camera.with_context(|| format!("frame {name} of {}", path.display()));
        cameras_of_transforms(path, longest_px)?.into_iter().map(named).collect::<Result<Vec<_>>>()?
    } else {
        render::cameras_of_file(path)?
    };
    Ok(cameras.iter().map(|camera| resized(camera, size, longest_px)).collect())
}

/// The same view in another size: scaled until it covers `size` and cut around its middle, or its longest side to `longest_px`.
fn resized(camera: &Camera, size: Option<FrameSize>, longest_px: u32) -> Camera {
    let own = [camera.width_px, camera.height_px].map(f64::from);
    let (scale, [width_px, height_px]) = match size.map(|frame| [frame.width_px, frame.height_px]) {
        Some(size) => ((f64::from(size[0]) / own[0]).max(f64::from(size[1]) / own[1]), size),
        None => {
            let scale = (f64::from(longest_px) / own[0].max(own[1])).min(1.0);
            (scale, own.map(|side| ((side * scale).round() as u32).max(1)))
        }
    };
    let middle = |axis: usize, side: u32| 0.5 * f64::from(side) + (camera.principal_px[axis] - 0.5 * own[axis]) * scale;
    Camera {
        focal_px: camera.focal_px.map(|focal| focal * scale),
        principal_px: [middle(0, width_px), middle(1, height_px)],
        width_px,
        height_px,
        ..camera.clone()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn read(text: &str, size: Option<&str>) -> Result<Vec<Camera>> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("transforms.json");
        std::fs::write(&path, text).expect("written");
        of_file(&path, size.map(|size| size.parse().expect("a size")), 200)
    }

    const FILE: &str = r#"{"camera_angle_x": 1.5707963267948966, "frames": [{"file_path": "a.png",
        "transform_matrix": [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]}]}"#;

    #[test]
    fn a_camera_of_opengl_axes_looks_along_minus_z() {
        let camera = &read(FILE, None).unwrap()[0];
        assert_eq!((camera.width_px, camera.height_px), (200, 200));
        assert!((camera.focal_px[0] - 100.0).abs() < 1e-9 && camera.centre_world() == DVec3::new(1.0, 2.0, 3.0));
        // Ahead, one to the right and one up.
        let seen = camera.rotation * DVec3::new(2.0, 3.0, 1.0) + camera.translation;
        assert_eq!(seen, DVec3::new(1.0, -1.0, 2.0));
    }

    #[test]
    fn pictures_are_scaled_and_cut() {
        let sized = FILE.replace("\"frames\"", "\"w\": 800, \"h\": 400, \"frames\"");
        let camera = &read(&sized, None).unwrap()[0];
        assert_eq!((camera.width_px, camera.height_px, camera.principal_px), (200, 100, [100.0, 50.0]));
        assert!((camera.focal_px[0] - 100.0).abs() < 1e-9);
        let camera = &read(&sized, Some("160x120")).unwrap()[0];
        assert_eq!((camera.width_px, camera.height_px, camera.principal_px), (160, 120, [80.0, 60.0]));
        assert!((camera.focal_px[1] - 120.0).abs() < 1e-9, "120 of 400 rows");
    }

    #[test]
    fn what_is_wrong_with_a_file_is_named() {
        let said = |text: &str| format!("{:#}", read(text, None).unwrap_err());
        for (text, expected) in [
            ("{", "is no JSON"),
            ("{}", "is no list of cameras"),
            (&FILE.replace("camera_angle_x", "angle"), "neither `fl_x` nor `camera_angle_x`"),
            (&FILE.replace("[1, 0, 0, 1]", "[1, 0, 0.5, 1]"), "no rotation"),
            (&FILE.replace("1.57", "-1.57"), "-1.57"),
            (&FILE.replace("transform_matrix", "matrix"), "transform_matrix"),
        ] {
            assert!(said(text).contains(expected), "{text}: {}", said(text));
        }
    }
}
