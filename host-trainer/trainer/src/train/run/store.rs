//! The checkpoints in a run folder: the last two, so that one is left when the newest turns out damaged.

use std::fs;
use std::path::PathBuf;

use super::{RunError, RunFolder, files};
use crate::train::Trainer;
use crate::train::checkpoint::{CheckpointFault, RestoreError, Restored};
use pocketsplat_capture::dataset::Capture;

/// Checkpoints that are kept.
const KEPT: usize = 2;

const PREFIX: &str = "iteration-";
const EXTENSION: &str = "checkpoint";

/// A run taken up again.
#[derive(Debug)]
pub struct Resumed<'a> {
    /// Its state.
    pub restored: Restored<'a>,
    /// What is wrong with newer checkpoints, which were passed over.
    pub passed_over: Vec<String>,
}

impl RunFolder {
    /// The checkpoints, newest first.
    pub(super) fn checkpoints(&self) -> Result<Vec<PathBuf>, RunError> {
        let iteration =
            |name: &str| name.strip_prefix(PREFIX)?.strip_suffix(EXTENSION)?.strip_suffix('.')?.parse().ok();
        let mut found: Vec<(u32, PathBuf)> = files::names(&self.path)?
            .into_iter()
            .filter_map(|name| Some((iteration(name.to_str()?)?, self.path.join(name))))
            .collect();
        found.sort_unstable();
        Ok(found.into_iter().rev().map(|(_, path)| path).collect())
    }

    /// Writes a checkpoint, and removes those that are no longer needed.
    ///
    /// # Errors
    /// [`RunError::Write`] when there is no room or right to write; the older checkpoints stay.
    pub fn save(&self, trainer: &Trainer<'_>) -> Result<(), RunError> {
        let name = format!("{PREFIX}{:08}.{EXTENSION}", trainer.iteration);
        files::write_whole(&self.path.join(name), |out| trainer.save(out))?;
        for old in self.checkpoints()?.into_iter().skip(KEPT) {
            files::remove(&old)?;
        }
        Ok(())
    }

    /// The state in the newest sound checkpoint; none when the run was stopped before it wrote one.
    ///
    /// # Errors
    /// [`RunError::Restore`] when `capture` is not that of the run, [`RunError::AllDamaged`] when no checkpoint is
    /// sound.
    pub fn resume<'a>(&self, capture: &'a Capture) -> Result<Option<Resumed<'a>>, RunError> {
        let mut passed_over = Vec::new();
        for path in self.checkpoints()? {
            let bytes = fs::read(&path).map_err(|source| RunError::io("read", &path, source))?;
            match Trainer::restore(capture, &bytes) {
                Ok(restored) => return Ok(Some(Resumed { restored, passed_over })),
                Err(RestoreError::Fault(fault)) if !matches!(fault, CheckpointFault::Version { .. }) => {
                    passed_over.push(format!("{}: {fault}", path.display()));
                }
                Err(source) => return Err(RunError::Restore { path, source }),
            }
        }
        if passed_over.is_empty() { Ok(None) } else { Err(RunError::AllDamaged { faults: passed_over }) }
    }

    /// Removes all checkpoints.
    pub(super) fn clear_checkpoints(&self) -> Result<(), RunError> {
        self.checkpoints()?.iter().try_for_each(|path| files::remove(path))
    }

    /// Removes what a process left that died while it wrote.
    pub(super) fn clear_partial_files(&self) -> Result<(), RunError> {
        let names = files::names(&self.path)?.into_iter().map(|name| self.path.join(name));
        names
            .filter(|path| path.extension().is_some_and(|extension| extension == files::PARTIAL))
            .try_for_each(|path| files::remove(&path))
    }
}
