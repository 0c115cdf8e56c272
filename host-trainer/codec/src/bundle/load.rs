//! Reading a bundle from a file.

use std::path::{Path, PathBuf};

use pocketsplat_format::{Bundle, DecodeError};

/// Why a bundle file cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum LoadError {
    /// The file cannot be read.
    #[error("{}: cannot be read", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    /// The file is not a sound bundle.
    #[error("{}: not a sound bundle", path.display())]
    Malformed { path: PathBuf, source: DecodeError },
}

/// Reads a bundle file and checks all of it, every chunk's checksum included; `Bundle::parse` of the bytes succeeds.
///
/// A file that is cut at the end of a tier is sound, with fewer tiers than it was written with.
///
/// # Errors
/// [`LoadError`] with the path.
pub fn load(path: &Path) -> Result<Vec<u8>, LoadError> {
    let bytes = std::fs::read(path).map_err(|source| LoadError::Io { path: path.to_owned(), source })?;
    check(&bytes).map_err(|source| LoadError::Malformed { path: path.to_owned(), source })?;
    Ok(bytes)
}

/// Checks all of a bundle, every chunk's checksum included.
///
/// # Errors
/// As [`Bundle::parse`], and that of the first damaged chunk.
pub fn check(bytes: &[u8]) -> Result<(), DecodeError> {
    let bundle = Bundle::parse(bytes)?;
    bundle.chunks().try_for_each(|chunk| chunk.check())
}
