//! Exports of RealityCapture: a table of "Internal/External camera parameters", `.csv`, beside a folder of images.
//!
//! The first line names the columns: `#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2`. Angles are in degrees: the camera,
//! which looks down with its top to the north, is turned by −heading about the vertical, by pitch about x and by roll about y. `f` and
//! the principal point's distance from the middle are for a film of 36 mm along the image's longer side; distortion is Brown's.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};

use super::image::read_header;
use super::listing::{Listing, every_nth, files_with};
use super::named_path::NamedPath;
use super::transforms::{Frame, Intrinsics, list_frames};
use super::{DatasetError, Layout, LoadOptions, image_folder, text_file};
use crate::dataset::folder_names::FolderNames;

/// The columns that a pose and a lens need.
const NEEDED: [&str; 8] = ["name", "x", "y", "alt", "heading", "pitch", "roll", "f"];
/// Width of the film that `f` is for, millimetres.
const FILM_MM: f64 = 36.0;

/// The table in the folder: the first by name whose head has the columns.
pub(super) fn table(folder: &Path) -> Option<PathBuf> {
    let is_one = |text: String| columns(&text).is_some();
    files_with(folder, "csv").into_iter().find(|path| text_file::read(path).is_ok_and(is_one))
}

/// The line of the head, counted from 0, and the places of its columns.
fn columns(text: &str) -> Option<(usize, HashMap<String, usize>)> {
    text.lines().enumerate().take(3).find_map(|(i, line)| {
        let names = line.trim_start_matches(['#', ' ']).split(',').map(|name| name.trim().to_lowercase());
        let places: HashMap<String, usize> = names.zip(0..).collect();
        NEEDED.iter().all(|name| places.contains_key(*name)).then_some((i, places))
    })
}

/// Lists the capture in `folder`, views by name.
///
/// # Errors
/// As [`super::load`], as far as files but no pixels tell.
pub(super) fn list(folder: &Path, options: &LoadOptions) -> Result<Listing, DatasetError> {
    let Some(path) = table(folder) else { return Err(DatasetError::NotAFolder { path: folder.to_owned() }) };
    let text = text_file::read(&path)?;
    let (head, columns) = columns(&text).unwrap_or_default();
    let mut notes = Vec::new();
    let images = image_folder::needed(folder, options, &mut notes)?;
    let names = FolderNames::default();
    let lines =
        text.lines().enumerate().skip(head + 1).filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let frame = |(i, line): (usize, &str)| {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let cell = |name: &str| columns.get(name).and_then(|&at| cells.get(at)).copied();
        let number = |name: &str| cell(name).and_then(|cell| cell.parse::<f64>().ok());
        let needed = |name: &str| {
            let found = || format!("`{}` is no number for `{name}`", cell(name).unwrap_or_default());
            number(name).ok_or_else(|| DatasetError::of_model(&path, format!("line {}", i + 1), found()))
        };
        let name = cell("name").unwrap_or_default();
        let centre = DVec3::new(needed("x")?, needed("y")?, needed("alt")?);
        let [heading, pitch, roll] = [needed("heading")?, needed("pitch")?, needed("roll")?].map(f64::to_radians);
        let rotation = DMat3::from_rotation_z(-heading) * DMat3::from_rotation_x(pitch) * DMat3::from_rotation_y(roll);
        // The film's side is the image's longer one; without the image the view is left out anyway.
        let size_px = NamedPath::new(name).image(&names, &images, None).and_then(|path| read_header(&path).ok());
        let [w, h] = size_px.map_or([1, 1], |header| [header.size_px.0, header.size_px.1]).map(f64::from);
        let px = |mm: f64| mm / FILM_MM * w.max(h);
        let own = Intrinsics {
            fl_x: Some(px(needed("f")?)),
            cx: number("px").map(|mm| 0.5 * w + px(mm)),
            cy: number("py").map(|mm| 0.5 * h + px(mm)),
            w: Some(w),
            h: Some(h),
            k1: number("k1"),
            k2: number("k2"),
            k3: number("k3"),
            k4: number("k4"),
            p1: number("t1"),
            p2: number("t2"),
            ..Intrinsics::default()
        };
        Ok(Frame::of_pose(name.to_owned(), rotation, centre, own))
    };
    let mut frames = lines.map(frame).collect::<Result<Vec<Frame>, DatasetError>>()?;
    frames.sort_by(|a, b| a.name().cmp(b.name()));
    let split = |i| Some(every_nth(options.test_every, i));
    Ok(list_frames(Layout::RealityCapture, path, &images, &frames, None, notes, split))
}
