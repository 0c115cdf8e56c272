//! Pictures of one view while a run learns it.

use std::ffi::OsStr;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use pocketsplat_capture::dataset::View;

use super::{RunError, files};
use crate::train::Trainer;

/// Pictures of a whole run, about.
const PICTURES: u32 = 50;

/// The folder of previews in a run's folder.
pub(super) const PREVIEWS: &str = "previews";

/// The last picture that a run has drawn: iterations done, and the file.
pub fn newest_preview(run: &Path) -> Option<(u32, PathBuf)> {
    let folder = run.join(PREVIEWS);
    let newest = files::names(&folder).ok()?.into_iter().filter_map(|name| Some((iteration_of(&name)?, name))).max()?;
    Some((newest.0, folder.join(newest.1)))
}

/// Removes the pictures of a run, and their folder where nothing else lies in it.
pub(super) fn remove(folder: &Path) -> Result<(), RunError> {
    if !folder.is_dir() {
        return Ok(());
    }
    remove_after(folder, None)?;
    match fs::remove_dir(folder) {
        Err(error) if error.kind() != ErrorKind::DirectoryNotEmpty => Err(RunError::io("remove", folder, error)),
        _ => Ok(()),
    }
}

/// Removes the pictures after iteration `done`, or all, and those that are not whole.
fn remove_after(folder: &Path, done: Option<u32>) -> Result<(), RunError> {
    for name in files::names(folder)? {
        let whole = name.to_str().and_then(files::name_when_whole);
        let is_partial = whole.is_some_and(|name| iteration_of(OsStr::new(name)).is_some());
        if is_partial || iteration_of(&name).is_some_and(|iteration| done.is_none_or(|done| iteration > done)) {
            files::remove(&folder.join(name))?;
        }
    }
    Ok(())
}

/// Of whole pictures alone.
fn iteration_of(name: &OsStr) -> Option<u32> {
    name.to_str()?.strip_suffix(".jpg")?.parse().ok()
}

/// A folder with a JPEG every fiftieth of a run, `00000140.jpg` after iteration 140: always the first held-out view, or the first
/// training view where none is held out.
///
/// Each costs the forward half of an iteration.
#[derive(Debug)]
pub(super) struct Previews {
    folder: PathBuf,
    every: u32,
}

impl Previews {
    /// Opens the folder of a run that has done `done` of `iterations`, and drops pictures of later ones.
    pub(super) fn open(folder: &Path, done: u32, iterations: u32) -> Result<Self, RunError> {
        fs::create_dir_all(folder).map_err(|source| RunError::io("make the folder", folder, source))?;
        remove_after(folder, Some(done))?;
        Ok(Self { folder: folder.to_owned(), every: (iterations / PICTURES).max(1) })
    }

    /// Draws the view where a picture is due.
    pub(super) fn add(&self, trainer: &mut Trainer<'_>) -> Result<(), RunError> {
        if !trainer.iteration().is_multiple_of(self.every) && !trainer.is_done() {
            return Ok(());
        }
        let Some(view) = view_of(trainer) else { return Ok(()) };
        let picture = trainer.draw(view)?;
        let path = self.folder.join(format!("{:08}.jpg", trainer.iteration()));
        let bytes = picture.to_jpeg().map_err(|error| RunError::io("write", &path, std::io::Error::other(error)))?;
        files::write_whole(&path, |out| out.write_all(&bytes))
    }
}

/// The view that is drawn.
fn view_of<'a>(trainer: &Trainer<'a>) -> Option<&'a View> {
    let capture = trainer.capture();
    capture.test.first().or(capture.train.first())
}
