//! Where a name leads: to a file that is made or replaced, or through a device.

use std::fs::{self, Metadata};
use std::io;
use std::path::{Path, PathBuf};

use super::OutputError;

/// As many links lead on at most; Linux follows 40.
const MOST_LINKS: usize = 40;

/// Where an output goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// A regular file, or none yet: behind all links.
    File(PathBuf),
    /// A character device or a FIFO, or a file that another process has opened for us (`/dev/stdout`).
    Through,
}

impl Place {
    /// * `may_overwrite`: whether the content of a disk may be lost.
    pub(super) fn of(path: &Path, may_overwrite: bool) -> Result<Self, OutputError> {
        let owned = || path.to_owned();
        match fs::metadata(path) {
            Ok(found) if found.is_dir() => Err(OutputError::Folder { path: owned() }),
            Ok(found) if !found.is_file() => match Special::of(&found) {
                Special::Stream => Ok(Self::Through),
                Special::Disk if may_overwrite => Ok(Self::Through),
                Special::Disk => Err(OutputError::Disk { path: owned() }),
                Special::Socket => Err(OutputError::Socket { path: owned() }),
            },
            Ok(_) => behind_links(path).map(|place| place.map_or(Self::Through, Self::File)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => match behind_links(path)? {
                Some(target) if target != path && !target.parent().is_some_and(Path::is_dir) => {
                    Err(OutputError::Dangling { path: owned(), target })
                }
                place => Ok(place.map_or(Self::Through, Self::File)),
            },
            Err(source) => Err(OutputError::Look { path: owned(), source }),
        }
    }
}

/// What is neither a file nor a folder.
enum Special {
    /// Takes bytes one after another.
    Stream,
    Disk,
    Socket,
}

impl Special {
    #[cfg(unix)]
    fn of(found: &Metadata) -> Self {
        use std::os::unix::fs::FileTypeExt as _;
        match found.file_type() {
            kind if kind.is_block_device() => Self::Disk,
            kind if kind.is_socket() => Self::Socket,
            _ => Self::Stream,
        }
    }

    #[cfg(not(unix))]
    fn of(_: &Metadata) -> Self {
        Self::Stream
    }
}

/// The path behind the links that `path` may be; `None` where it leads into `/proc`, whose links are open files and no paths.
fn behind_links(path: &Path) -> Result<Option<PathBuf>, OutputError> {
    let look = |source| OutputError::Look { path: path.to_owned(), source };
    let mut at = path.to_owned();
    for _ in 0..MOST_LINKS {
        if at.starts_with("/proc") {
            return Ok(None);
        }
        if !fs::symlink_metadata(&at).is_ok_and(|found| found.is_symlink()) {
            return Ok(Some(at));
        }
        let target = fs::read_link(&at).map_err(look)?;
        at = at.parent().unwrap_or(Path::new("")).join(target);
    }
    Err(look(io::Error::other("its links lead in a circle")))
}

/// Whether two names are of one file, by hard links too; false where one is not there.
#[cfg(unix)]
pub(super) fn is_same_file(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let id = |path: &Path| fs::metadata(path).ok().map(|found| (found.dev(), found.ino()));
    id(a).is_some_and(|found| id(b) == Some(found))
}

/// Whether two names are of one file; false where one is not there.
#[cfg(not(unix))]
pub(super) fn is_same_file(a: &Path, b: &Path) -> bool {
    fs::canonicalize(a).is_ok_and(|a| fs::canonicalize(b).is_ok_and(|b| a == b))
}
