//! Captures of NSVF, raw: `rgb`, one file for each matrix in `pose`, and `intrinsics.txt`.
//!
//! Poses are camera to world in OpenCV's axes. Names that start with `0_`, `1_` and `2_` are of the splits for training,
//! validation and testing; where no name starts with `2_`, those with `1_` are tested on.

use std::path::Path;

use pocketsplat_files::shown;

use super::lens::MAX_SKEW_PX;
use super::listing::{Listing, Note, every_nth, files_with};
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
    let mut notes = Vec::new();
    let lens = intrinsics(&folder.join(INTRINSICS), &mut notes)?;
    let files = files_with(&folder.join(POSES), "txt");
    let frames = files.iter().map(|path| frame(path, lens.clone())).collect::<Result<Vec<_>, _>>()?;
    let has = |prefix: &str| frames.iter().any(|frame| frame.name().starts_with(prefix));
    let (is_split, has_test) = (has("0_") && (has("1_") || has("2_")), has("2_"));
    let split = |i: usize| match frames.get(i).and_then(|frame| frame.name().split_once('_')) {
        _ if !is_split => Some(every_nth(options.test_every, i)),
        Some(("0", _)) => Some(Split::Train),
        Some(("1", _)) if has_test => None,
        Some(("1" | "2", _)) => Some(Split::Test),
        _ => None,
    };
    let mut listing = list_frames(Layout::Nsvf, folder.join(POSES), &folder.join(IMAGES), &frames, None, notes, split);
    let n_unused = frames.len() - listing.views.len();
    if n_unused > 0 {
        listing.notes.push(Note::new("unused-split", format!("views for validation, not used: {n_unused}")));
    }
    Ok(listing)
}

/// The numbers of a text file, by lines.
fn numbers(path: &Path) -> Result<Vec<Vec<f64>>, DatasetError> {
    let text = text_file::read(path)?;
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let line = |(i, line): (usize, &str)| {
        let number = |word: &str| {
            let fault = |_| DatasetError::of_model(path, format!("line {}", i + 1), format!("`{word}` is no number"));
            word.parse().map_err(fault)
        };
        line.split_whitespace().map(number).collect()
    };
    lines.map(line).collect()
}

/// A matrix `fx s cx …`, `0 fy cy …`, `0 0 1 …`, told by its rows of one length, or one line `f cx cy …`. The skew `s` is left out.
fn intrinsics(path: &Path, notes: &mut Vec<Note>) -> Result<Intrinsics, DatasetError> {
    let lines = numbers(path)?;
    let found = match lines.as_slice() {
        [x, y, z, ..] if x.len() >= 3 && x.len() == y.len() && x.len() == z.len() => {
            let skew_px = x[1] / y[1] * y[2];
            if skew_px.abs() > MAX_SKEW_PX {
                notes.push(Note::warning(
                    "skew",
                    format!(
                        "`{}`: the matrix has a skew of {}, which moves pixels at the border by {skew_px:.1} px and is left out; \
                         remove it from the photographs first",
                        shown(path),
                        x[1]
                    ),
                ));
            }
            Some([x[0], y[1], x[2], y[2]])
        }
        [line, ..] if line.len() >= 3 => Some([line[0], line[0], line[1], line[2]]),
        _ => None,
    };
    let Some([fl_x, fl_y, cx, cy]) = found.map(|numbers| numbers.map(Some)) else {
        let found = "no intrinsics, needed: a matrix of 4 by 4 numbers, or a focal length and a principal point";
        return Err(DatasetError::of_model(path, "line 1".to_owned(), found.to_owned()));
    };
    Ok(Intrinsics { fl_x, fl_y, cx, cy, ..Intrinsics::default() })
}

fn frame(path: &Path, lens: Intrinsics) -> Result<Frame, DatasetError> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Frame::of_opencv(stem, numbers(path)?, lens))
}
