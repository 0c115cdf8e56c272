//! Files that are there whole or not at all: written under another name, and given their own when they are on the disk.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::place::Place;
use super::{OutputError, in_canonical_folder};

/// What a file is called until it is whole: `NAME.PID.partial`.
const PARTIAL: &str = "partial";

/// Writes the file `path` of a folder that is the program's own: nothing there is kept from being replaced.
///
/// Whenever the process or the machine dies, there is the old file or the new one.
///
/// # Errors
/// What the system or `content` said; what was there is as it was.
pub fn write_whole(path: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    match Place::of(path, false).map_err(io::Error::other)? {
        Place::File(file) => replace(&file, content),
        Place::Through => write_through(path, content),
    }
}

/// Writes into what is there, and leaves it what it is.
pub(super) fn write_through(path: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut out = BufWriter::new(File::options().write(true).open(path)?);
    content(&mut out)?;
    out.flush()
}

/// Makes or replaces a regular file, which is no link.
pub(super) fn replace(file: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let (partial, new) = create_beside(file)?;
    keep_permissions(file, &new);
    let write = || {
        let mut out = BufWriter::new(new);
        content(&mut out)?;
        out.into_inner()?.sync_all()?;
        fs::rename(&partial, file)
    };
    write().inspect_err(|_| {
        // Best effort: the error that matters is the one above.
        let _ = fs::remove_file(&partial);
    })?;
    sync_folder(file);
    Ok(())
}

/// Makes the folder of an output, and sees that a file can be made beside it.
///
/// * `path`: as the user named it. * `file`: behind links.
pub(super) fn check_folder(path: &Path, file: &Path) -> Result<(), OutputError> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let owned = || folder.to_owned();
    fs::create_dir_all(folder).map_err(|source| OutputError::MakeFolder { path: owned(), source })?;
    create_beside(file).and_then(|(partial, _)| fs::remove_file(partial)).map_err(|source| OutputError::FolderWrite {
        folder: owned(),
        path: path.to_owned(),
        source,
    })
}

/// A new file beside `file`, over nobody else's.
fn create_beside(file: &Path) -> io::Result<(PathBuf, File)> {
    let file = in_canonical_folder(file);
    let mut name = 0;
    loop {
        let partial = file.with_added_extension(format!("{}.{PARTIAL}", u64::from(std::process::id()) + name));
        match File::options().write(true).create_new(true).open(&partial) {
            // Left by a process that died and had the same number.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && name < 100 => name += 1,
            made => return made.map(|new| (partial, new)),
        }
    }
}

/// Gives a new file the permissions of the one that it replaces, and its owner, where the system allows.
#[cfg(unix)]
fn keep_permissions(old: &Path, new: &File) {
    use std::os::unix::fs::{MetadataExt as _, fchown};
    let Ok(found) = fs::metadata(old) else { return };
    // Only root gives files away; to a group of one's own anybody does. Some file systems know no owners.
    let _ = fchown(new, Some(found.uid()), Some(found.gid())).or_else(|_| fchown(new, None, Some(found.gid())));
    let _ = new.set_permissions(found.permissions());
}

#[cfg(not(unix))]
fn keep_permissions(_: &Path, _: &File) {}

/// Makes the new name of a file last, where folders can be synchronised.
fn sync_folder(file: &Path) {
    if let Some(folder) = in_canonical_folder(file).parent()
        && let Ok(folder) = File::open(folder)
    {
        // Best effort: the file is whole, by its old name or its new one.
        let _ = folder.sync_all();
    }
}
