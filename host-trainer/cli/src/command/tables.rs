//! `pocketsplat tables`: what the runs of a plan came to.

mod comparison;
mod curves;
mod differences;
mod finished;
mod published;
mod survey;

use std::path::PathBuf;

use anyhow::{Result, bail};

use super::output;
use super::workflow::Plan;
use published::PublishedRow;

/// What is written whatever the plan trains, within its folder.
pub(super) const FILES: [&str; 2] = ["tables/runs.csv", "tables/bd_rate.csv"];

/// Make tables and figures of the finished runs of a plan; it may be unfinished.
///
/// tables/runs.csv has every run; DATASET.csv and DATASET/SCENE.csv the columns of the 3DGS compression survey, means over seeds;
/// bd_rate.csv how many bytes each method takes against the plan's first at equal PSNR, with 95 % intervals over seeds; the .svg files
/// the curves. With --published they stand beside published results, and comparison.md says what was not run.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the plan, as `plan-runs` wrote it.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Published results to show beside, as docs/results/published.csv has them.
    #[arg(long, value_name = "FILE.csv")]
    published: Option<PathBuf>,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let plan = Plan::read(&args.folder)?;
    let published = args.published.as_deref().map(PublishedRow::read_all).transpose()?.unwrap_or_default();
    let runs = finished::runs(&plan, &args.folder)?;
    if runs.is_empty() {
        bail!("no run of {} is measured yet; train them: snakemake --cores all", args.folder.display());
    }
    let [all, bd_rates] = FILES.map(|file| args.folder.join(file));
    output::check_writable(&all)?;
    output::write_whole(&all, &output::csv(runs.iter().map(finished::FinishedRun::line))?)?;
    let groups = curves::groups(&plan, &runs);
    let mut differences = Vec::new();
    for group in &groups {
        differences.extend(differences::of_group(group));
        survey::write(&args.folder.join("tables"), group, &published)?;
    }
    output::write_whole(&bd_rates, &output::csv(&differences)?)?;
    if !published.is_empty() {
        let text = comparison::markdown(&groups, &published);
        output::write_whole(&args.folder.join("tables/comparison.md"), text.as_bytes())?;
    }
    output::print_text(&format!(
        "{} of {} runs are measured; tables and figures: {}\n",
        runs.len(),
        plan.runs.len(),
        args.folder.join("tables").display()
    ))
}
