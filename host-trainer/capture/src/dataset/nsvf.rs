//! Captures of NSVF, raw: `rgb`, one file for each matrix in `pose`, and `intrinsics.txt`.
//!
//! Poses are camera to world in OpenCV's axes. Names that start with `0_`, `1_` and `2_` are of the splits for training,
//! validation and testing; where no name starts with `2_`, those with `1_` are tested on.

use std::path::{Path, PathBuf};

use super::listing::{Listing, Note, every_nth, is_listed};
use super::transforms::{Frame, Intrinsics, list_frames};
use super::{DatasetError, Layout, LoadOptions, Split, text_file};

const INTRINSICS: &str = "intrinsics.txt";
const POSES: &str = "pose";
const IMAGES: &str = "rgb";

/// Whether the folder is of this layout.
pub(super) fn is_layout_of(folder: &Path) -> bool {
    folder.join(INTRINSICS).is_file() && folder.join(POSES).is_dir() && folder.join(IMAGES).is_dir()
}

/// Lists the capture in `folder`, views by name.
///
/// # Errors
/// As [`super::load`], as far as files but no pixels tell.
pub(super) fn list(folder: &Path, options: &LoadOptions) -> Result<Listing, DatasetError> {
    let shared = intrinsics(&folder.join(INTRINSICS))?;
    let entries = std::fs::read_dir(folder.join(POSES)).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut files: Vec<PathBuf> = entries.filter(|path| is_listed(path, "txt")).collect();
    files.sort();
    let frames = files.iter().map(|path| frame(path)).collect::<Result<Vec<_>, _>>()?;
    let has = |prefix: &str| frames.iter().any(|frame| frame.name().starts_with(prefix));
    let (is_split, has_test) = (has("0_") && (has("1_") || has("2_")), has("2_"));
    let split = |i: usize| match frames.get(i).and_then(|frame| frame.name().split_once('_')) {
        _ if !is_split => Some(every_nth(options.test_every, i)),
        Some(("0", _)) => Some(Split::Train),
        Some(("1", _)) if has_test => None,
        Some(("1" | "2", _)) => Some(Split::Test),
        _ => None,
    };
    let mut listing = list_frames(Layout::Nsvf, folder.join(POSES), &folder.join(IMAGES), &frames, &shared, split);
    let n_unused = frames.len() - listing.views.len();
    if n_unused > 0 {
        listing.notes.push(Note::new("unused-split", format!("views for validation, not used: {n_unused}")));
    }
    Ok(listing)
}

/// The numbers of a text file, by lines.
fn numbers(path: &Path) -> Result<Vec<Vec<f64>>, DatasetError> {
    let text = text_file::read(path).map_err(|source| DatasetError::Read { path: path.to_owned(), source })?;
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let line = |(i, line): (usize, &str)| {
        let number = |word: &str| {
            word.parse().map_err(|_| DatasetError::Model {
                path: path.to_owned(),
                place: format!("line {}", i + 1),
                found: format!("`{word}` is no number"),
            })
        };
        line.split_whitespace().map(number).collect()
    };
    lines.map(line).collect()
}

/// A matrix `fx 0 cx …`, `0 fy cy …`, or one line `f cx cy …`.
fn intrinsics(path: &Path) -> Result<Intrinsics, DatasetError> {
    let lines = numbers(path)?;
    let found = match (lines.first().map(Vec::as_slice), lines.get(1).map(Vec::as_slice)) {
        (Some(&[fx, 0.0, cx, ..]), Some(&[_, fy, cy, ..])) => Some([fx, fy, cx, cy]),
        (Some(&[f, cx, cy, ..]), _) => Some([f, f, cx, cy]),
        _ => None,
    };
    let Some([fl_x, fl_y, cx, cy]) = found.map(|numbers| numbers.map(Some)) else {
        return Err(DatasetError::Model {
            path: path.to_owned(),
            place: "line 1".to_owned(),
            found: "no intrinsics, needed: a matrix of 4 by 4 numbers, or a focal length and a principal point"
                .to_owned(),
        });
    };
    Ok(Intrinsics { fl_x, fl_y, cx, cy, ..Intrinsics::default() })
}

fn frame(path: &Path) -> Result<Frame, DatasetError> {
    let mut rows = numbers(path)?;
    // From OpenCV's axes to OpenGL's: y and z turn.
    for row in rows.iter_mut().take(3) {
        row.iter_mut().skip(1).take(2).for_each(|number| *number = -*number);
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Frame::new(stem, &rows, Intrinsics::default()))
}
