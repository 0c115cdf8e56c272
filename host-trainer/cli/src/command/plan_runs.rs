//! `pocketsplat plan-runs`: many captures at many rates, as a workflow for one machine or many.

mod spec;

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::{Args as _, FromArgMatches as _};

use super::devices::DeviceChoice;
use super::loaded::LoadedCapture;
use super::lpips::LpipsArgs;
use super::outputs::OverwriteArgs;
use super::workflow::{Place, Planner};
use super::{output, tables, train_args};
use crate::config::RunConfig;
use spec::{AskedRun, Spec};

/// Plan many runs as a Snakemake workflow.
///
/// Write a Snakemake workflow that trains, measures and tabulates every combination of a list of captures and options.
///
/// Every run asks for the threads that this command has, and for memory and minutes by its own estimate, which takes a few steps of
/// each kind of run. The workflow ends with `tables`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// What to train: captures, options that all runs share, options that they differ in (docs/many-runs.md).
    spec: PathBuf,
    /// Folder for the workflow, the runs and their tables.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    lpips: LpipsArgs,
    #[command(flatten)]
    overwrite: OverwriteArgs,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let spec = Spec::read(&args.spec)?;
    let folder = std::path::absolute(&args.output).with_context(|| format!("{} is no path", args.output.display()))?;
    let lpips = args.lpips.options()?;
    let outputs = args.overwrite.outputs().reading(&args.spec);
    // All of them before the first capture is loaded.
    let mut asked = Vec::new();
    for run in spec.runs()? {
        let output = folder.join(format!("{}.psb", run.name));
        let (config, device) = configured(&run, output).with_context(|| format!("{} is no run", run.name))?;
        asked.push((run, config, device));
    }
    // Seed by seed, since points drawn at random follow it: each capture is loaded once for each. Sorting keeps the order otherwise.
    asked.sort_by_key(|(run, config, _)| (run.dataset.clone(), run.scene.clone(), config.train.seed));
    let (mut loaded, mut planner) = (LoadedCapture::default(), Planner::default());
    for (run, config, device) in asked {
        let seed = config.train.seed;
        let AskedRun { name, dataset, scene, size, method, rate, .. } = run;
        let place = Place { dataset, scene, size, method, rate, seed };
        planner.add(name, config, device, Some(place), &lpips, &mut loaded)?;
    }
    let mut merge = vec!["tables".to_owned(), folder.display().to_string()];
    if let Some(published) = &spec.published {
        merge.extend(["--published".to_owned(), published.display().to_string()]);
    }
    output::print_text(&planner.write(&folder, merge, &tables::FILES, &outputs)?)
}

/// The configuration that `train` makes of a run's options, and what is to train it.
fn configured(run: &AskedRun, output: PathBuf) -> Result<(RunConfig, DeviceChoice)> {
    let command = train_args::Args::augment_args(clap::Command::new("train")).allow_negative_numbers(true);
    let mut words = vec!["train".to_owned()];
    words.extend(run.options());
    words.extend(["--output".to_owned(), output.display().to_string(), "--".to_owned()]);
    words.push(run.folder.display().to_string());
    let args = command.try_get_matches_from(words).and_then(|matches| train_args::Args::from_arg_matches(&matches));
    let args = args.map_err(|error| anyhow::anyhow!(in_one_line(&error.to_string())))?;
    if args.is_explicit() {
        bail!("--backbone 3dgs makes no bundle; train it with `pocketsplat train` alone");
    }
    let mut config = args.resolved()?;
    if config.effects.auto && !run.says("effects") {
        config.effects.auto = false;
    }
    if config.effects.auto {
        bail!("runs that are compared need the same effects; force them, as effects = \"+view-colour\"");
    }
    Ok((config, args.device_choice()))
}

/// An error of the command line without its usage, which a plan does not have.
fn in_one_line(error: &str) -> String {
    let said = error.trim_start_matches("error: ").lines().map(str::trim).filter(|line| !line.is_empty());
    said.take_while(|line| !line.starts_with("Usage:")).collect::<Vec<_>>().join("; ")
}
