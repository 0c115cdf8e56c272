//! Which folder of images to read: captures often hold the photographs at several sizes.

use std::path::{Path, PathBuf};

use super::image_names::is_image_name;
use super::listing::{Note, is_hidden};
use super::{DatasetError, LoadOptions};

/// The folder of full-size images.
pub(super) const FULL_SIZE: &str = "images";
/// How the names of folders of smaller ones begin.
pub(super) const REDUCED: &str = "images_";
/// Where some tools look for photographs before a reconstruction.
const UNPREPARED: &str = "input";

/// The name of the folder to read images from: the one asked for, the only one there is, or `images`; without any of these
/// `input`, or no name where images lie in the capture's own folder. Says what else there is; `None` where there is none.
///
/// # Errors
/// [`DatasetError::ImageFolder`] where the one asked for is missing, or several are there but not `images`.
pub(super) fn choose(
    folder: &Path,
    options: &LoadOptions,
    notes: &mut Vec<Note>,
) -> Result<Option<String>, DatasetError> {
    let present = present(folder);
    if let Some(name) = &options.images {
        if folder.join(name).is_dir() {
            return Ok(Some(name.clone()));
        }
        return Err(DatasetError::ImageFolder { path: folder.to_owned(), wanted: Some(name.clone()), present });
    }
    match present.as_slice() {
        [] if folder.join(UNPREPARED).is_dir() => Ok(Some(UNPREPARED.to_owned())),
        [] if holds_images(folder) => Ok(Some(String::new())),
        [] => Ok(None),
        [only] => Ok(Some(only.clone())),
        several if several.iter().any(|name| name == FULL_SIZE) => {
            let others: Vec<&str> = several.iter().filter(|name| *name != FULL_SIZE).map(String::as_str).collect();
            let text = format!(
                "images are read from `{FULL_SIZE}` although `{}` is there, too; choose another folder with `--images`",
                others.join("`, `")
            );
            notes.push(Note::new("several-image-folders", text));
            Ok(Some(FULL_SIZE.to_owned()))
        }
        _ => Err(DatasetError::ImageFolder { path: folder.to_owned(), wanted: None, present }),
    }
}

/// The folder of [`choose`], which has to be there.
///
/// # Errors
/// [`DatasetError::ImageFolder`], also where there is none.
pub(super) fn needed(folder: &Path, options: &LoadOptions, notes: &mut Vec<Note>) -> Result<PathBuf, DatasetError> {
    match choose(folder, options, notes)? {
        Some(name) => Ok(folder.join(name)),
        None => Err(DatasetError::ImageFolder { path: folder.to_owned(), wanted: None, present: Vec::new() }),
    }
}

/// Whether there is a folder of images, or images in the folder itself.
pub(super) fn is_there(folder: &Path) -> bool {
    !present(folder).is_empty() || folder.join(UNPREPARED).is_dir() || holds_images(folder)
}

/// Whether images lie in the folder itself.
fn holds_images(folder: &Path) -> bool {
    let mut entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.any(|entry| {
        let name = entry.file_name();
        !is_hidden(&name) && entry.path().is_file() && is_image_name(&name.to_string_lossy())
    })
}

/// The folders named `images` or `images_…`, sorted.
fn present(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names =
        entries.filter(|entry| entry.path().is_dir()).map(|entry| entry.file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names.filter(|name| name == FULL_SIZE || name.starts_with(REDUCED)).collect();
    names.sort_unstable();
    names
}
