//! `pocketsplat sweep`: the same capture at several rates, measured.

use std::process::ExitCode;

use anyhow::{Result, bail};

use super::outputs::RESULTS;
use super::runs::{FIGURE, RunSpec, RunsArgs, write_curves};
use crate::config::heading::QUALITY;

/// Train at several rates and tabulate size and quality.
///
/// After each run results.csv and rate_distortion.svg in the folder hold the results so far. The same command again
/// resumes what was interrupted and trains nothing twice.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    runs: RunsArgs,
    /// Rate weights, one run each: a larger one makes smaller files.
    #[arg(long = "lambda", value_name = "X,…", value_delimiter = ',', required = true, help_heading = QUALITY)]
    lambdas: Vec<f64>,
}

pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    let base = args.runs.base()?;
    if !base.train.backbone.is_coded() {
        bail!("a sweep varies the weight of the bits, and they have none in this configuration; use --backbone hac");
    }
    let spec = |&lambda: &f64| RunSpec {
        row: "results",
        lambda,
        seed: base.train.seed,
        on_curve: true,
        bundle: format!("lambda-{lambda}.psb"),
        overrides: Vec::new(),
    };
    let specs: Vec<RunSpec> = args.lambdas.iter().map(spec).collect();
    let folder = base.output.clone();
    args.runs
        .train(&base, &specs, &[("results.csv", RESULTS), FIGURE], |runs, outputs| write_curves(&folder, runs, outputs))
}
