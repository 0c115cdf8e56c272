//! A folder of decoded photographs, for captures that are not held in memory.
//!
//! Each photograph is decoded once and lies in a file of its own, so whatever interrupts a run leaves the others sound. A file is
//! used again only if it was made from the same image in the same way, and if its checksum holds. One process at a time works
//! with a folder.

mod file;
#[cfg(test)]
mod tests;

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub(super) use file::CacheFile;
pub use file::FileFault;
use file::Header;

use super::framing::Framing;
use super::listing::Shot;
use super::looks::Looks;
use super::photo::Photo;
use super::{DatasetError, LoadOptions, ViewFault};

/// Locked by the process that works with the folder; the system frees it when that process ends, however.
const LOCK: &str = "lock";
const EXTENSION: &str = "photograph";
/// Rises when the same image is decoded to other pixels than by an earlier version.
const DECODING: u32 = 2;

/// A folder of decoded photographs that no other process works with.
#[derive(Clone, Debug)]
pub(super) struct Cache {
    path: PathBuf,
    /// Bytes that all photographs take.
    needed: u64,
    lock: Arc<File>,
}

/// A photograph in the cache.
pub(super) struct CachedPhoto {
    pub(super) file: CacheFile,
    pub(super) looks: Looks,
}

impl Cache {
    /// Takes the folder `path`, and makes it where there is none.
    ///
    /// * `needed`: bytes that all photographs take.
    ///
    /// # Errors
    /// [`DatasetError::CacheInUse`], [`DatasetError::DiskFull`] or [`DatasetError::CacheWrite`].
    pub(super) fn open(path: &Path, needed: u64) -> Result<Self, DatasetError> {
        Self::open_where(path, needed, |path| fs4::available_space(path))
    }

    fn open_where(path: &Path, needed: u64, free: impl Fn(&Path) -> io::Result<u64>) -> Result<Self, DatasetError> {
        let cannot_write = |source| DatasetError::CacheWrite { path: path.to_owned(), source };
        fs::create_dir_all(path).map_err(cannot_write)?;
        let open = File::options().read(true).write(true).create(true).truncate(false).open(path.join(LOCK));
        let lock = open.map_err(cannot_write)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(DatasetError::CacheInUse { path: path.to_owned() }),
            Err(TryLockError::Error(source)) => return Err(cannot_write(source)),
        }
        // What is there is used again or replaced.
        let there: u64 =
            files(path).map_err(cannot_write)?.iter().map(|file| file.metadata().map_or(0, |m| m.len())).sum();
        let found = free(path).map_err(cannot_write)? + there;
        if found < needed {
            return Err(DatasetError::DiskFull { path: path.to_owned(), needed, found });
        }
        Ok(Self { path: path.to_owned(), needed, lock: Arc::new(lock) })
    }

    /// The photograph number `i` of the capture: from its file where that is sound and of the same image, else decoded
    /// and written. The inner error is the photograph's.
    ///
    /// # Errors
    /// [`DatasetError::DiskFull`] or [`DatasetError::CacheWrite`].
    pub(super) fn photo(
        &self,
        i: usize,
        name: &str,
        shot: &Shot,
        options: &LoadOptions,
    ) -> Result<Result<CachedPhoto, ViewFault>, DatasetError> {
        let path = self.path.join(format!("{i:05}.{EXTENSION}"));
        let made_from = made_from(name, shot, options);
        if let Ok(made_from) = &made_from
            && let Ok((header, photograph)) = file::read(&path)
            && header.made_from == *made_from
        {
            let file = CacheFile::new(path, &header, &self.lock);
            return Ok(Ok(CachedPhoto { file, looks: Looks::of(&photograph, header.shown()) }));
        }
        let Photo { photograph, looks, .. } = match shot.read(options) {
            Ok(photo) => photo,
            Err(fault) => return Ok(Err(fault)),
        };
        // An image that could be decoded but not read before that: a file that says so is never used again.
        let header = Header::new(made_from.unwrap_or_default(), &photograph, looks.shown);
        file::write(&path, &header, &photograph).map_err(|source| self.write_error(source))?;
        Ok(Ok(CachedPhoto { file: CacheFile::new(path, &header, &self.lock), looks }))
    }

    /// What a failure to write is; a full disk is left as it was found.
    fn write_error(&self, source: io::Error) -> DatasetError {
        let path = self.path.clone();
        if source.kind() != io::ErrorKind::StorageFull {
            return DatasetError::CacheWrite { path, source };
        }
        // Best effort: the error that matters is the full disk.
        let _ = remove_files(&path);
        DatasetError::DiskFull { found: fs4::available_space(&path).unwrap_or(0), needed: self.needed, path }
    }
}

/// What a photograph is made from, and how: two that agree have the same pixels.
fn made_from(name: &str, shot: &Shot, options: &LoadOptions) -> io::Result<String> {
    let checksum = |path: &Path| fs::read(path).map(|bytes| crc32fast::hash(&bytes));
    let image = checksum(&shot.path)?;
    let masks =
        shot.masks.iter().map(|mask| Ok((checksum(&mask.path)?, mask.is_inverted))).collect::<io::Result<Vec<_>>>()?;
    let framing = Framing::of(shot.header.size_px, options);
    let Shot { header, lens, .. } = shot;
    Ok(format!(
        "decoding {DECODING} of {name}: image {image:08x} {header:?}, masks {masks:08x?}, {lens:?}, {framing:?}, {:?}",
        options.background
    ))
}

/// The photographs in a folder.
fn files(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let paths = fs::read_dir(folder)?.map(|entry| entry.map(|entry| entry.path())).collect::<io::Result<Vec<_>>>()?;
    Ok(paths.into_iter().filter(|path| path.extension().is_some_and(|extension| extension == EXTENSION)).collect())
}

fn remove_files(folder: &Path) -> io::Result<()> {
    files(folder)?.into_iter().try_for_each(fs::remove_file)
}

/// Removes a folder of decoded photographs, and nothing else that may lie in it; none is as good. One that a process works with stays.
///
/// # Errors
/// What the system says.
pub fn remove_cache(folder: &Path) -> io::Result<()> {
    // Only a folder that was made as a cache.
    if !folder.join(LOCK).is_file() {
        return Ok(());
    }
    let lock = File::open(folder.join(LOCK))?;
    match lock.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => return Ok(()),
        Err(TryLockError::Error(source)) => return Err(source),
    }
    remove_files(folder)?;
    fs::remove_file(folder.join(LOCK))?;
    match fs::remove_dir(folder) {
        Err(error) if error.kind() != io::ErrorKind::DirectoryNotEmpty => Err(error),
        _ => Ok(()),
    }
}
