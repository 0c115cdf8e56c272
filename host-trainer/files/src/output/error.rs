//! Why a file cannot or must not be written, each reason with its remedy.

use std::io;
use std::path::PathBuf;

/// Why an output is not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum OutputError {
    /// There is a folder of that name.
    #[error("{} is a folder, and needs to be a file; give a name in it with --output", path.display())]
    Folder { path: PathBuf },
    /// There is a file where a folder is needed.
    #[error("{} is no folder, and needs to be one; choose another name", path.display())]
    NoFolder { path: PathBuf },
    /// Nothing can be written to it by its name.
    #[error("{} is a socket, to which no file is written; choose another --output", path.display())]
    Socket { path: PathBuf },
    /// Its content would be lost.
    #[error("{} is a disk, whose content would be lost; choose another --output, or write over it with --overwrite", path.display())]
    Disk { path: PathBuf },
    /// What lies there was not written as this output is.
    #[error(
        "{} is {found}, and {needed} would replace it; choose another --output, or replace it with --overwrite",
        path.display()
    )]
    OtherKind { path: PathBuf, found: String, needed: String },
    /// The command reads it.
    #[error("{} is what this command reads{}; choose another --output", path.display(), if path == input {
        String::new()
    } else {
        format!(" as {}", input.display())
    })]
    Input { path: PathBuf, input: PathBuf },
    /// Two outputs of a command are one file.
    #[error("{} and {} are one file; give each output a name of its own", other.display(), path.display())]
    Twice { path: PathBuf, other: PathBuf },
    /// Somebody keeps it from being changed.
    #[error("{} is read-only; choose another --output, or replace it with --overwrite", path.display())]
    ReadOnly { path: PathBuf },
    /// A link to nowhere.
    #[error("{} links to {}, whose folder is not there; make the folder, or choose another --output", path.display(), target.display())]
    Dangling { path: PathBuf, target: PathBuf },
    /// Links in a circle, or a path that cannot be looked at.
    #[error("could not look at {}", path.display())]
    Look { path: PathBuf, source: io::Error },
    /// The folder of an output.
    #[error("could not make the folder {}", path.display())]
    MakeFolder { path: PathBuf, source: io::Error },
    /// Without a new file beside it a file cannot be replaced whole.
    #[error("could not write to the folder {}, beside {}; make it writable, or choose another --output", folder.display(), path.display())]
    FolderWrite { folder: PathBuf, path: PathBuf, source: io::Error },
    /// The system refuses.
    #[error("could not write {} ({n_bytes} bytes){}", path.display(), remedy(source))]
    Write { path: PathBuf, n_bytes: usize, source: io::Error },
}

/// Where the reason says what helps.
fn remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::ResourceBusy => ", which is mounted by itself and cannot be replaced; choose another --output",
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "; make room there, or choose another --output",
        _ => "",
    }
}
