//! What can be wrong with a file.

use std::path::PathBuf;

use pocketsplat_files::FileKind;

/// Bytes that hold no Gaussians: what was found, what is needed, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Unreadable(pub(crate) String);

impl Unreadable {
    pub(crate) fn new(found: impl Into<String>) -> Self {
        Self(found.into())
    }
}

impl From<pocketsplat_files::ply::Fault> for Unreadable {
    fn from(fault: pocketsplat_files::ply::Fault) -> Self {
        Self::new(fault.0)
    }
}

/// Why a file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// Its bytes cannot be had.
    #[error("{path} cannot be read")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It is something else.
    #[error("{path} is {kind}, no file of Gaussians; {remedy}")]
    Kind {
        /// The file.
        path: PathBuf,
        /// What it is.
        kind: FileKind,
        /// What to do.
        remedy: String,
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
