//! Cameras of a file, in the frame of the splats.

use std::path::Path;

use anyhow::{Context, Result, bail};
use glam::{DMat3, DMat4, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::FrameSize;
use serde::Deserialize;

use super::super::render;

/// What is read of a transforms.json (Blender, instant-ngp, nerfstudio): angles in radians, lengths in pixels.
#[derive(Deserialize)]
struct Transforms {
    #[serde(flatten)]
    lens: Lens,
    frames: Vec<Frame>,
}

#[derive(Clone, Copy, Deserialize)]
struct Lens {
    camera_angle_x: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
}

#[derive(Deserialize)]
struct Frame {
    /// Camera to world, rows; OpenGL axes: x right, y up, z backward.
    transform_matrix: [[f64; 4]; 4],
    #[serde(flatten)]
    lens: Lens,
}

/// Reads a `transforms.json`, or what `render --camera` reads, scaled and cut to `size`, or to a longest side of at most `longest_px`.
///
/// A file that says no size has square pictures of `longest_px`.
pub(super) fn of_file(path: &Path, size: Option<FrameSize>, longest_px: u32) -> Result<Vec<Camera>> {
    let text = std::fs::read_to_string(path).with_context(|| format!("could not read {}", path.display()))?;
    let json: serde_json::Value =
        serde_json::from_str(&text).with_context(|| format!("{} is no JSON", path.display()))?;
    let cameras = if json.get("frames").is_some() {
        let read: Transforms = serde_json::from_value(json).with_context(|| {
            format!("{} is no transforms.json: needs frames with a transform_matrix of 4 × 4 each", path.display())
        })?;
        let camera = |(i, frame): (usize, &Frame)| {
            camera(&read.lens, frame, longest_px).with_context(|| format!("frame {i} of {}", path.display()))
        };
        read.frames.iter().enumerate().map(camera).collect::<Result<Vec<_>>>()?
    } else {
        render::cameras_of_file(path)?
    };
    Ok(cameras.iter().map(|camera| resized(camera, size, longest_px)).collect())
}

fn camera(shared: &Lens, frame: &Frame, longest_px: u32) -> Result<Camera> {
    let own = |value: fn(&Lens) -> Option<f64>| value(&frame.lens).or(value(shared));
    let width = own(|lens| lens.w).unwrap_or(longest_px.into());
    let height = own(|lens| lens.h).unwrap_or(width);
    let by_angle = own(|lens| lens.camera_angle_x).map(|angle| 0.5 * width / (0.5 * angle).tan());
    let Some(fx) = own(|lens| lens.fl_x).or(by_angle) else { bail!("it has neither fl_x nor camera_angle_x") };
    let fy = own(|lens| lens.fl_y).unwrap_or(fx);
    if !(fx > 0.0 && fy > 0.0 && fx.is_finite() && fy.is_finite()) {
        bail!("its focal lengths are {fx} and {fy} px, needs numbers above 0");
    }
    if !(1.0..=65535.0).contains(&width) || !(1.0..=65535.0).contains(&height) {
        bail!("its size is {width} by {height} px, needs 1 to 65535");
    }
    let to_world = DMat4::from_cols_array_2d(&frame.transform_matrix).transpose();
    let axes = DMat3::from_mat4(to_world);
    let scale = axes.determinant().cbrt();
    let orthogonal = axes * axes.transpose() * (1.0 / (scale * scale));
    let is_rotation = orthogonal.abs_diff_eq(DMat3::IDENTITY, 1e-3);
    if !(is_rotation && scale > 0.0) {
        bail!("its transform_matrix is no rotation with a place");
    }
    let rotation = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)) * (axes * (1.0 / scale)).transpose();
    Ok(Camera {
        rotation,
        translation: -(rotation * to_world.w_axis.truncate()),
        focal_px: [fx, fy],
        principal_px: [own(|lens| lens.cx).unwrap_or(0.5 * width), own(|lens| lens.cy).unwrap_or(0.5 * height)],
        width_px: width.round() as u32,
        height_px: height.round() as u32,
    })
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
            (&FILE.replace("camera_angle_x", "angle"), "neither fl_x nor camera_angle_x"),
            (&FILE.replace("[1, 0, 0, 1]", "[1, 0, 0.5, 1]"), "no rotation"),
            (&FILE.replace("1.57", "-1.57"), "above 0"),
            (&FILE.replace("transform_matrix", "matrix"), "transform_matrix"),
        ] {
            assert!(said(text).contains(expected), "{text}: {}", said(text));
        }
    }
}
