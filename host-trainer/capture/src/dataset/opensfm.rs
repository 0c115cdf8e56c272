//! Models of OpenSfM and OpenDroneMap: `reconstruction.json`, or the same in `opensfm`, beside a folder of images.
//!
//! A list of reconstructions, of which the one of the most shots is read. A shot has an axis times an angle and a translation, world to
//! camera in OpenCV's axes; focal lengths and principal points are in the image's longer side, from its middle (OpenSfM's
//! documentation, "Dataset structure" and "Camera coordinate system").

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use serde::Deserialize;

use super::image_folder;
use super::listing::{Listing, Note, every_nth};
use super::points::{Points, rgb8};
use super::transforms::{Frame, Intrinsics, list_frames};
use super::{DatasetError, Layout, LoadOptions, non_finite};

const FILES: [&str; 2] = ["reconstruction.json", "opensfm/reconstruction.json"];

#[derive(Deserialize)]
struct Reconstruction {
    cameras: BTreeMap<String, Camera>,
    shots: BTreeMap<String, Shot>,
    #[serde(default)]
    points: BTreeMap<String, Point>,
}

#[derive(Deserialize)]
struct Camera {
    #[serde(default)]
    projection_type: String,
    width: f64,
    height: f64,
    focal: Option<f64>,
    focal_x: Option<f64>,
    focal_y: Option<f64>,
    c_x: Option<f64>,
    c_y: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    /// Of `fisheye_opencv`.
    k4: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
}

#[derive(Deserialize)]
struct Shot {
    camera: String,
    rotation: [Option<f64>; 3],
    translation: [Option<f64>; 3],
}

#[derive(Deserialize)]
struct Point {
    coordinates: [f64; 3],
    color: Option<Vec<f64>>,
}

pub(super) fn file(folder: &Path) -> Option<PathBuf> {
    FILES.iter().map(|name| folder.join(name)).find(|path| path.is_file())
}

/// Lists the capture in `folder`, views by name.
///
/// # Errors
/// As [`super::load`], as far as files but no pixels tell.
pub(super) fn list(folder: &Path, options: &LoadOptions) -> Result<Listing, DatasetError> {
    let Some(path) = file(folder) else { return Err(DatasetError::NotAFolder { path: folder.to_owned() }) };
    let needs = "a list of reconstructions with `cameras` and `shots`";
    let reconstructions: Vec<Reconstruction> = non_finite::read_export(&path, "a reconstruction of OpenSfM", needs)?;
    let mut notes = Vec::new();
    if reconstructions.len() > 1 {
        let counts: Vec<String> = reconstructions.iter().map(|one| one.shots.len().to_string()).collect();
        let text = format!(
            "the capture has {} reconstructions, which share no frame, of {} shots; the largest is read",
            reconstructions.len(),
            counts.join(", ")
        );
        notes.push(Note::new("several-models", text));
    }
    let Some(largest) = reconstructions.into_iter().max_by_key(|one| one.shots.len()) else {
        return Err(DatasetError::of_model(
            &path,
            "list".to_owned(),
            "no reconstruction, needed: one at least".to_owned(),
        ));
    };
    let images =
        image_folder::choose(folder, options, &mut notes)?.map_or_else(|| folder.to_owned(), |name| folder.join(name));
    // By name, as a map is.
    let frames: Vec<Frame> = largest.shots.iter().map(|(name, shot)| frame(name, shot, &largest.cameras)).collect();
    let point = |point: &Point| (DVec3::from_array(point.coordinates), point.color.as_deref().and_then(rgb8));
    let points: Points = largest.points.values().map(point).collect();
    let points = Some((path.clone(), points)).filter(|(_, points)| !points.is_empty());
    let split = |i| Some(every_nth(options.test_every, i));
    Ok(list_frames(Layout::OpenSfm, path, &images, &frames, points, notes, split))
}

fn frame(name: &str, shot: &Shot, cameras: &BTreeMap<String, Camera>) -> Frame {
    let [axis, translation] =
        [shot.rotation, shot.translation].map(|v| DVec3::from_array(v.map(|number| number.unwrap_or(f64::NAN))));
    // A rotation by nothing has no axis; one that is no number stays none.
    let rotation = match axis.length() {
        0.0 => DMat3::IDENTITY,
        angle => DMat3::from_axis_angle(axis / angle, angle),
    };
    let (to_world, centre) = (rotation.transpose(), -(rotation.transpose() * translation));
    // From OpenCV's axes to OpenGL's: y and z turn.
    let opengl = to_world * DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let lens = cameras.get(&shot.camera).map(Camera::intrinsics).unwrap_or_default();
    Frame::of_pose(name.to_owned(), opengl, centre, lens)
}

impl Camera {
    fn intrinsics(&self) -> Intrinsics {
        let (w, h) = (self.width, self.height);
        let px = |share: f64| share * w.max(h);
        let camera_model = match self.projection_type.as_str() {
            "" | "perspective" | "brown" | "radial" | "simple_radial" => None,
            "fisheye" | "fisheye_opencv" => Some("OPENCV_FISHEYE".to_owned()),
            other => Some(format!("{other} of OpenSfM")),
        };
        Intrinsics {
            fl_x: self.focal_x.or(self.focal).map(px),
            fl_y: self.focal_y.or(self.focal).map(px),
            cx: Some(0.5 * w + px(self.c_x.unwrap_or(0.0))),
            cy: Some(0.5 * h + px(self.c_y.unwrap_or(0.0))),
            w: Some(w),
            h: Some(h),
            k1: self.k1,
            k2: self.k2,
            k3: self.k3,
            k4: self.k4,
            p1: self.p1,
            p2: self.p2,
            camera_model,
            ..Intrinsics::default()
        }
    }
}
