//! `pocketsplat train --backbone 3dgs`: a capture in, explicit Gaussians out.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use pocketsplat_capture::dataset::{Background, Capture, Split};
use pocketsplat_files::{Output, Outputs, shell_word, unused};
use pocketsplat_gaussians::{Format, Notes};
use pocketsplat_trainer::device::Limits;
use pocketsplat_trainer::explicit::CloudTrainer;
use pocketsplat_trainer::explicit::frame;
use pocketsplat_trainer::train::run::{Ending, LoggedStep, RunError, RunFolder};
use serde::Serialize;

use super::super::capture::{CaptureArgs, background_of};
use super::super::eval::explicit::measure;
use super::super::eval::{Evaluation, Measurements};
use super::super::gaussians::{GaussiansFile, write_gaussians};
use super::super::output::{json, print_or};
use super::super::outputs::gaussians;
use super::super::process::peak_memory_bytes;
use super::super::progress::Progress;
use super::super::stop;
use super::super::train_args::Args;
use super::in_folder::{GoesOn, IN_RUN_AND_ON_COMMAND_LINE, resumed, to_the_end};
use super::loading::{check_size, clear_photographs, keep_points};
use super::result::HeldOut;
use super::summary::Summary;
use crate::config::{EXPLICIT, ExplicitRunConfig, Protocol};
use crate::program;
use crate::say::say;

/// What a finished run reports.
#[derive(Debug, Serialize)]
struct ExplicitResult {
    /// What trained and measured it.
    program: &'static str,
    file: PathBuf,
    file_bytes: usize,
    n_gaussians: usize,
    iterations: u32,
    dropped_steps: u32,
    train_s: f64,
    /// Processor time of all threads.
    train_processor_s: f64,
    iterations_per_s: f64,
    /// Of the steps' time, the share that was spent on waiting for photographs, where they do not lie in memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    photographs_waited_share: Option<f64>,
    background: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    peak_memory_bytes: Option<u64>,
    /// Over the views that are held out for testing, where there are any: as `eval` measures it.
    #[serde(flatten)]
    held_out: Option<HeldOut>,
    protocol: Protocol,
}

impl ExplicitResult {
    /// * `file`: its path as people know it.
    fn summary<'a>(&'a self, file: &'a Path) -> Summary<'a> {
        Summary {
            held_out: self.held_out.as_ref(),
            path: file,
            n_bytes: self.file_bytes,
            level: None,
            peak_memory_bytes: self.peak_memory_bytes,
            train_s: self.train_s,
            train_processor_s: self.train_processor_s,
            photographs_waited_share: self.photographs_waited_share,
            iterations: self.iterations,
            dropped_steps: self.dropped_steps,
            poses: None,
        }
    }
}

pub(super) fn begin(args: &Args) -> Result<ExitCode> {
    let config = args.explicit()?;
    let format = format_of(&config)?;
    let path = args.run_folder(args.named_paths(&config.dataset, &config.output).1)?;
    let output = args.output(&source_of(&config), &config.output, gaussians(format), &path)?;
    RunFolder::check(&path, args.overwrite.is_given())?;
    args.refuse_other_capture(&path, &config.dataset)?;
    // Before the run's files are touched: a capture that does not load must not cost an earlier run its results.
    let capture = load(&config, &path)?;
    let folder = RunFolder::start(&path, &config.to_toml()?, args.overwrite.is_given())?;
    let trainer = CloudTrainer::new(&capture, config.gaussians)?;
    let code = train(args, folder, &config, &capture, trainer, &output)?;
    drop(capture);
    clear_photographs(&path, code);
    Ok(code)
}

pub(super) fn resume(args: &Args, folder: RunFolder) -> Result<ExitCode> {
    let begun = ExplicitRunConfig::parse(&folder.config()?);
    let begun = begun.with_context(|| format!("could not use the config.toml in {}", folder.path().display()))?;
    let config = args.applied_to_explicit(begun.clone())?;
    if let Some(difference) = begun.difference(&config, IN_RUN_AND_ON_COMMAND_LINE)? {
        bail!("the run began with another setting than the command line asks for: {difference}; leave it out");
    }
    let path = folder.path().to_owned();
    let output = args.output(&source_of(&config), &config.output, gaussians(format_of(&config)?), &path)?;
    let capture = load(&config, &path)?;
    let trainer = resumed(&folder, config.gaussians, &capture, |trainer: &mut CloudTrainer<'_>| {
        if *trainer.config() == config.gaussians {
            return Ok(());
        }
        bail!("config.toml and the checkpoint disagree; write back what the run began with")
    })?;
    let code = train(args, folder, &config, &capture, trainer, &output)?;
    drop(capture);
    clear_photographs(&path, code);
    Ok(code)
}

/// The format that the output's name says.
fn format_of(config: &ExplicitRunConfig) -> Result<Format> {
    Format::of_path(&config.output).with_context(|| {
        format!(
            "--backbone {EXPLICIT} writes Gaussians and no bundle: {} has to end in .ply; without it, `train` writes a bundle",
            config.output.display()
        )
    })
}

fn source_of(config: &ExplicitRunConfig) -> CaptureArgs {
    CaptureArgs { dataset: config.dataset.clone(), options: config.capture.clone() }
}

/// * `run`: its folder.
fn load(config: &ExplicitRunConfig, run: &Path) -> Result<Capture> {
    let source = source_of(config);
    // At once: large captures take their time.
    say!("reading {}", config.dataset.display());
    let capture = source.load_to_train(config.gaussians.seed, Some(run), &[run])?;
    check_size(&capture, &Limits::default())?;
    Ok(capture)
}

/// Brings a run to its end in the folder beside its output, from wherever it stands; false when it was interrupted before.
///
/// # Errors
/// Another process works in the folder, or the run in it is not the one that is asked for.
pub(crate) fn trained(
    config: &ExplicitRunConfig,
    capture: &Capture,
    outputs: Outputs,
    stop: &AtomicBool,
) -> Result<bool> {
    let path = RunFolder::beside(&config.output);
    let (folder, trainer) = match RunFolder::reopen(&path) {
        Ok(folder) => {
            refuse_other(&folder.config()?, config, &path)?;
            let trainer = resumed(&folder, config.gaussians, capture, |_: &mut CloudTrainer<'_>| Ok(()))?;
            (folder, trainer)
        }
        Err(RunError::Finished { .. }) if config.output.is_file() => {
            let text = std::fs::read_to_string(path.join("config.toml"));
            refuse_other(&text.with_context(|| format!("could not read {}", path.display()))?, config, &path)?;
            say!("trained before");
            return Ok(true);
        }
        // Finished without its file: somebody removed it.
        Err(RunError::NoRun { .. } | RunError::Finished { .. }) => {
            let folder = RunFolder::start(&path, &config.to_toml()?, false)?;
            (folder, CloudTrainer::new(capture, config.gaussians)?)
        }
        Err(error) => return Err(error.into()),
    };
    let output = outputs.reading_folder(&config.dataset).file(&config.output, gaussians(format_of(config)?))?;
    Ok(train_in(folder, config, capture, trainer, (stop, GoesOn::SameCommand), &output)?.is_some())
}

/// Stops where the run in a folder is not the one that is asked for.
fn refuse_other(begun: &str, config: &ExplicitRunConfig, folder: &Path) -> Result<()> {
    let begun = ExplicitRunConfig::parse(begun)
        .with_context(|| format!("could not use the config.toml in {}", folder.display()))?;
    let of_another = || format!("its capture is {}, not {}", begun.dataset.display(), config.dataset.display());
    match begun.difference(config, IN_RUN_AND_ON_COMMAND_LINE)? {
        None if begun.dataset == config.dataset => Ok(()),
        difference => bail!(
            "the run in {} is not the one that is asked for: {}; choose another --output",
            folder.display(),
            difference.unwrap_or_else(of_another)
        ),
    }
}

fn train(
    args: &Args,
    folder: RunFolder,
    config: &ExplicitRunConfig,
    capture: &Capture,
    trainer: CloudTrainer<'_>,
    output: &Output,
) -> Result<ExitCode> {
    // Not before: until here there is nothing to keep, and Ctrl-C may end the process at once.
    let stop = stop::flag()?;
    let Some(result) =
        train_in(folder, config, capture, trainer, (&stop, GoesOn::Resume(args.trainer.trains_on)), output)?
    else {
        return Ok(ExitCode::from(stop::INTERRUPTED));
    };
    let (_, path) = args.named_paths(&config.dataset, &config.output);
    print_or(&result, args.json, result.summary(path))?;
    if output.is_file() {
        let behind = if result.background == Background::White.to_string() { " --background white" } else { "" };
        let bundle = unused(Path::new("scene.psb"));
        say!("compress it:  pocketsplat import {} -o {}{behind}", shell_word(path), shell_word(&bundle));
    }
    Ok(ExitCode::SUCCESS)
}

/// Trains in a run folder and writes the file; `None` when `stop` was set before the end.
fn train_in(
    mut folder: RunFolder,
    config: &ExplicitRunConfig,
    capture: &Capture,
    mut trainer: CloudTrainer<'_>,
    (stop, goes_on): (&AtomicBool, GoesOn),
    output: &Output,
) -> Result<Option<ExplicitResult>> {
    folder.write_config(&config.to_toml()?)?;
    keep_points(capture, folder.path());
    let how_to_go_on = goes_on.said(folder.path());
    let mut progress = Progress::new(trainer.iteration(), trainer.iterations());
    let ended =
        to_the_end(&mut folder, &mut trainer, config.checkpoint_every, &how_to_go_on, |folder, trainer, interval| {
            folder.drive(trainer, interval, stop, |trainer| {
                let outcome = trainer.advance()?;
                progress.explicit_step(trainer.iteration(), &outcome, trainer.cloud().len());
                let is_dropped = outcome.dropped.is_some();
                Ok(LoggedStep { loss: outcome.loss, squared_error: outcome.squared_error, rate: None, is_dropped })
            })
        })?;
    if ended == Ending::Interrupted {
        return Ok(None);
    }
    let result = write(&trainer, config, capture, output)
        .with_context(|| format!("the training is done and kept; {how_to_go_on}"))?;
    folder.finish(&json(&result)?, config.keep_checkpoints)?;
    Ok(Some(result))
}

fn write(
    trainer: &CloudTrainer<'_>,
    config: &ExplicitRunConfig,
    capture: &Capture,
    output: &Output,
) -> Result<ExplicitResult> {
    let protocol = Protocol::of(capture, &config.capture);
    let notes = GaussiansFile::notes_of(Some(&protocol), capture.train.iter().map(|view| &view.camera))?;
    let notes = Notes { frame: frame::of_normalised(&capture.normalisation), ..notes };
    let format = format_of(config)?;
    let bytes = write_gaussians(format, output, &trainer.gaussians(), &notes)?.bytes;
    let held_out = if capture.test.is_empty() {
        None
    } else {
        // As the file has them, which need not lie anywhere: a FIFO cannot be read again.
        let started = Instant::now();
        let (gaussians, notes) = format.read(&bytes, None)?;
        let read_s = started.elapsed().as_secs_f64();
        let file = GaussiansFile { n_bytes: bytes.len(), gaussians, notes, read_s };
        let Evaluation { psnr_db, cc_psnr_db, ssim, n_views, views, .. } =
            measure(&file, capture, &config.capture, Split::Test, &Measurements::default())?;
        Some(HeldOut { psnr_db, cc_psnr_db, ssim, n_test_views: n_views, views })
    };
    Ok(ExplicitResult {
        program: program::this(),
        file: config.output.clone(),
        file_bytes: bytes.len(),
        n_gaussians: trainer.cloud().len(),
        iterations: trainer.iteration(),
        dropped_steps: trainer.n_dropped(),
        train_s: trainer.seconds(),
        train_processor_s: trainer.processor_seconds(),
        iterations_per_s: f64::from(trainer.iteration()) / trainer.seconds(),
        photographs_waited_share: trainer.waited_share(),
        background: background_of(capture),
        peak_memory_bytes: peak_memory_bytes(),
        held_out,
        protocol,
    })
}
