//! The log of a folder, `poses.log`, which also keeps others out of it.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result, bail};

/// How often the log is asked for, and the time between.
const LOCK_TRIALS: u32 = 10;
const LOCK_PAUSE: Duration = Duration::from_millis(50);

/// Everything that other programs said in a folder. Locked, so that two of us never work in one.
#[derive(Clone, Debug)]
pub(super) struct Log {
    path: PathBuf,
    file: Arc<File>,
}

impl Log {
    /// Opens the log to write at its end.
    pub(super) fn open(path: &Path) -> Result<Self> {
        let file = OpenOptions::new().create(true).append(true).open(path);
        let file = file.with_context(|| format!("could not open {}", path.display()))?;
        // A program that is just being started holds its parent's locks for a moment.
        let is_taken = |_| {
            let is_taken = matches!(file.try_lock(), Err(TryLockError::WouldBlock));
            if is_taken {
                thread::sleep(LOCK_PAUSE);
            }
            is_taken
        };
        if (0..LOCK_TRIALS).all(is_taken) {
            let folder = path.parent().unwrap_or(path).display();
            bail!("another process looks for poses in {folder}; wait for it to end, or choose another --output");
        }
        Ok(Self { path: path.to_owned(), file: Arc::new(file) })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a line; a log that cannot be written is no reason to end.
    pub(super) fn line(&self, words: &str) {
        let _ = (&*self.file).write_all(format!("{words}\n").as_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_of_us_never_work_in_one_folder() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("poses.log");
        let log = Log::open(&path).unwrap();
        log.line("one");
        let said = Log::open(&path).unwrap_err().to_string();
        assert!(said.starts_with("another process looks for poses in "), "{said}");
        drop(log);
        Log::open(&path).unwrap().line("two");
        assert_eq!(std::fs::read_to_string(path).unwrap(), "one\ntwo\n");
    }
}
