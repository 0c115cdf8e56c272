//! `pocketsplat plan-runs`: many captures at many rates, as a workflow for one machine or many.

mod spec;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::{Args as _, FromArgMatches as _};
use pocketsplat_files::{Outputs, shell_word};
use pocketsplat_metrics::Lpips;

use super::devices::DeviceChoice;
use super::loaded::LoadedCapture;
use super::lpips::LpipsArgs;
use super::outputs::{BUNDLE, OverwriteArgs};
use super::tables::published::PublishedRow;
use super::workflow::{PUBLISHED, Place, Planner};
use super::{output, point, stop, tables, train, train_args};
use crate::config::{RunConfig, absolute};
use crate::program;
use crate::say::say;
use spec::{AskedRun, Spec};

/// Train many captures with many options, here or as a workflow.
///
/// Writes a Snakemake workflow that trains, measures and tabulates every combination of captures and options; with --run does all of it
/// here, without Snakemake.
///
/// The same command again goes on where it was stopped, and trains nothing twice but a few steps of each kind of run, which the estimate
/// takes. Every run of a workflow asks for the threads that this command has, and for memory and minutes by its own estimate. The
/// workflow ends with `tables`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// What to train: captures, options that all runs share, options that they differ in (docs/many-runs.md).
    spec: PathBuf,
    /// Folder for the workflow, the runs and their tables.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Train, measure and tabulate the runs here, one after another.
    #[arg(long)]
    run: bool,
    #[command(flatten)]
    lpips: LpipsArgs,
    #[command(flatten)]
    overwrite: OverwriteArgs,
}

pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    let spec = Spec::read(&args.spec)?;
    let folder = absolute(&args.output)?;
    // What the workflow names besides: where it is called, and this program.
    for path in std::iter::once(PathBuf::from(".")).chain(program::path()) {
        absolute(&path)?;
    }
    let (lpips, network) = (args.lpips.options()?, args.lpips.load()?);
    let published = spec.published.as_deref().map(PublishedRow::read_all).transpose()?;
    let outputs = args.overwrite.outputs().reading(&args.spec);
    // All of them before the first capture is loaded.
    let mut asked = Vec::new();
    for run in spec.runs()? {
        let output = folder.join(format!("{}.psb", run.name));
        let (config, device) = configured(&run, output).with_context(|| format!("{} is no run", run.name))?;
        asked.push((run, config, device));
    }
    if let Some(published) = &published {
        warn_of_unpublished(&asked.iter().map(|(run, ..)| [&*run.dataset, &*run.scene]).collect(), published);
    }
    // Seed by seed, since points drawn at random follow it. Sorting keeps the order otherwise.
    asked.sort_by_key(|(run, config, _)| (run.dataset.clone(), run.scene.clone(), config.train.seed));
    let (mut loaded, mut planner) = (LoadedCapture::default(), Planner::default());
    for (run, config, device) in asked {
        let seed = config.train.seed;
        let AskedRun { name, dataset, scene, size, method, rate, .. } = run;
        let place = Place { dataset, scene, size, method, rate, seed };
        planner.add(name, config, device, place, &lpips, &mut loaded)?;
    }
    // Never two captures in memory.
    drop(loaded);
    let mut merge = vec!["tables".to_owned(), folder.display().to_string()];
    if let Some(published) = &spec.published {
        merge.extend([PUBLISHED.to_owned(), published.display().to_string()]);
    }
    planner.write(&folder, merge, &tables::FILES, &outputs)?;
    if args.run {
        return run_here(&planner, &folder, &spec, network.as_ref(), &outputs);
    }
    output::print_text(&format!(
        "{}\ntrain them:  cd {} && snakemake --cores all\n",
        planner.size(),
        shell_word(&folder)
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// Trains and measures what is not yet; after each run the tables hold what is there.
fn run_here(
    planner: &Planner,
    folder: &Path,
    spec: &Spec,
    lpips: Option<&Lpips>,
    outputs: &Outputs,
) -> Result<ExitCode> {
    // All of them before the first is trained for an hour.
    for (_, config, _) in planner.runs() {
        outputs.clone().file(&config.output, BUNDLE)?;
    }
    say!("{}", planner.size());
    let (stop, n) = (stop::flag()?, planner.runs().count());
    let mut loaded = LoadedCapture::for_training(folder.to_owned());
    for (i, (name, config, device)) in planner.runs().enumerate() {
        say!("{} of {n}  {name}", i + 1);
        let mut config = config.clone();
        let capture = loaded.of(&mut config)?;
        if !point::trained(&config, capture, device, &stop)? {
            say!("the same command again resumes here");
            return Ok(ExitCode::from(stop::INTERRUPTED));
        }
        point::measured(&config, lpips)?;
        tables::write(folder, spec.published.as_deref(), outputs)?;
    }
    drop(loaded);
    train::clear_photographs(folder, ExitCode::SUCCESS);
    output::print_text(&tables::write(folder, spec.published.as_deref(), outputs)?)?;
    Ok(ExitCode::SUCCESS)
}

/// Warns of scenes that are published under another name, or not at all.
fn warn_of_unpublished(places: &BTreeSet<[&str; 2]>, published: &[PublishedRow]) {
    for [dataset, scene] in places {
        if !published.iter().any(|row| (&*row.dataset, &*row.scene) == (*dataset, *scene)) {
            say!(
                "warning: no published result is of {dataset} {scene}; call datasets and scenes as the table of published results does, or \
                 leave `published` out"
            );
        }
    }
}

/// The configuration that `train` makes of a run's options, and what is to train it.
fn configured(run: &AskedRun, output: PathBuf) -> Result<(RunConfig, DeviceChoice)> {
    let args = args_of_train(run.options(), &run.folder, &output)?;
    if args.quality.is_explicit() {
        bail!("--backbone 3dgs makes no bundle; train it with `pocketsplat train` alone");
    }
    let mut config = args.resolved()?;
    if config.effects.auto && !run.says("effects") {
        config.effects.auto = false;
    }
    if config.effects.auto {
        bail!("runs that are compared need the same effects; force them, as effects = \"+view-colour\"");
    }
    Ok((config, args.trainer.trains_on))
}

/// The command line of `train` with these options.
pub(super) fn args_of_train(options: Vec<String>, capture: &Path, output: &Path) -> Result<train_args::Args> {
    let command = train_args::Args::augment_args(clap::Command::new("train")).allow_negative_numbers(true);
    let mut words = vec!["train".to_owned()];
    words.extend(options);
    words.extend(["--output".to_owned(), output.display().to_string(), "--".to_owned()]);
    words.push(capture.display().to_string());
    let args = command.try_get_matches_from(words).and_then(|matches| train_args::Args::from_arg_matches(&matches));
    args.map_err(|error| anyhow::anyhow!(in_one_line(&error.to_string())))
}

/// An error of the command line without its usage, which a plan does not have.
fn in_one_line(error: &str) -> String {
    let said = error.trim_start_matches("error: ").lines().map(str::trim).filter(|line| !line.is_empty());
    said.take_while(|line| !line.starts_with("Usage:")).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn the_plans_that_lie_ready_can_be_trained() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/plans");
        for (name, n_runs, n_methods) in [
            ("rates.toml", 12, 1),
            ("modules.toml", 84, 7),
            ("synthetic_nerf.toml", 12, 1),
            ("photographs.toml", 156, 1),
        ] {
            let runs = Spec::read(&folder.join(name)).unwrap().runs().unwrap();
            let mut methods: Vec<&str> = runs.iter().map(|run| run.method.as_str()).collect();
            methods.sort_unstable();
            methods.dedup();
            assert_eq!((runs.len(), methods.len()), (n_runs, n_methods), "{name}: {methods:?}");
            for run in &runs {
                configured(run, PathBuf::from("a.psb")).unwrap();
            }
        }
    }
}
