//! The files of a run's folder.

use std::ffi::OsString;
use std::fs;
use std::io::{self, Write};
use std::path::Path;

use super::RunError;

/// Writes a file so that there is the old one or the new one, whenever the process or the machine dies.
pub(super) fn write_whole(path: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), RunError> {
    let written = pocketsplat_files::write_whole(path, content);
    written.map_err(|source| RunError::Write { path: path.to_owned(), source })
}

/// The name that a file is to get when it is whole, of what it is called until then; `None` of every other name.
pub(super) fn name_when_whole(name: &str) -> Option<&str> {
    let name = name.strip_suffix(".partial")?;
    let of_process = name.rsplit_once('.').filter(|(_, number)| number.bytes().all(|byte| byte.is_ascii_digit()));
    Some(of_process.map_or(name, |(name, _)| name))
}

/// Removes a file; none is as good.
pub(super) fn remove(path: &Path) -> Result<(), RunError> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => Err(RunError::io("remove", path, e)),
        _ => Ok(()),
    }
}

/// The names in a folder.
pub(super) fn names(folder: &Path) -> Result<Vec<OsString>, RunError> {
    let read = || fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name())).collect::<io::Result<Vec<_>>>();
    read().map_err(|source| RunError::io("read the folder", folder, source))
}
