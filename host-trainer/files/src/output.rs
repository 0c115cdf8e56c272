//! Files that a command writes: whole or not at all, and never over what is somebody else's.
//!
//! [`Outputs`] knows what a command reads and what it writes; each [`Output`] is checked before the work and again when it is written.
//! A regular file is replaced by a rename, with its permissions. A link stays a link: what it leads to is replaced. A character device
//! or a FIFO is written through.

mod content;
mod error;
mod inputs;
mod place;
mod whole;

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::kind::first_bytes;
pub use content::{Content, MARK};
pub use error::OutputError;
use inputs::Inputs;
use place::{Place, is_same_file};
pub use whole::write_whole;

/// The files that a command writes, and what they may not replace.
#[derive(Clone, Debug, Default)]
pub struct Outputs {
    inputs: Arc<Inputs>,
    may_overwrite: bool,
    /// Names that are given away, and where they lead.
    taken: Vec<(PathBuf, PathBuf)>,
}

impl Outputs {
    /// None yet.
    ///
    /// * `may_overwrite`: whether a file of another kind may be replaced; what the command reads may not be in any case.
    pub fn new(may_overwrite: bool) -> Self {
        Self { may_overwrite, ..Self::default() }
    }

    /// The same command, which also reads the file `path`.
    #[must_use]
    pub fn reading(mut self, path: &Path) -> Self {
        Arc::make_mut(&mut self.inputs).files.push(path.to_owned());
        self
    }

    /// The same command, which also reads what lies in `folder`, as the photographs of a capture.
    #[must_use]
    pub fn reading_folder(mut self, folder: &Path) -> Self {
        Arc::make_mut(&mut self.inputs).folders.push(folder.to_owned());
        self
    }

    /// Checks that `path` may and can be written, makes its folder, and gives the name away.
    ///
    /// # Errors
    /// [`OutputError`]: what is there is not to be replaced, another output has the name, or the system refuses.
    pub fn file(&mut self, path: &Path, content: Content) -> Result<Output, OutputError> {
        let output = Output {
            path: path.to_owned(),
            content,
            inputs: Arc::clone(&self.inputs),
            may_overwrite: self.may_overwrite,
        };
        if let Place::File(place) = output.place()? {
            whole::check_folder(path, &place)?;
            // Two names may lead into one folder.
            let place = in_canonical_folder(&place);
            let is_it = |(_, taken): &&(PathBuf, PathBuf)| *taken == place || is_same_file(taken, &place);
            if let Some((other, _)) = self.taken.iter().find(is_it) {
                return Err(OutputError::Twice { path: path.to_owned(), other: other.clone() });
            }
            self.taken.push((path.to_owned(), place));
        }
        Ok(output)
    }

    /// Checks that `path` is a folder, or makes it.
    ///
    /// # Errors
    /// [`OutputError`]: it is something else, or the system refuses.
    pub fn folder(path: &Path) -> Result<(), OutputError> {
        match fs::metadata(path) {
            Ok(found) if !found.is_dir() => Err(OutputError::NoFolder { path: path.to_owned() }),
            _ => fs::create_dir_all(path).map_err(|source| OutputError::MakeFolder { path: path.to_owned(), source }),
        }
    }
}

fn in_canonical_folder(file: &Path) -> PathBuf {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    file.file_name().map_or_else(|| folder.clone(), |name| folder.join(name))
}

/// A file that may be written.
#[derive(Clone, Debug)]
pub struct Output {
    path: PathBuf,
    content: Content,
    inputs: Arc<Inputs>,
    may_overwrite: bool,
}

impl Output {
    /// Its name, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it is there as a file: what went through a device or a FIFO cannot be read again.
    pub fn is_file(&self) -> bool {
        self.path.is_file()
    }

    /// Writes it whole; where that fails, what was there is as it was.
    ///
    /// # Errors
    /// [`OutputError`]: what is there now is not to be replaced, or the system refuses.
    pub fn write(&self, bytes: &[u8]) -> Result<(), OutputError> {
        let write = |out: &mut dyn Write| out.write_all(bytes);
        let written = match self.place()? {
            Place::File(place) => whole::replace(&place, write),
            Place::Through => whole::write_through(&self.path, write),
        };
        written.map_err(|source| OutputError::Write { path: self.path.clone(), n_bytes: bytes.len(), source })
    }

    /// Where it goes, if what is there may be replaced.
    fn place(&self) -> Result<Place, OutputError> {
        let path = || self.path.clone();
        let place = Place::of(&self.path, self.may_overwrite)?;
        let Place::File(file) = &place else { return Ok(place) };
        if !file.is_file() {
            return Ok(place);
        }
        let first = first_bytes(file).unwrap_or_default();
        if let Some(input) = self.inputs.find(file, self.content.is_surely_ours(&first)) {
            return Err(OutputError::Input { path: path(), input });
        }
        if self.may_overwrite {
            return Ok(place);
        }
        if !self.content.may_replace(&first)
            || first.is_empty() && fs::metadata(file).is_ok_and(|found| found.len() > 0)
        {
            let found = self.content.said_of(&first);
            return Err(OutputError::OtherKind { path: path(), found, needed: self.content.to_string() });
        }
        if fs::metadata(file).is_ok_and(|found| found.permissions().readonly()) {
            return Err(OutputError::ReadOnly { path: path() });
        }
        Ok(place)
    }
}

#[cfg(test)]
mod tests;
