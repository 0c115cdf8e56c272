//! `pocketsplat tables`: what the runs of a plan came to.

mod comparison;
mod curves;
mod differences;
pub(super) mod finished;
pub(super) mod published;
mod survey;

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use pocketsplat_files::{Content, Outputs};

use super::output;
use super::outputs::{OverwriteArgs, table};
use super::workflow::Plan;
use crate::program;
use published::PublishedRow;

/// What is written whatever the plan trains, within its folder.
pub(super) const FILES: [(&str, Content); 2] =
    [("tables/runs.csv", table(&["run,"])), ("tables/bd_rate.csv", table(&["dataset,"]))];

/// What files in `tables` are called that are of no dataset, without their endings.
pub(super) const OWN_NAMES: [&str; 3] = ["runs", "bd_rate", "comparison"];

/// Tabulate the finished runs of a plan.
///
/// The plan may be unfinished.
///
/// tables/runs.csv has every run; DATASET.csv and DATASET/SCENE.csv the columns of the 3DGS compression survey, means over seeds;
/// bd_rate.csv how many bytes each method takes against the plan's first at equal PSNR, with 95 % intervals over seeds; the .svg files
/// the curves. With published results they stand beside those, and comparison.md says what was not run.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the plan, as `plan-runs` wrote it.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Published results to show beside, as docs/results/published.csv has them [default: those of the plan]
    #[arg(long, value_name = "FILE.csv")]
    published: Option<PathBuf>,
    #[command(flatten)]
    overwrite: OverwriteArgs,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let published = match &args.published {
        Some(given) => Some(given.clone()),
        None => Plan::read(&args.folder)?.merge.published(),
    };
    output::print_text(&write(&args.folder, published.as_deref(), &args.overwrite.outputs())?)
}

/// Writes the tables of what is measured in the folder of a plan, and returns how much that is.
///
/// * `published`: the table of published results, if any.
pub(super) fn write(folder: &Path, published: Option<&Path>, outputs: &Outputs) -> Result<String> {
    let plan = Plan::read(folder)?;
    let mut outputs = published.iter().fold(outputs.clone(), |outputs, path| outputs.reading(path));
    let published = published.map(PublishedRow::read_all).transpose()?.unwrap_or_default();
    let runs = finished::runs(&plan, folder)?;
    if runs.is_empty() {
        bail!(
            "no run of {} is measured yet; train them: `snakemake --cores all` there, or `plan-runs` with --run",
            folder.display()
        );
    }
    let [(all, of_all), (bd_rates, of_rates)] = FILES.map(|(file, content)| (folder.join(file), content));
    outputs.file(&all, of_all)?.write(&output::csv(runs.iter().map(finished::FinishedRun::line))?)?;
    let programs = || runs.iter().map(|run| run.evaluation.program.as_str());
    program::warn_of_several(programs());
    let program = program::of_all(programs());
    let groups = curves::groups(&plan, &runs);
    let mut differences = Vec::new();
    for group in &groups {
        differences.extend(differences::of_group(group));
        survey::write(&folder.join("tables"), group, &published, &mut outputs)?;
    }
    let rates =
        if differences.is_empty() { differences::HEADER.into() } else { output::csv_of(&program, &differences)? };
    outputs.file(&bd_rates, of_rates)?.write(&rates)?;
    if !published.is_empty() {
        let text = comparison::markdown(&groups, &published);
        let page = Content::Text(&["# Published results and ours"], "a comparison (.md)");
        outputs.file(&folder.join("tables/comparison.md"), page)?.write(text.as_bytes())?;
    }
    Ok(format!(
        "{} of {} runs are measured; tables and figures: {}\n",
        runs.len(),
        plan.runs.len(),
        folder.join("tables").display()
    ))
}
