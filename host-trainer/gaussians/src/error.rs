//! What can be wrong with a file.

use std::path::PathBuf;

/// Bytes that hold no Gaussians: what was found, what is needed, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Unreadable(pub(crate) String);

impl Unreadable {
    pub(crate) fn new(found: impl Into<String>) -> Self {
        Self(found.into())
    }
}

/// Why a file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The name ends in nothing known.
    #[error("{path} is no file of Gaussians by its name; the names of those that are known end in {known}")]
    Extension {
        /// The file.
        path: PathBuf,
        /// The endings, as words.
        known: String,
    },
    /// Its bytes cannot be had.
    #[error("{path} cannot be read")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It holds no Gaussians.
    #[error("{path} {fault}")]
    Content {
        /// The file.
        path: PathBuf,
        /// What was found.
        fault: Unreadable,
    },
}
