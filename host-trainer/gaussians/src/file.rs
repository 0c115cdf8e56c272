//! Files on disk: which format, read and written whole.

use std::path::Path;

use crate::{FileError, Gaussians, Notes, Unreadable, ply};

/// A file format for Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Every number in 32 bits.
    Ply,
}

impl Format {
    /// All.
    pub const ALL: [Self; 1] = [Self::Ply];

    /// What names end in, without the dot.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
        }
    }

    /// The format that a file's name says, whatever its case; `None` for names that say another thing.
    pub fn of_path(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        Self::ALL.into_iter().find(|format| format.extension().eq_ignore_ascii_case(extension))
    }

    /// The bytes of a file of this format.
    pub fn to_bytes(self, gaussians: &Gaussians, notes: &Notes) -> Vec<u8> {
        match self {
            Self::Ply => ply::write(gaussians, notes),
        }
    }

    /// Reads the bytes of a file of this format.
    ///
    /// # Errors
    /// [`Unreadable`] says what was found.
    pub fn from_bytes(self, bytes: &[u8]) -> Result<(Gaussians, Notes), Unreadable> {
        match self {
            Self::Ply => ply::read(bytes),
        }
    }

    /// Reads the file at `path`, whose name says its format.
    ///
    /// # Errors
    /// See [`FileError`].
    pub fn read(path: &Path) -> Result<(Gaussians, Notes), FileError> {
        let format = Self::of_path(path).ok_or_else(|| {
            let known = Self::ALL.map(|format| format!(".{}", format.extension())).join(", ");
            FileError::Extension { path: path.to_owned(), known }
        })?;
        let bytes = std::fs::read(path).map_err(|source| FileError::Read { path: path.to_owned(), source })?;
        format.from_bytes(&bytes).map_err(|fault| FileError::Content { path: path.to_owned(), fault })
    }
}
