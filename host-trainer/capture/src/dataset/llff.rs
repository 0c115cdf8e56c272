//! Captures of LLFF: `poses_bounds.npy` beside folders of images.
//!
//! An array of 17 numbers for each image in the order of their names: a matrix of 3 rows and 5 columns, then the nearest and the
//! farthest depth. The first three columns are the camera's axes in the world, down, right and backwards; the fourth is its place; the
//! last is height, width and focal length in pixels (LLFF's README, "Using your own poses without running COLMAP").

use std::path::Path;

use super::image_names::is_image_name;
use super::listing::{Listing, every_nth, is_hidden};
use super::transforms::{Frame, Intrinsics, list_frames};
use super::{DatasetError, Layout, LoadOptions, image_folder};

pub(super) const POSES: &str = "poses_bounds.npy";
/// Numbers of an image: 3 × 5, and two depths.
const N_NUMBERS: usize = 17;

/// Lists the capture in `folder`, views by name.
///
/// # Errors
/// As [`super::load`], as far as files but no pixels tell.
pub(super) fn list(folder: &Path, options: &LoadOptions) -> Result<Listing, DatasetError> {
    let path = folder.join(POSES);
    let bytes = std::fs::read(&path).map_err(|source| DatasetError::of_reading(&path, source))?;
    let fault = |found: String| DatasetError::of_model(&path, "array".to_owned(), found);
    let rows = rows(&bytes).map_err(fault)?;
    let mut notes = Vec::new();
    let images = image_folder::needed(folder, options, &mut notes)?;
    let names = image_names(&images);
    if names.len() != rows.len() {
        return Err(fault(format!(
            "{} poses, but `{}` holds {} images, needed: as many, for poses have no names",
            rows.len(),
            pocketsplat_files::shown(&images),
            names.len()
        )));
    }
    let frames: Vec<Frame> = names.into_iter().zip(&rows).map(|(name, row)| frame(name, row)).collect();
    let split = |i| Some(every_nth(options.test_every, i));
    Ok(list_frames(Layout::Llff, path, &images, &frames, None, notes, split))
}

fn frame(name: String, row: &[f64; N_NUMBERS]) -> Frame {
    // From down, right, backwards to right, up, backwards.
    let matrix: Vec<Vec<f64>> = row[..15].chunks_exact(5).map(|row| vec![row[1], -row[0], row[2], row[3]]).collect();
    let [h, w, focal] = [row[4], row[9], row[14]].map(Some);
    Frame::new(name, &matrix, Intrinsics { fl_x: focal, w, h, ..Intrinsics::default() })
}

/// The names of the images in a folder, sorted as LLFF sorts them.
fn image_names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name()).filter(|name| !is_hidden(name));
    let mut names: Vec<String> =
        names.map(|name| super::folder_names::as_text(&name)).filter(|name| is_image_name(name)).collect();
    names.sort_unstable();
    names
}

/// The rows of a NumPy array of numbers of 4 or 8 bytes, `[n, 17]` (NEP 1: magic, version, length of the header, header, data).
fn rows(bytes: &[u8]) -> Result<Vec<[f64; N_NUMBERS]>, String> {
    let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or("no NumPy array, needed: the bytes 93 `NUMPY` at its start")?;
    let (version, rest) = rest.split_first_chunk::<2>().ok_or("the file ends in its header")?;
    let (length, rest) = if version[0] == 1 {
        let (length, rest) = rest.split_first_chunk::<2>().ok_or("the file ends in its header")?;
        (usize::from(u16::from_le_bytes(*length)), rest)
    } else {
        let (length, rest) = rest.split_first_chunk::<4>().ok_or("the file ends in its header")?;
        (u32::from_le_bytes(*length) as usize, rest)
    };
    let (header, data) = rest.split_at_checked(length).ok_or("the file ends in its header")?;
    let header: String = String::from_utf8_lossy(header).chars().filter(|c| !c.is_whitespace()).collect();
    let after = |key: &str| header.split_once(key).map_or("", |(_, behind)| behind);
    let kind = after("'descr':'").split('\'').next().unwrap_or_default();
    let shape: Vec<usize> =
        after("'shape':(").split(')').next().unwrap_or_default().split(',').filter_map(|n| n.parse().ok()).collect();
    let number: fn(&[u8]) -> f64 = match kind {
        "<f8" => |bytes| f64::from_le_bytes(bytes.try_into().unwrap_or_default()),
        ">f8" => |bytes| f64::from_be_bytes(bytes.try_into().unwrap_or_default()),
        "<f4" => |bytes| f64::from(f32::from_le_bytes(bytes.try_into().unwrap_or_default())),
        ">f4" => |bytes| f64::from(f32::from_be_bytes(bytes.try_into().unwrap_or_default())),
        _ => return Err(format!("numbers of the type `{kind}`, needed: floating point of 4 or 8 bytes")),
    };
    let n_bytes = if kind.ends_with('8') { 8 } else { 4 };
    let is_by_columns = after("'fortran_order':").starts_with("True");
    let n = match shape[..] {
        [n, N_NUMBERS] => n,
        _ => {
            return Err(format!(
                "an array of the shape {shape:?}, needed: a row of {N_NUMBERS} numbers for each image"
            ));
        }
    };
    if data.len() / (n_bytes * N_NUMBERS) < n {
        return Err(format!("{} bytes of numbers, needed: {n} rows of {N_NUMBERS}", data.len()));
    }
    let numbers: Vec<f64> = data.chunks_exact(n_bytes).take(n * N_NUMBERS).map(number).collect();
    let at = |i: usize, j: usize| if is_by_columns { numbers[j * n + i] } else { numbers[i * N_NUMBERS + j] };
    Ok((0..n).map(|i| std::array::from_fn(|j| at(i, j))).collect())
}
