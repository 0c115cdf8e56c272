//! The folder of a run: what it was asked for, how it went, and how to go on with it.
//!
//! | file | what |
//! |---|---|
//! | `config.toml` | the resolved configuration |
//! | `effects.csv` | what each effect was worth in pilots, where they were measured |
//! | `progress.csv` | loss and PSNR over the run, see [`ProgressLog`] |
//! | `photographs/` | the photographs of a large capture, decoded, until the run is finished |
//! | `points.ply` | the points that were made for a capture that brings none, capture units |
//! | `previews/00000140.jpg` | one held-out view after so many iterations, fifty pictures a run |
//! | `iteration-00001500.checkpoint` | the state of the run, see [`crate::train::run::checkpoint`]; the last two are kept, and those to fork from |
//! | `result.json` | what the finished run reports; with it, the run is over |
//! | `report.html` | a page about the finished run, which the command writes |
//! | `lock` | locked by the process that works in the folder; the system frees it when that process ends, however |

mod error;
mod files;
mod previews;
mod progress_log;
mod store;

#[cfg(test)]
mod tests;

use std::ffi::OsStr;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

pub use error::RunError;
pub use previews::newest_preview;
pub use progress_log::{LoggedStep, ProgressLog};
pub use store::{Resumed, fork};

use super::{Method, Observer, Run, Trainer};
use pocketsplat_files::beside;
use pocketsplat_kernels::step::StepReport;
use previews::{PREVIEWS, Previews};

const CONFIG: &str = "config.toml";
const LOG: &str = "progress.csv";
const EFFECTS: &str = "effects.csv";
const PILOTS: &str = "pilots.csv";
const RESULT: &str = "result.json";
const REPORT: &str = "report.html";
const LOCK: &str = "lock";
const PHOTOGRAPHS: &str = "photographs";
const POINTS: &str = "points.ply";

/// Checkpoints every so many seconds are put off until they take at most this share of the time.
const LARGEST_SHARE: f64 = 0.02;

/// The first checkpoint of a process comes after so many seconds at most: most accidents are early ones.
const FIRST_AFTER_S: f64 = 10.0;

/// When checkpoints are written; the bits of the result do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Interval {
    /// After every so many iterations; 0 means only at the end and on interruption.
    Iterations(u32),
    /// After so many seconds, or later where writing would take more than 2 % of the time; the first after ten.
    Seconds(f64),
}

/// Where the folder of a run keeps decoded photographs that are too many for the memory. They are made before the run begins.
pub fn photographs_in(run: &Path) -> PathBuf {
    run.join(PHOTOGRAPHS)
}

/// Where the folder of a run keeps points that were made for a capture that brings none.
pub fn points_in(run: &Path) -> PathBuf {
    run.join(POINTS)
}

/// How a run came to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// All iterations are done.
    Finished,
    /// It was asked to stop; a checkpoint is written.
    Interrupted,
}

/// A run folder that this process works in, and no other.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    /// Iterations whose checkpoints are written and kept, so that other runs can begin there.
    forks_at: Vec<u32>,
    _lock: File,
}

impl RunFolder {
    /// Where the run that writes `output` works unless it is told: `OUT.run` for a bundle, and `OUT.ply.run` for another file, so that
    /// Gaussians and the bundle made of them have a folder each.
    pub fn beside(output: &Path) -> PathBuf {
        let is_bundle = output.extension().is_none_or(|extension| extension.eq_ignore_ascii_case("psb"));
        if is_bundle { output.with_extension("run") } else { beside(output, ".run") }
    }

    /// Takes the folder `path` for a new run and keeps its configuration there; makes the folder where there is none.
    ///
    /// What a finished run left there is replaced; an unfinished one only with `overwrite`.
    ///
    /// # Errors
    /// [`RunError`] when another process works in the folder, it holds an unfinished run or something else, or it can
    /// not be written.
    pub fn start(path: &Path, config: &str, overwrite: bool) -> Result<Self, RunError> {
        let folder = Self::cleared(path, overwrite)?;
        folder.write_config(config)?;
        Ok(folder)
    }

    /// As [`Self::start`], for a run that begins as `begun` stands. Its checkpoint is there before the configuration is: the folder
    /// is that of a run only once it can go on from there.
    ///
    /// # Errors
    /// As [`Self::start`].
    pub fn start_from(
        path: &Path,
        config: &str,
        overwrite: bool,
        begun: &Run<'_, impl Method>,
    ) -> Result<Self, RunError> {
        let folder = Self::cleared(path, overwrite)?;
        files::remove(&path.join(CONFIG))?;
        folder.save(begun)?;
        folder.write_config(config)?;
        Ok(folder)
    }

    /// Fails where [`Self::start`] would: before the hours that a capture may take to load.
    ///
    /// # Errors
    /// As [`Self::start`].
    pub fn check(path: &Path, overwrite: bool) -> Result<(), RunError> {
        match fs::metadata(path) {
            Err(_) => Ok(()),
            Ok(found) if !found.is_dir() => Err(RunError::NoFolder { path: path.to_owned() }),
            Ok(_) => {
                Self::refuse_foreign(path)?;
                if path.join(LOCK).is_file() { Self::locked(path)?.refuse_unfinished(overwrite) } else { Ok(()) }
            }
        }
    }

    fn refuse_foreign(path: &Path) -> Result<(), RunError> {
        let ours = |name: &OsStr| [LOCK, PHOTOGRAPHS].iter().any(|own| name == *own) || is_partial(name);
        let occupied = files::names(path)?.into_iter().any(|name| !ours(&name));
        // A configuration alone may be anyone's; a run has locked its folder too, with a file that says nothing.
        let is_locked = fs::metadata(path.join(LOCK)).is_ok_and(|found| found.is_file() && found.len() == 0);
        if occupied && !(is_locked && path.join(CONFIG).is_file()) {
            return Err(RunError::Foreign { path: path.to_owned() });
        }
        Ok(())
    }

    fn refuse_unfinished(&self, overwrite: bool) -> Result<(), RunError> {
        // Pilots take hours too.
        let has_begun =
            !self.checkpoints()?.is_empty() || fs::metadata(self.pilots()).is_ok_and(|found| found.len() > 0);
        if !overwrite && !self.is_finished() && has_begun {
            return Err(RunError::Unfinished { path: self.path.clone() });
        }
        Ok(())
    }

    /// The folder `path` without what an earlier run left there, but for its configuration.
    fn cleared(path: &Path, overwrite: bool) -> Result<Self, RunError> {
        if fs::metadata(path).is_ok_and(|found| !found.is_dir()) {
            return Err(RunError::NoFolder { path: path.to_owned() });
        }
        fs::create_dir_all(path).map_err(|source| RunError::io("make the folder", path, source))?;
        Self::refuse_foreign(path)?;
        let folder = Self::locked(path)?;
        folder.refuse_unfinished(overwrite)?;
        folder.clear_checkpoints(|_| true)?;
        for name in [RESULT, LOG, EFFECTS, PILOTS, POINTS, REPORT] {
            files::remove(&path.join(name))?;
        }
        previews::remove(&path.join(PREVIEWS))?;
        Ok(folder)
    }

    /// Takes the folder of an unfinished run.
    ///
    /// # Errors
    /// [`RunError`] when there is none, it is finished, or another process works in it.
    pub fn reopen(path: &Path) -> Result<Self, RunError> {
        if !path.join(CONFIG).is_file() {
            return Err(RunError::NoRun { path: path.to_owned() });
        }
        let folder = Self::locked(path)?;
        if folder.is_finished() {
            return Err(RunError::Finished { path: path.to_owned() });
        }
        Ok(folder)
    }

    fn locked(path: &Path) -> Result<Self, RunError> {
        let name = path.join(LOCK);
        let open = File::options().read(true).write(true).create(true).truncate(false).open(&name);
        let lock = open.map_err(|source| RunError::io("open", &name, source))?;
        match lock.try_lock() {
            Ok(()) => {
                let folder = Self { path: path.to_owned(), forks_at: Vec::new(), _lock: lock };
                folder.clear_partial_files()?;
                Ok(folder)
            }
            Err(fs::TryLockError::WouldBlock) => Err(RunError::InUse { path: path.to_owned() }),
            Err(fs::TryLockError::Error(source)) => Err(RunError::io("lock", &name, source)),
        }
    }

    /// The same; checkpoints after these iterations are written and stay, whatever happens.
    #[must_use]
    pub fn forking_at(self, iterations: &[u32]) -> Self {
        Self { forks_at: iterations.to_vec(), ..self }
    }

    /// Iterations at which it was to be forked from, of which it keeps no checkpoint now that it stands after `iteration`.
    ///
    /// # Errors
    /// [`RunError::Io`].
    pub fn missed_forks(&self, iteration: u32) -> Result<Vec<u32>, RunError> {
        let kept: Vec<u32> = self.checkpoints()?.into_iter().map(|(iteration, _)| iteration).collect();
        let missed = |at: &u32| *at < iteration && !kept.contains(at);
        Ok(self.forks_at.iter().copied().filter(missed).collect())
    }

    /// The file of the pilots that are done, which the caller keeps while it measures effects.
    pub fn pilots(&self) -> PathBuf {
        self.path.join(PILOTS)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn is_finished(&self) -> bool {
        self.path.join(RESULT).is_file()
    }

    /// The configuration the run began with.
    ///
    /// # Errors
    /// [`RunError::Io`] when it cannot be read.
    pub fn config(&self) -> Result<String, RunError> {
        let path = self.path.join(CONFIG);
        fs::read_to_string(&path).map_err(|source| RunError::io("read", &path, source))
    }

    /// Replaces the configuration by one that says more, or other things that do not decide the result.
    ///
    /// # Errors
    /// [`RunError::Write`].
    pub fn write_config(&self, config: &str) -> Result<(), RunError> {
        files::write_whole(&self.path.join(CONFIG), |out| out.write_all(config.as_bytes()))
    }

    /// Trains to the end, or until `stop` is set, which is looked at after every iteration; writes checkpoints and the
    /// log on the way.
    ///
    /// # Errors
    /// [`RunError`] when something cannot be written or the run diverges. The checkpoints so far stay.
    pub fn train(
        &mut self,
        trainer: &mut Trainer<'_>,
        observer: &mut impl Observer,
        interval: Interval,
        stop: &AtomicBool,
    ) -> Result<Ending, RunError> {
        let previews = Previews::open(&self.path.join(PREVIEWS), trainer.iteration(), trainer.iterations());
        // Pictures for people: a run is not worse for lacking them.
        let previews = previews.inspect_err(|error| observer.unwritten(error)).ok();
        self.drive(trainer, interval, stop, |trainer| {
            let outcome = trainer.observed_advance(observer)?;
            match previews.as_ref().map_or(Ok(()), |previews| previews.add(trainer)) {
                Err(error @ (RunError::Io { .. } | RunError::Write { .. })) => observer.unwritten(&error),
                added => added?,
            }
            let StepReport { loss, squared_error, rate, .. } = outcome.report;
            Ok(LoggedStep { loss: f64::from(loss), squared_error, rate, is_dropped: outcome.dropped.is_some() })
        })
    }

    /// As [`Self::train`], for any run; `advance` does one iteration.
    ///
    /// # Errors
    /// As [`Self::train`].
    pub fn drive<'a, M: Method>(
        &mut self,
        run: &mut Run<'a, M>,
        interval: Interval,
        stop: &AtomicBool,
        mut advance: impl FnMut(&mut Run<'a, M>) -> Result<LoggedStep, RunError>,
    ) -> Result<Ending, RunError> {
        let mut log = ProgressLog::open(&self.path.join(LOG), run)?;
        let (mut saved_at, mut write_s) = (Instant::now(), 0.0);
        let mut saved_iteration = None;
        loop {
            let asked = stop.load(Ordering::Relaxed);
            let ends = asked || run.is_done();
            let due = match interval {
                Interval::Iterations(n) => n > 0 && run.iteration() > 0 && run.iteration().is_multiple_of(n),
                Interval::Seconds(s) if saved_iteration.is_none() => {
                    run.iteration() > 0 && saved_at.elapsed().as_secs_f64() >= s.min(FIRST_AFTER_S)
                }
                Interval::Seconds(s) => saved_at.elapsed().as_secs_f64() >= f64::max(s, write_s / LARGEST_SHARE),
            };
            let due = due || self.forks_at.contains(&run.iteration());
            if (ends || due) && saved_iteration != Some(run.iteration()) {
                let started = Instant::now();
                M::fetch(run)?;
                self.save(run)?;
                write_s = started.elapsed().as_secs_f64();
                (saved_at, saved_iteration) = (Instant::now(), Some(run.iteration()));
            }
            if ends {
                return Ok(if run.is_done() { Ending::Finished } else { Ending::Interrupted });
            }
            let step = advance(run)?;
            if log.is_due(run) {
                M::fetch(run)?;
            }
            log.add(run, &step)?;
        }
    }

    /// Ends the run: keeps `result`, and removes the checkpoints unless they are to be kept or to be forked from.
    ///
    /// # Errors
    /// [`RunError::Io`].
    pub fn finish(self, result: &str, keep_checkpoints: bool) -> Result<(), RunError> {
        files::write_whole(&self.path.join(RESULT), |out| out.write_all(result.as_bytes()))?;
        self.clear_checkpoints(|iteration| !keep_checkpoints && !self.forks_at.contains(&iteration))
    }
}

/// Whether a run keeps a file or folder of that name in its folder.
pub fn is_file_of_run(name: &OsStr) -> bool {
    let own = [CONFIG, LOG, EFFECTS, PILOTS, RESULT, REPORT, LOCK, PHOTOGRAPHS, POINTS, PREVIEWS];
    name.to_str().is_some_and(|name| own.contains(&name) || store::iteration_of(name).is_some())
}

/// Whether it is what a file of a run is called until it is whole.
fn is_partial(name: &OsStr) -> bool {
    name.to_str().and_then(files::name_when_whole).is_some_and(|name| is_file_of_run(OsStr::new(name)))
}
