//! `pocketsplat train`: a capture in, a bundle out.

pub(super) mod explicit;
mod in_folder;
mod limits;
mod loading;
pub(super) mod result;
mod run_status;
mod summary;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use pocketsplat_capture::dataset::{Capture, View};
use pocketsplat_files::{Output, shell_word};
use pocketsplat_kernels::step::SharedDevice;
use pocketsplat_trainer::train::run::{RunFolder, fork};

use super::effects::Resolved;
use super::estimate::{Before, Estimate};
use super::gaussians::GaussiansFile;
use super::outputs::BUNDLE;
use super::train_args::Args;
use super::watch::Ending;
use super::{effects, output, poses, report, stop, watch};
use crate::config::{ExplicitRunConfig, RunConfig};
use crate::say::say;
use in_folder::IN_RUN_AND_ON_COMMAND_LINE;
pub(crate) use in_folder::{Attempt, GoesOn, Start, begun_or_new, train_in};
use loading::source_of;
pub(crate) use loading::{clear_photographs, decide, keep_points, load};
pub(crate) use result::{HeldOut, TrainResult};
pub(crate) use run_status::RunStatus;
use summary::Summary;

pub(crate) fn run(mut args: Args) -> Result<ExitCode> {
    if args.poses {
        let Some(capture) = poses_of(&args)? else { return Ok(ExitCode::from(stop::INTERRUPTED)) };
        args.dataset = Some(capture);
    }
    let args = &args;
    match args.resume.as_deref() {
        Some(path) => resume(args, path),
        None if args.dry_run => dry_run(args),
        None if args.quality.is_explicit() => explicit::begin(args),
        None if args.continues => begin_or_go_on(args),
        None => begin(args),
    }
}

/// The capture that photographs or a film become; `None` where that was stopped.
fn poses_of(args: &Args) -> Result<Option<PathBuf>> {
    let none = Path::new("");
    let (photographs, output) = args.named_paths(none, none);
    // What would refuse the run must not do so after hours.
    let run = args.run_folder(output)?;
    RunFolder::check(&run, args.overwrite.is_given())?;
    if !args.quality.is_explicit() {
        let config = args.resolved()?;
        args.output(&source_of(&config), &config.output, BUNDLE, &run)?;
    }
    poses::capture_to_train(photographs, output)
}

fn resume(args: &Args, path: &Path) -> Result<ExitCode> {
    let folder = RunFolder::reopen(path)?;
    if ExplicitRunConfig::is_one(&folder.config()?) {
        return explicit::resume(args, folder);
    }
    let begun = RunConfig::parse(&folder.config()?);
    let begun = begun.with_context(|| format!("could not use the config.toml in {}", path.display()))?;
    if GaussiansFile::is_trained_on(&begun) {
        bail!("the run in {} is of `pocketsplat import`; give that command again, and it goes on", path.display());
    }
    let mut config = args.applied_to(begun.clone())?;
    if let Some(difference) = begun.difference(&config, IN_RUN_AND_ON_COMMAND_LINE)? {
        bail!("the run began with another setting than the command line asks for: {difference}; leave it out");
    }
    // What a run was asked to keep for forks stays.
    config.fork_at.extend(&begun.fork_at);
    config.fork_at.sort_unstable();
    config.fork_at.dedup();
    config.check()?;
    // What was chosen stays; what an accident kept from being chosen is measured now.
    config.effects = begun.effects;
    let output = args.output(&source_of(&config), &config.output, BUNDLE, folder.path())?;
    let capture = load(&mut config, Some(folder.path()), None)?;
    let path = folder.path().to_owned();
    let code = train_and_print(args, folder, config, &capture, Start::Resumed, Machine::open(args)?, &output)?;
    drop(capture);
    clear_photographs(&path, code);
    Ok(code)
}

fn begin(args: &Args) -> Result<ExitCode> {
    let mut config = args.resolved()?;
    let path = args.run_folder(args.named_paths(&config.dataset, &config.output).1)?;
    let output = args.output(&source_of(&config), &config.output, BUNDLE, &path)?;
    RunFolder::check(&path, args.overwrite.is_given())?;
    args.refuse_other_capture(&path, &config.dataset)?;
    // Before the run's files are touched, all that may fail: it must not cost an earlier run its results.
    let capture = load(&mut config, Some(&path), args.fork().map(|(run, _)| run))?;
    let start = match args.fork() {
        Some((run, _)) if run.canonicalize().ok() == path.canonicalize().ok() => {
            bail!("{} cannot be both the run to begin from and the new one; choose another --output", path.display())
        }
        Some(_) if effects::are_measured(&config, &capture) => {
            bail!("a fork keeps the effects of its run; leave out --effects auto")
        }
        Some((run, iteration)) => {
            let trainer = fork(run, iteration, &capture, config.train)?;
            say!("going on after iteration {iteration} of {}", run.display());
            Start::Forked(Box::new(trainer))
        }
        None => Start::New(Before::default()),
    };
    let machine = Machine::open(args)?;
    let (overwrite, toml) = (args.overwrite.is_given(), config.to_toml()?);
    let folder = match &start {
        Start::Forked(trainer) => RunFolder::start_from(&path, &toml, overwrite, &**trainer)?,
        _ => RunFolder::start(&path, &toml, overwrite)?,
    };
    let code = train_and_print(args, folder, config, &capture, start, machine, &output)?;
    drop(capture);
    clear_photographs(&path, code);
    Ok(code)
}

/// Says what a run would do; of files nothing is touched.
fn dry_run(args: &Args) -> Result<ExitCode> {
    if args.quality.is_explicit() {
        bail!("--dry-run is for scenes of anchors; leave out --backbone 3dgs");
    }
    let mut config = args.resolved()?;
    let capture = load(&mut config, None, None)?;
    let (with_pilots, stop) = (effects::are_measured(&config, &capture), stop::flag()?);
    Estimate::try_out(&capture, &config.train, with_pilots, args.trainer.trains_on.open()?, &stop)?;
    // What is not measured is decided.
    config.effects.auto &= with_pilots;
    output::print_text(&config.to_toml()?)?;
    Ok(ExitCode::SUCCESS)
}

/// Does what is left of a run, which may be all of it or nothing.
fn begin_or_go_on(args: &Args) -> Result<ExitCode> {
    let mut config = args.resolved()?;
    if config.effects.auto {
        bail!("--continue needs effects that are decided; force them, as --effects +view-colour");
    }
    let path = args.run_folder(args.named_paths(&config.dataset, &config.output).1)?;
    let output = args.output(&source_of(&config), &config.output, BUNDLE, &path)?;
    let capture = load(&mut config, Some(&path), None)?;
    let code = match RunStatus::of(&path, &config)? {
        RunStatus::New(folder) => {
            let start = Start::New(Before::default());
            train_and_print(args, folder, config, &capture, start, Machine::open(args)?, &output)?
        }
        RunStatus::Begun(folder) => {
            train_and_print(args, folder, config, &capture, Start::Resumed, Machine::open(args)?, &output)?
        }
        RunStatus::Finished => {
            say!("trained before");
            ExitCode::SUCCESS
        }
    };
    drop(capture);
    clear_photographs(&path, code);
    Ok(code)
}

/// The GPU and the port of a run. Either may fail to open, so both are opened before the files of an earlier run are touched.
struct Machine {
    /// The GPU that trains, where one does.
    device: Option<SharedDevice<f32>>,
    /// The port of the page about the run, where there is one.
    port: Option<watch::Port>,
}

impl Machine {
    fn open(args: &Args) -> Result<Self> {
        Ok(Self { device: args.trainer.trains_on.open()?, port: args.watch.map(watch::Port::open).transpose()? })
    }
}

fn train_and_print<'a>(
    args: &Args,
    folder: RunFolder,
    config: RunConfig,
    capture: &'a Capture,
    start: Start<'a>,
    Machine { device, port }: Machine,
    output: &Output,
) -> Result<ExitCode> {
    let watched = match port {
        Some(port) => {
            let photograph = capture.test.first().or(capture.train.first()).map(View::photograph).transpose()?;
            let image = photograph.as_ref().map(|photograph| &photograph.image);
            Some(port.serve(folder.path(), &config.train, image)?)
        }
        None => None,
    };
    let ended = train_watched(args, folder, config, capture, start, device, output);
    if let Some(watched) = watched {
        watched.end(match &ended {
            Ok(Ended::Finished { report }) => Ending::Finished { report: report.clone() },
            Ok(Ended::Interrupted) => Ending::Stopped("it was interrupted".to_owned()),
            Err(error) => Ending::Stopped(format!("{error:#}")),
        });
    }
    Ok(match ended? {
        Ended::Finished { .. } => ExitCode::SUCCESS,
        Ended::Interrupted => ExitCode::from(stop::INTERRUPTED),
    })
}

/// How a run ended, if not by an error.
enum Ended {
    Finished {
        /// The page about it, where there is one.
        report: Option<PathBuf>,
    },
    Interrupted,
}

fn train_watched<'a>(
    args: &Args,
    folder: RunFolder,
    mut config: RunConfig,
    capture: &'a Capture,
    start: Start<'a>,
    device: Option<SharedDevice<f32>>,
    output: &Output,
) -> Result<Ended> {
    // Not before: until here nothing is lost that a second call would not make, and Ctrl-C may end the process at once.
    let stop = stop::flag()?;
    // Before the pilots: they may take hours too.
    let start = match start {
        Start::New(_) => {
            let with_pilots = effects::are_measured(&config, capture);
            Start::New(Estimate::try_out(capture, &config.train, with_pilots, device.clone(), &stop)?)
        }
        other => other,
    };
    let path = folder.path().to_owned();
    let attempt = Attempt { device, stop: &stop, goes_on: GoesOn::Resume(args.trainer.trains_on) };
    if effects::resolve(&mut config, capture, &folder, &attempt)? == Resolved::Interrupted {
        return Ok(Ended::Interrupted);
    }
    let Some(result) = train_in(folder, &config, capture, start, attempt, output)? else {
        return Ok(Ended::Interrupted);
    };
    let (dataset, bundle) = args.named_paths(&config.dataset, &config.output);
    // A result that nobody gets costs the run no report.
    let printed = output::print_or(&result, args.json, Summary::of(&result, bundle));
    // What went through a device or a FIFO cannot be read again.
    if !output.is_file() {
        return printed.map(|()| Ended::Finished { report: None });
    }
    let report = if !args.no_report { report::write_into(&path, &config, capture) } else { None };
    let split = if capture.test.is_empty() { " --split train" } else { "" };
    let (bundle, dataset) = (shell_word(bundle), shell_word(dataset));
    say!("see it:       pocketsplat render {bundle} {dataset} --view 0{split} -o view.png");
    say!("on a device:  pocketsplat fit {bundle}");
    printed.map(|()| Ended::Finished { report })
}
