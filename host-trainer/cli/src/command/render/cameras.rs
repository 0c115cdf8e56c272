//! The cameras of a file, and those of an orbit.

use std::f32::consts::TAU;
use std::path::Path;

use anyhow::{Context, Result, bail};
use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::FrameSize;
use pocketsplat_format::Bundle;
use pocketsplat_kernels::camera::{core_camera, host_camera};
use serde::{Deserialize, Serialize};

use super::super::fit::frame_budget;

/// Cameras of a file at most: each is a frame.
const MOST_CAMERAS: usize = 10_000;

/// A camera and what its picture is called.
pub(super) struct Shot {
    pub(super) name: String,
    pub(super) camera: Camera,
}

/// A camera as a file has it: OpenCV axes (x right, y down, z forward), a point of the scene is at R·p + t in its frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CameraRecord {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    width_px: u32,
    height_px: u32,
    focal_px: [f64; 2],
    principal_px: [f64; 2],
    /// R, row by row.
    rotation: [[f64; 3]; 3],
    /// t, units of the scene.
    translation: [f64; 3],
}

/// What `--camera` reads.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraFile {
    cameras: Vec<CameraRecord>,
}

impl CameraRecord {
    pub(crate) fn of(camera: &Camera) -> Self {
        // glam stores columns.
        let rows = camera.rotation.transpose().to_cols_array_2d();
        Self {
            name: None,
            width_px: camera.width_px,
            height_px: camera.height_px,
            focal_px: camera.focal_px,
            principal_px: camera.principal_px,
            rotation: rows,
            translation: camera.translation.to_array(),
        }
    }

    fn camera(&self) -> Camera {
        Camera {
            rotation: DMat3::from_cols_array_2d(&self.rotation).transpose(),
            translation: DVec3::from(self.translation),
            focal_px: self.focal_px,
            principal_px: self.principal_px,
            width_px: self.width_px,
            height_px: self.height_px,
        }
    }
}

/// Reads `{"cameras": […]}`.
pub(super) fn of_file(path: &Path) -> Result<Vec<Shot>> {
    let text = std::fs::read_to_string(path).with_context(|| format!("could not read {}", path.display()))?;
    let file: CameraFile = serde_json::from_str(&text).with_context(|| {
        format!(
            "{} is no list of cameras; `pocketsplat inspect SCENE.psb --json` prints one as `preview`",
            path.display()
        )
    })?;
    match file.cameras.len() {
        0 => bail!("{} has no camera", path.display()),
        n if n > MOST_CAMERAS => bail!("{} has {n} cameras; at most {MOST_CAMERAS} are drawn", path.display()),
        _ => {}
    }
    let shot = |(i, record): (usize, CameraRecord)| {
        let camera = record.camera();
        core_camera(&camera).with_context(|| format!("could not use camera {i} of {}", path.display()))?;
        Ok(Shot { name: record.name.unwrap_or_else(|| format!("camera {i}")), camera })
    };
    file.cameras.into_iter().enumerate().map(shot).collect()
}

/// The bundle's own camera, at its own size or scaled to a display's as a firmware scales it.
pub(super) fn preview(bundle: &Bundle<'_>, size: Option<FrameSize>) -> Result<Shot> {
    Ok(Shot { name: "preview".to_owned(), camera: host_camera(&sized_preview(bundle, size)?) })
}

/// `n` cameras around what the bundle's own one looks at, as a firmware turns them.
pub(super) fn orbit(bundle: &Bundle<'_>, size: Option<FrameSize>, n: u16) -> Result<Vec<Shot>> {
    let preview = sized_preview(bundle, size)?;
    let shot = |i: u16| {
        let camera = host_camera(&preview.orbited(TAU * f32::from(i) / f32::from(n)));
        Shot { name: format!("orbit {i}"), camera }
    };
    Ok((0..n).map(shot).collect())
}

fn sized_preview(bundle: &Bundle<'_>, size: Option<FrameSize>) -> Result<pocketsplat_core::Camera> {
    let preview = bundle.header().preview;
    let Some(_) = size else { return Ok(preview) };
    let frame = frame_budget(bundle, size)?;
    Ok(preview.resized(frame.width_px, frame.height_px))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = r#"{"cameras": [{"name": "left", "width_px": 8, "height_px": 6, "focal_px": [7.0, 7.5],
        "principal_px": [4.0, 3.0], "rotation": [[0, 0, 1], [1, 0, 0], [0, 1, 0]], "translation": [1, 2, 3]}]}"#;

    fn read(text: &str) -> Result<Vec<Shot>> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("cameras.json");
        std::fs::write(&path, text).expect("written");
        of_file(&path)
    }

    #[test]
    fn a_camera_survives_the_way_to_a_file_and_back() {
        let shots = read(FILE).expect("a list of cameras");
        assert_eq!((shots.len(), shots[0].name.as_str()), (1, "left"));
        let camera = &shots[0].camera;
        // The first row of R is (0, 0, 1): what lies along z is to the right.
        assert_eq!(camera.rotation * DVec3::Z + camera.translation, DVec3::new(2.0, 2.0, 3.0));
        assert_eq!(CameraRecord::of(camera).camera(), *camera);
    }

    #[test]
    fn what_is_wrong_with_a_file_is_named() {
        let said = |text: &str| format!("{:#}", read(text).err().expect("an error"));
        for (text, expected) in [
            (r#"{"cameras": []}"#, "has no camera"),
            ("[]", "is no list of cameras"),
            (&FILE.replace("[0, 0, 1]", "[0, 0, 2]"), "camera 0 of"),
            (&FILE.replace("7.5", "0.0"), "camera 0 of"),
            (&FILE.replace("\"width_px\": 8", "\"width_px\": 70000"), "camera 0 of"),
            (&FILE.replace("width_px", "width"), "unknown field `width`"),
        ] {
            assert!(said(text).contains(expected), "{text}: {}", said(text));
        }
    }
}
