//! Where the files of a .sog are: in a zip, or beside each other in a folder.

use std::path::Path;

use super::zip::Archive;
use crate::Unreadable;

/// Bytes of a file of a folder that are read at most: more is no scene.
const MAX_BYTES: u64 = 1 << 32;

pub(super) enum Files<'a> {
    /// With the bytes of the whole archive.
    Zip(Archive<'a>, usize),
    Folder(&'a Path),
}

impl Files<'_> {
    /// Bytes of the archive, by which it is judged what may be unpacked; `None` where each file is judged by its own.
    pub(super) fn n_bytes(&self) -> Option<usize> {
        match self {
            Self::Zip(_, n_bytes) => Some(*n_bytes),
            Self::Folder(_) => None,
        }
    }

    /// The bytes of the file `name`.
    pub(super) fn read(&self, name: &str) -> Result<Vec<u8>, Unreadable> {
        match self {
            Self::Zip(archive, _) => archive.file(name),
            Self::Folder(folder) => {
                // A name is one of the folder, whatever a meta.json from elsewhere says.
                if Path::new(name).file_name().is_none_or(|file| file != name) {
                    return Err(Unreadable::new(format!(
                        "names the file `{}`, which is not beside it",
                        name.escape_debug()
                    )));
                }
                let path = folder.join(name);
                let read = || -> std::io::Result<Vec<u8>> {
                    if std::fs::metadata(&path)?.len() > MAX_BYTES {
                        return Err(std::io::Error::other("it has more than 4 GiB"));
                    }
                    std::fs::read(&path)
                };
                read().map_err(|error| {
                    Unreadable::new(format!(
                        "is incomplete: {name} beside it cannot be read ({error}); copy the whole folder"
                    ))
                })
            }
        }
    }
}
