//! Models of Bundler: `bundle.out` and the list of its images beside them; VisualSFM, MVE and Metashape write it, too.
//!
//! After a comment the counts of cameras and points; of each camera `f k1 k2`, a rotation of 3 rows and a translation, world to camera
//! in OpenGL's axes, all 0 where it has no pose; of each point its place, its colour and where it is seen (Bundler's user manual,
//! "Output format"). The radius r in focal lengths becomes r·(1 + k1·r² + k2·r⁴); the principal point is the middle.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use glam::{DMat3, DVec3};

use super::image_folder;
use super::listing::{Listing, every_nth};
use super::points::{Points, rgb8};
use super::transforms::{Frame, Intrinsics, list_frames};
use super::{DatasetError, Layout, LoadOptions, text_file};

/// The model and the list of its images.
const FILES: [(&str, &str); 4] = [
    ("bundle.out", "list.txt"),
    ("bundle/bundle.out", "list.txt"),
    ("bundle.out", "bundle.out.list.txt"),
    ("bundle.rd.out", "list.rd.txt"),
];

pub(super) fn files(folder: &Path) -> Option<(PathBuf, PathBuf)> {
    let files = FILES.iter().map(|(model, list)| (folder.join(model), folder.join(list)));
    files.into_iter().find(|(model, list)| model.is_file() && list.is_file())
}

/// Lists the capture in `folder`, views by name.
///
/// # Errors
/// As [`super::load`], as far as files but no pixels tell.
pub(super) fn list(folder: &Path, options: &LoadOptions) -> Result<Listing, DatasetError> {
    let Some((path, list)) = files(folder) else { return Err(DatasetError::NotAFolder { path: folder.to_owned() }) };
    let (text, list) = (text_file::read(&path)?, text_file::read(&list)?);
    // Behind a name stand a zero and a focal length where Bundler's scripts wrote the list.
    let names = list.lines().map(str::trim).filter(|line| !line.is_empty());
    let names: Vec<&str> = names.map(without_focal).collect();
    let (cameras, points) = model(&text).map_err(|(line, found)| DatasetError::of_model(&path, line, found))?;
    if names.len() != cameras.len() {
        let found =
            format!("{} cameras, but the list beside it names {} images, needed: as many", cameras.len(), names.len());
        return Err(DatasetError::of_model(&path, "line 2".to_owned(), found));
    }
    let mut notes = Vec::new();
    let images =
        image_folder::choose(folder, options, &mut notes)?.map_or_else(|| folder.to_owned(), |name| folder.join(name));
    let posed = names.into_iter().zip(cameras).filter_map(|(name, camera)| Some((name, camera?)));
    let mut frames: Vec<Frame> = posed.map(|(name, camera)| camera.frame(name)).collect();
    frames.sort_by(|a, b| a.name().cmp(b.name()));
    let split = |i| Some(every_nth(options.test_every, i));
    let points = Some((path.clone(), points)).filter(|(_, points)| !points.is_empty());
    Ok(list_frames(Layout::Bundler, path, &images, &frames, points, notes, split))
}

/// A line of the list without the zero and the focal length at its end.
fn without_focal(line: &str) -> &str {
    let Some((rest, focal)) = line.rsplit_once(' ') else { return line };
    match rest.strip_suffix(" 0") {
        Some(name) if focal.parse::<f64>().is_ok() => name,
        _ => line,
    }
}

/// A camera with a pose.
struct Camera {
    /// `f k1 k2`.
    lens: [f64; 3],
    /// World to camera, by rows.
    rotation: [f64; 9],
    translation: [f64; 3],
}

impl Camera {
    fn frame(&self, name: &str) -> Frame {
        // By columns, so this is the rotation from camera to world.
        let to_world = DMat3::from_cols_array(&self.rotation);
        let centre = -(to_world * DVec3::from_array(self.translation));
        let [fl_x, k1, k2] = self.lens.map(Some);
        Frame::of_pose(name.to_owned(), to_world, centre, Intrinsics { fl_x, k1, k2, ..Intrinsics::default() })
    }
}

/// The words of a file, and the line of the one that was taken last.
struct Words<'a> {
    words: Box<dyn Iterator<Item = (usize, &'a str)> + 'a>,
    line: usize,
}

/// A place and what is wrong there.
type Fault = (String, String);

impl Words<'_> {
    fn next<T: FromStr>(&mut self) -> Result<T, Fault> {
        let Some((line, word)) = self.words.next() else {
            return Err((format!("line {}", self.line), "the file ends where a number is needed".to_owned()));
        };
        self.line = line;
        word.parse().map_err(|_| (format!("line {line}"), format!("`{word}` is no number of that kind")))
    }

    fn numbers<const N: usize>(&mut self) -> Result<[f64; N], Fault> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.next()?;
        }
        Ok(numbers)
    }
}

/// The cameras, `None` where there is no pose, and the points.
fn model(text: &str) -> Result<(Vec<Option<Camera>>, Points), Fault> {
    let lines = text.lines().zip(1..).filter(|(line, _)| !line.trim_start().starts_with('#'));
    let words = lines.flat_map(|(line, i)| line.split_whitespace().map(move |word| (i, word)));
    let mut words = Words { words: Box::new(words), line: 1 };
    let (n_cameras, n_points) = (words.next::<usize>()?, words.next::<usize>()?);
    let (mut cameras, mut points) = (Vec::new(), Vec::new());
    for _ in 0..n_cameras {
        let camera = Camera { lens: words.numbers()?, rotation: words.numbers()?, translation: words.numbers()? };
        cameras.push((camera.lens[0] > 0.0).then_some(camera));
    }
    for _ in 0..n_points {
        let (at, rgb): ([f64; 3], [f64; 3]) = (words.numbers()?, words.numbers()?);
        points.push((DVec3::from_array(at), rgb8(&rgb)));
        // Camera, key, x and y of each image that shows it.
        for _ in 0..words.next::<usize>()? {
            let _seen: [f64; 4] = words.numbers()?;
        }
    }
    Ok((cameras, points.into_iter().collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_loses_its_focal_length_alone() {
        for (line, name) in
            [("a.jpg", "a.jpg"), ("a b.jpg 0 812.5", "a b.jpg"), ("a 0 b.jpg", "a 0 b.jpg"), ("a 5", "a 5")]
        {
            assert_eq!(without_focal(line), name);
        }
    }
}
