//! Files on disk: which format, read and written whole.

use std::path::Path;

use crate::{FileError, Gaussians, Notes, Unreadable, ply, sog, spz};

/// A file format for Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Every number in 32 bits.
    Ply,
    /// 8 to 24 bits a number, gzip around them.
    Spz,
    /// Images, a palette for what follows the view.
    Sog,
}

impl Format {
    /// All.
    pub const ALL: [Self; 3] = [Self::Ply, Self::Spz, Self::Sog];

    /// What names end in, without the dot.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Spz => "spz",
            Self::Sog => "sog",
        }
    }

    /// The format that a file's name says, whatever its case; `None` for names that say another thing.
    pub fn of_path(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        Self::ALL.into_iter().find(|format| format.extension().eq_ignore_ascii_case(extension))
    }

    /// The bytes of a file of this format.
    ///
    /// # Errors
    /// [`Unreadable`] for Gaussians that cannot be drawn, or that the format cannot hold.
    pub fn to_bytes(self, gaussians: &Gaussians, notes: &Notes) -> Result<Vec<u8>, Unreadable> {
        gaussians.check()?;
        match self {
            Self::Ply => Ok(ply::write(gaussians, notes)),
            Self::Spz => spz::write(gaussians, notes),
            Self::Sog => sog::write(gaussians, notes),
        }
    }

    /// Reads the bytes of a file of this format.
    ///
    /// # Errors
    /// [`Unreadable`] says what was found.
    pub fn from_bytes(self, bytes: &[u8]) -> Result<(Gaussians, Notes), Unreadable> {
        match self {
            Self::Ply => ply::read(bytes),
            Self::Spz => spz::read(bytes),
            Self::Sog => sog::read(bytes),
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
