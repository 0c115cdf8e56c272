//! Exports of Agisoft Metashape: `cameras.xml` ("Export Cameras", XML) beside a folder of images.
//!
//! A camera's `transform` are the 16 numbers of a camera-to-world matrix by rows, in OpenCV's axes. A sensor of the type `frame` has
//! Brown's lens: `f`, the principal point's distance from the middle, `b1` that is added to the focal length along x, and the
//! coefficients, of which Metashape's `p1` is OpenCV's p2 (Metashape's manual, appendix "Camera models").

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use pocketsplat_files::{shell_word, shown};
use roxmltree::{Document, Node};

use super::lens::MAX_SKEW_PX;
use super::listing::{Listing, Note, every_nth, files_with};
use super::transforms::{Frame, Intrinsics, list_frames};
use super::{DatasetError, Layout, LoadOptions, image_folder, text_file};

/// The file of cameras in the folder: the first by name that is one.
pub(super) fn file(folder: &Path) -> Option<PathBuf> {
    let is_one = |text: String| text.contains("<document") && text.contains("<chunk");
    files_with(folder, "xml").into_iter().find(|path| text_file::read(path).is_ok_and(is_one))
}

/// Lists the capture in `folder`, views by name.
///
/// # Errors
/// As [`super::load`], as far as files but no pixels tell.
pub(super) fn list(folder: &Path, options: &LoadOptions) -> Result<Listing, DatasetError> {
    let Some(path) = file(folder) else { return Err(DatasetError::NotAFolder { path: folder.to_owned() }) };
    let text = text_file::read(&path)?;
    let document = Document::parse(&text).map_err(|error| {
        DatasetError::of_model(&path, format!("line {}", error.pos().row), format!("no XML: {error}"))
    })?;
    let elements = |name: &'static str| document.descendants().filter(move |node| node.has_tag_name(name));
    let mut notes = Vec::new();
    let lenses: HashMap<&str, Intrinsics> =
        elements("sensor").filter_map(|sensor| Some((sensor.attribute("id")?, lens(sensor, &mut notes)))).collect();
    let mut frames: Vec<Frame> = elements("camera").filter_map(|camera| frame(camera, &lenses)).collect();
    if frames.is_empty() {
        return Err(DatasetError::NoCapture { found: without_poses(folder, &path, elements("camera").count()) });
    }
    frames.sort_by(|a, b| a.name().cmp(b.name()));
    let images = image_folder::needed(folder, options, &mut notes)?;
    let split = |i| Some(every_nth(options.test_every, i));
    Ok(list_frames(Layout::Metashape, path, &images, &frames, None, notes, split))
}

/// What to tell where no camera has a pose.
fn without_poses(folder: &Path, path: &Path, n_cameras: usize) -> String {
    format!(
        "`{}` is a file of cameras of Metashape, but none of its {n_cameras} cameras has a pose; align the photographs in Metashape \
         (Workflow > Align Photos) and export again with File > Export > Export Cameras, as Agisoft XML over this file or as COLMAP, \
         or convert a whole export with nerfstudio:\n  ns-process-data metashape --data {} --xml {} --output-dir {}",
        shown(path),
        shell_word(&folder.join("images")),
        shell_word(path),
        shell_word(&folder.join("nerfstudio"))
    )
}

/// The number in the element `name` below another.
fn number(parent: Node<'_, '_>, name: &str) -> Option<f64> {
    parent.children().find(|node| node.has_tag_name(name))?.text()?.trim().parse().ok()
}

/// The lens of a sensor; one of another type than `frame` gets a camera model that is refused by its name.
fn lens(sensor: Node<'_, '_>, notes: &mut Vec<Note>) -> Intrinsics {
    let kind = sensor.attribute("type").unwrap_or("frame");
    if kind != "frame" {
        return Intrinsics { camera_model: Some(format!("{kind} of Metashape")), ..Intrinsics::default() };
    }
    let calibrations = || sensor.children().filter(|node| node.has_tag_name("calibration"));
    let adjusted = calibrations().find(|node| node.attribute("class") == Some("adjusted"));
    let Some(calibration) = adjusted.or_else(|| calibrations().next()) else { return Intrinsics::default() };
    let resolution = sensor.children().chain(calibration.children()).find(|node| node.has_tag_name("resolution"));
    let side = |name: &str| resolution.and_then(|node| node.attribute(name)).and_then(|side| side.parse::<f64>().ok());
    let (w, h) = (side("width"), side("height"));
    let number = |name: &str| number(calibration, name);
    // Before version 1.3 the axes had focal lengths of their own.
    let f = number("f").or_else(|| number("fy"));
    let middle = |side: Option<f64>, off: Option<f64>| side.map(|side| 0.5 * side + off.unwrap_or(0.0));
    if let Some(skew_px) = number("b2").zip(f).zip(h).map(|((b2, f), h)| 0.5 * h * b2 / f)
        && skew_px.abs() > MAX_SKEW_PX
    {
        let text = format!(
            "a sensor's skew b2 moves pixels at the border by {skew_px:.1} px and is left out; optimise cameras without b2 in Metashape"
        );
        notes.push(Note::warning("skew", text));
    }
    Intrinsics {
        fl_x: number("fx").or_else(|| Some(f? + number("b1").unwrap_or(0.0))),
        fl_y: f,
        cx: middle(w, number("cx")),
        cy: middle(h, number("cy")),
        w,
        h,
        k1: number("k1"),
        k2: number("k2"),
        k3: number("k3"),
        k4: number("k4"),
        p1: number("p2"),
        p2: number("p1"),
        ..Intrinsics::default()
    }
}

/// The frame of a camera that was aligned and is in use.
fn frame(camera: Node<'_, '_>, lenses: &HashMap<&str, Intrinsics>) -> Option<Frame> {
    if matches!(camera.attribute("enabled"), Some("0" | "false")) {
        return None;
    }
    let transform = camera.children().find(|node| node.has_tag_name("transform"))?.text()?;
    let numbers: Vec<f64> = transform.split_whitespace().map(|word| word.parse().unwrap_or(f64::NAN)).collect();
    let rows = numbers.chunks(4).take(3).map(<[f64]>::to_vec).collect();
    let own = camera.attribute("sensor_id").and_then(|id| lenses.get(id)).cloned().unwrap_or_default();
    Some(Frame::of_opencv(camera.attribute("label")?.to_owned(), rows, own))
}
