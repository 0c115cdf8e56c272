//! Why a run folder cannot be used, each reason with its remedy.

use pocketsplat_files::shell_word;
use std::path::{Path, PathBuf};

use crate::train::TrainError;
use crate::train::run::RestoreError;

/// What goes wrong with a run and its folder.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The system refuses.
    #[error("could not {action} {}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// With which file or folder.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// A file could not be written whole; what it was to replace is as it was.
    #[error("could not write {}; what was there is as it was, make room or make the folder writable", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// Somebody else's folder.
    #[error("{} holds files but no run (it lacks config.toml or lock); choose another folder with --run", path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
    },
    /// Another file has the name.
    #[error("{} is a file, and the folder of the run needs this name; choose another folder with --run", path.display())]
    NoFolder {
        /// The file.
        path: PathBuf,
    },
    /// A run would be lost.
    #[error(
        "{} holds an unfinished run; go on with it by `pocketsplat train --resume {}`, or start anew with --overwrite",
        path.display(), shell_word(path)
    )]
    Unfinished {
        /// The folder.
        path: PathBuf,
    },
    /// Nothing to go on with.
    #[error("{} is no run folder (it has no config.toml); give {}", path.display(), run_beside(path))]
    NoRun {
        /// The folder.
        path: PathBuf,
    },
    /// Nothing left to do.
    #[error("the run in {} is finished, see its result.json; train again without --resume", path.display())]
    Finished {
        /// The folder.
        path: PathBuf,
    },
    /// Another process has it.
    #[error("another process works in {}; wait for it to end, or choose another folder with --run", path.display())]
    InUse {
        /// The folder.
        path: PathBuf,
    },
    /// A sound checkpoint that does not fit.
    #[error("cannot go on from {}", path.display())]
    Restore {
        /// The checkpoint.
        path: PathBuf,
        /// Why not.
        source: RestoreError,
    },
    /// Nothing to begin another run from.
    #[error(
        "{} has no checkpoint of iteration {iteration}, it has {}; train it again with --fork-at {iteration}",
        path.display(), if kept.is_empty() { "none".to_owned() } else { format!("those of {kept:?}") }
    )]
    NoCheckpoint {
        /// The run folder.
        path: PathBuf,
        /// What was asked for.
        iteration: u32,
        /// What there is.
        kept: Vec<u32>,
    },
    /// No checkpoint is sound.
    #[error("no checkpoint of the run is sound ({}); start anew with --overwrite", faults.join("; "))]
    AllDamaged {
        /// What is wrong with each.
        faults: Vec<String>,
    },
    /// The run itself.
    #[error(transparent)]
    Train(#[from] TrainError),
}

impl RunError {
    pub(super) fn io(action: &'static str, path: &Path, source: std::io::Error) -> Self {
        Self::Io { action, path: path.to_owned(), source }
    }
}

/// Which folder is one, where another path was given: that of a bundle by its name, where it is there.
fn run_beside(path: &Path) -> String {
    let beside = super::RunFolder::beside(path);
    let is_one = beside != path && beside.join(super::CONFIG).is_file();
    let unnamed = "the folder that `train` made beside the bundle, OUT.run";
    if is_one { shell_word(&beside) } else { unnamed.to_owned() }
}
