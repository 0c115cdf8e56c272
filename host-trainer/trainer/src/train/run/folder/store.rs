//! The checkpoints in a run folder: the last two, so that one is left when the newest turns out damaged, and those that other
//! runs are to begin from.

use std::fs;
use std::path::{Path, PathBuf};

use super::{RunError, RunFolder, files};
use crate::train::run::checkpoint::CheckpointFault;
use crate::train::run::{Method, RestoreError, Restored, Run};
use crate::train::{TrainConfig, Trainer};
use pocketsplat_capture::dataset::Capture;

/// Checkpoints that are kept.
const KEPT: usize = 2;

const PREFIX: &str = "iteration-";
const EXTENSION: &str = "checkpoint";

fn file_name(iteration: u32) -> String {
    format!("{PREFIX}{iteration:08}.{EXTENSION}")
}

/// Of a checkpoint, by its name.
pub(super) fn iteration_of(name: &str) -> Option<u32> {
    name.strip_prefix(PREFIX)?.strip_suffix(EXTENSION)?.strip_suffix('.')?.parse().ok()
}

fn checkpoints_in(folder: &Path) -> Result<Vec<(u32, PathBuf)>, RunError> {
    let mut found: Vec<(u32, PathBuf)> = files::names(folder)?
        .into_iter()
        .filter_map(|name| Some((iteration_of(name.to_str()?)?, folder.join(name))))
        .collect();
    found.sort_unstable();
    found.reverse();
    Ok(found)
}

/// The state of the run in `folder` after `iteration`, to go on as `config` says in another folder.
///
/// # Errors
/// [`RunError::NoCheckpoint`] when none was kept of that iteration, [`RunError::Restore`] when it is damaged or does not
/// fit.
pub fn fork<'a>(
    folder: &Path,
    iteration: u32,
    capture: &'a Capture,
    config: TrainConfig,
) -> Result<Trainer<'a>, RunError> {
    let path = folder.join(file_name(iteration));
    if !path.is_file() {
        let kept = checkpoints_in(folder)?.into_iter().rev().map(|(iteration, _)| iteration).collect();
        return Err(RunError::NoCheckpoint { path: folder.to_owned(), iteration, kept });
    }
    let bytes = fs::read(&path).map_err(|source| RunError::io("read", &path, source))?;
    let restored = Trainer::fork(capture, &bytes, config);
    restored.map(|restored| restored.run).map_err(|source| RunError::Restore { path, source })
}

/// A run taken up again.
#[derive(Debug)]
pub struct Resumed<'a, M: Method> {
    /// As the newest sound checkpoint has it.
    pub restored: Restored<'a, M>,
    /// What is wrong with newer checkpoints, which were passed over.
    pub passed_over: Vec<String>,
}

impl RunFolder {
    /// Iterations and files of the checkpoints, newest first.
    pub(super) fn checkpoints(&self) -> Result<Vec<(u32, PathBuf)>, RunError> {
        checkpoints_in(&self.path)
    }

    /// Writes a checkpoint, and removes those that are no longer needed.
    ///
    /// # Errors
    /// [`RunError::Write`] when there is no room or right to write; the older checkpoints stay.
    pub fn save(&self, run: &Run<'_, impl Method>) -> Result<(), RunError> {
        files::write_whole(&self.path.join(file_name(run.iteration())), |out| run.save(out))?;
        let passing = self.checkpoints()?.into_iter().filter(|(iteration, _)| !self.forks_at.contains(iteration));
        passing.skip(KEPT).try_for_each(|(_, path)| files::remove(&path))
    }

    /// The state in the newest sound checkpoint; none when the run was stopped before it wrote one.
    ///
    /// # Errors
    /// [`RunError::Restore`] when `capture` is not that of the run, [`RunError::AllDamaged`] when no checkpoint is
    /// sound.
    pub fn resume<'a, M: Method>(&self, capture: &'a Capture) -> Result<Option<Resumed<'a, M>>, RunError> {
        let mut passed_over = Vec::new();
        for (_, path) in self.checkpoints()? {
            let bytes = fs::read(&path).map_err(|source| RunError::io("read", &path, source))?;
            match Run::restore(capture, &bytes) {
                Ok(restored) => return Ok(Some(Resumed { restored, passed_over })),
                Err(RestoreError::Fault(fault)) if !matches!(fault, CheckpointFault::Version { .. }) => {
                    passed_over.push(format!("{}: {fault}", path.display()));
                }
                Err(source) => return Err(RunError::Restore { path, source }),
            }
        }
        if passed_over.is_empty() { Ok(None) } else { Err(RunError::AllDamaged { faults: passed_over }) }
    }

    /// Removes the checkpoints for which `goes`.
    pub(super) fn clear_checkpoints(&self, goes: impl Fn(u32) -> bool) -> Result<(), RunError> {
        let mut gone = self.checkpoints()?.into_iter().filter(|(iteration, _)| goes(*iteration));
        gone.try_for_each(|(_, path)| files::remove(&path))
    }

    /// Removes what a process left that died while it wrote.
    pub(super) fn clear_partial_files(&self) -> Result<(), RunError> {
        let names = files::names(&self.path)?.into_iter();
        names.filter(|name| super::is_partial(name)).try_for_each(|name| files::remove(&self.path.join(name)))
    }
}
