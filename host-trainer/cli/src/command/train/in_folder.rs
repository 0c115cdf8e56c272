//! Trains in a run folder: start, resume or fork, the steps with their checkpoints, the bundle.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use anyhow::{Context, Result, bail};
use pocketsplat_capture::dataset::Capture;
use pocketsplat_files::{Output, shell_word};
use pocketsplat_kernels::step::SharedDevice;
use pocketsplat_trainer::encode::EncodedSizes;
use pocketsplat_trainer::train::Trainer;
use pocketsplat_trainer::train::run::{Ending, Interval, Method, Resumed, Run, RunError, RunFolder};

use super::loading::keep_points;
use super::result::{TrainResult, write_bundle};
use crate::command::devices::DeviceChoice;
use crate::command::estimate::{Before, Estimate};
use crate::command::output::json;
use crate::command::progress::Progress;
use crate::config::RunConfig;
use crate::say::say;

/// Seconds between checkpoints unless the user says otherwise: what an accident may cost.
const CHECKPOINT_SECONDS: f64 = 60.0;

/// Where the two configurations stand that have to agree.
pub(super) const IN_RUN_AND_ON_COMMAND_LINE: [&str; 2] = ["in the run", "on the command line"];

/// Where a run begins.
#[derive(Debug)]
pub(crate) enum Start<'a> {
    /// With the capture's points; what its estimate is told of the trial.
    New(Before),
    /// With the newest checkpoint of its folder.
    Resumed,
    /// With the state of another run.
    Forked(Box<Trainer<'a>>),
}

/// What carries a run on.
#[derive(Clone)]
pub(crate) struct Attempt<'a> {
    /// The GPU that trains, where one does.
    pub(crate) device: Option<SharedDevice<f32>>,
    /// Set when the run is to stop.
    pub(crate) stop: &'a AtomicBool,
    /// How a run that was stopped goes on.
    pub(crate) goes_on: GoesOn,
}

/// How a run that was stopped goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum GoesOn {
    /// By `train --resume`, on the device that was asked for.
    Resume(DeviceChoice),
    /// By the command that began it.
    SameCommand,
}

impl GoesOn {
    /// What to do where the capture is not the one that the run began with.
    const fn with_another_capture(self) -> &'static str {
        match self {
            Self::Resume(_) => "the run needs its own capture",
            Self::SameCommand => "give the options of the first time again, or begin anew with --overwrite",
        }
    }

    /// As a clause.
    pub(crate) fn said(self, run: &Path) -> String {
        match self {
            Self::Resume(device) => {
                let device = if device == DeviceChoice::Cpu { String::new() } else { format!(" --device {device}") };
                format!("go on with `pocketsplat train --resume {}{device}`", shell_word(run))
            }
            Self::SameCommand => "give the same command again to go on".to_owned(),
        }
    }
}

/// Takes the folder of a run that goes on by the command that began it: as it stands, or empty.
///
/// # Errors
/// An unfinished run of another configuration, unless `overwrite`; a folder that cannot be used.
pub(crate) fn begun_or_new<'a>(path: &Path, config: &RunConfig, overwrite: bool) -> Result<(RunFolder, Start<'a>)> {
    let begun = match RunFolder::reopen(path) {
        Ok(folder) => Some(folder),
        Err(RunError::NoRun { .. } | RunError::Finished { .. }) => None,
        Err(error) => return Err(error.into()),
    };
    if let Some(folder) = begun.filter(|_| !overwrite) {
        let before = RunConfig::parse(&folder.config()?).with_context(|| {
            format!("could not use the config.toml in {}; begin anew with --overwrite", path.display())
        })?;
        match before.difference(config, IN_RUN_AND_ON_COMMAND_LINE)? {
            None if before.dataset == config.dataset => return Ok((folder, Start::Resumed)),
            difference => bail!(
                "the unfinished run in {} is another one ({}); choose another --output, or begin anew with --overwrite",
                path.display(),
                difference.unwrap_or_else(|| format!("of {}", before.dataset.display()))
            ),
        }
    }
    Ok((RunFolder::start(path, &config.to_toml()?, overwrite)?, Start::New(Before::default())))
}

/// Trains in a run folder and writes the bundle to `output`; `None` when it was to stop before the end.
pub(crate) fn train_in<'a>(
    folder: RunFolder,
    config: &RunConfig,
    capture: &'a Capture,
    start: Start<'a>,
    Attempt { device, stop, goes_on }: Attempt<'_>,
    output: &Output,
) -> Result<Option<TrainResult>> {
    let mut folder = folder.forking_at(&config.fork_at);
    let path = folder.path().to_owned();
    keep_points(capture, &path);
    let sizes = config.encoding.sizes(capture);
    let measure = sizes.as_ref().map(EncodedSizes::measure);
    let limits = sizes.as_ref().zip(measure.as_ref()).map(|(sizes, measure)| sizes.probe(measure));
    let before = if let Start::New(before) = start { before } else { Before::default() };
    let trainer = match start {
        Start::New(_) => Trainer::new(capture, config.train)?,
        Start::Resumed => resumed(&folder, config.train, capture, |trainer: &mut Trainer<'_>| {
            trainer.set_device(device.clone());
            let at_checkpoint = RunConfig { train: *trainer.config(), ..config.clone() };
            match config.difference(&at_checkpoint, ["in config.toml", "in the checkpoint"])? {
                None => Ok(()),
                Some(difference) => {
                    bail!("config.toml and the checkpoint disagree: {difference}; write back what the run began with")
                }
            }
        })
        .context(goes_on.with_another_capture())?,
        Start::Forked(trainer) => *trainer,
    };
    let mut trainer = trainer.fitting(limits);
    trainer.set_device(device);
    folder.write_config(&config.to_toml()?)?;
    for at in folder.missed_forks(trainer.iteration())? {
        say!("warning: --fork-at {at} keeps nothing, for the run stands after iteration {}", trainer.iteration());
    }
    let estimate = Estimate::new(capture, &config.train, trainer.iteration(), before);
    let mut progress = Progress::new(trainer.iteration(), config.train.iterations).estimating(estimate);
    let how_to_go_on = goes_on.said(&path);
    let ended =
        to_the_end(&mut folder, &mut trainer, config.checkpoint_every, &how_to_go_on, |folder, trainer, interval| {
            folder.train(trainer, &mut progress, interval, stop)
        })?;
    if ended == Ending::Interrupted {
        return Ok(None);
    }
    let result = write_bundle(&trainer, capture, &config.capture, &config.encoding, output)
        .with_context(|| format!("the training is done and kept; {how_to_go_on}"))?;
    folder.finish(&json(&result)?, config.keep_checkpoints)?;
    Ok(Some(result))
}

/// Does what is left of a run, as `drive` does it; says so where it was interrupted.
pub(super) fn to_the_end<M: Method>(
    folder: &mut RunFolder,
    run: &mut Run<'_, M>,
    checkpoint_every: Option<u32>,
    how_to_go_on: &str,
    drive: impl FnOnce(&mut RunFolder, &mut Run<'_, M>, Interval) -> Result<Ending, RunError>,
) -> Result<Ending> {
    let interval = checkpoint_every.map_or(Interval::Seconds(CHECKPOINT_SECONDS), Interval::Iterations);
    let ending = drive(folder, run, interval).map_err(|error| {
        let stopped = format!("training stopped at iteration {}", run.iteration());
        match error {
            // It would come to the same end again; a device says itself what to do.
            RunError::Train(_) => anyhow::Error::new(error).context(stopped),
            _ => anyhow::Error::new(error).context(format!("{stopped}; to retry, {how_to_go_on}")),
        }
    })?;
    if ending == Ending::Interrupted {
        say!("interrupted after iteration {} of {}; {how_to_go_on}", run.iteration(), run.iterations());
    }
    Ok(ending)
}

/// The run as its newest sound checkpoint has it, or at its start where it was stopped before the first one.
///
/// * `ready`: brings it where it computes, and refuses it where it is not the one that was asked for.
pub(super) fn resumed<'a, M: Method>(
    folder: &RunFolder,
    config: M::Config,
    capture: &'a Capture,
    ready: impl FnOnce(&mut Run<'a, M>) -> Result<()>,
) -> Result<Run<'a, M>> {
    let Some(Resumed { restored, passed_over }) = folder.resume(capture)? else {
        say!("the run in {} has no checkpoint yet; it begins anew", folder.path().display());
        return Ok(Run::new(capture, config)?);
    };
    for fault in passed_over {
        say!("warning: a checkpoint is damaged, so the run goes on from an older one: {fault}");
    }
    let (mut run, then) = (restored.run, restored.written_by);
    ready(&mut run)?;
    let now = run.kernels();
    if then != now {
        say!(
            "warning: the checkpoint was computed with {then}; this is {now}. The run goes on, but will not end in the \
             same bits as there"
        );
    }
    say!("going on after iteration {} of {}", run.iteration(), run.iterations());
    Ok(run)
}
