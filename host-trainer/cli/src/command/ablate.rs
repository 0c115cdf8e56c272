//! `pocketsplat ablate`: what each module is worth on a capture.

mod comparison;
mod rows;

use std::process::ExitCode;

use anyhow::{Result, bail};
use pocketsplat_trainer::train::TrainConfig;
use pocketsplat_trainer::train::modules::Modules;

use super::output;
use super::outputs::table;
use super::runs::{FIGURE, RunSpec, RunsArgs, write_curves};
use crate::config::RunConfig;
use crate::config::heading::{QUALITY, RUN};
use crate::program;
use comparison::{comparisons, run_lines};
use rows::{BASELINE, Extent, Row, rows};

/// Compare training modules: none, each, all.
///
/// The rows are trained at several rates, the options of the modules at one.
///
/// Every run and every measurement is kept in the folder: the same command again resumes where it was interrupted, and one
/// with more rows or rates trains those alone. After each run ablation.csv and summary.csv hold what is known of the rows
/// asked for, rate_distortion.svg the curves.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    runs: RunsArgs,
    /// Rate weights; options and seeds are compared at the second, or the only one.
    #[arg(long = "lambda", value_name = "X,…", value_delimiter = ',', default_values_t = [0.004, 0.002, 0.001, 0.0005],
        help_heading = QUALITY)]
    lambdas: Vec<f64>,
    /// Rows to train beside `none`, by name, where a trailing * stands for anything [default: all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', help_heading = RUN)]
    rows: Vec<String>,
    /// List the rows and stop.
    #[arg(long, exclusive = true, help_heading = RUN)]
    list: bool,
    /// Seeds that `none`, `all` and `rdo` are trained with, to show what a seed alone changes.
    #[arg(long, default_value_t = 3, help_heading = RUN)]
    seeds: u64,
}

pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    if args.list {
        let rows = rows(&TrainConfig::default().shape);
        let lines = rows.iter().map(|row| format!("{:24} {}\n", row.name, row.what)).collect::<String>();
        return output::print_text(&lines).map(|()| ExitCode::SUCCESS);
    }
    let base = args.runs.base()?;
    if base.train.modules != Modules::default() {
        bail!("the rows of an ablation attach the modules; leave --modules and --effects +detail out");
    }
    // Without a rate there is nothing to vary.
    let lambdas = if base.train.backbone.is_coded() { args.lambdas.as_slice() } else { &args.lambdas[..1] };
    let option_lambda = lambdas[usize::from(lambdas.len() > 1)];
    let specs = args.specs(&base, lambdas, option_lambda)?;
    let folder = base.output.clone();
    let files = [("ablation.csv", table(&["row,"])), ("summary.csv", table(&["row,"])), FIGURE];
    args.runs.train(&base, &specs, &files, |runs, outputs| {
        write_curves(&folder, runs, outputs)?;
        let [(ablation, of_ablation), (summary, of_summary), _] = files;
        outputs.file(&folder.join(ablation), of_ablation)?.write(&output::csv(run_lines(runs))?)?;
        let summary_file = outputs.file(&folder.join(summary), of_summary)?;
        let program = program::of_all(runs.iter().map(|run| run.evaluation.program.as_str()));
        let summary = output::csv_of(&program, comparisons(runs, option_lambda))?;
        summary_file.write(&summary)?;
        Ok(summary)
    })
}

impl Args {
    /// All runs, the curves first, then seeds, then options.
    fn specs(&self, base: &RunConfig, lambdas: &[f64], option_lambda: f64) -> Result<Vec<RunSpec>> {
        let is_named = |row: &Row, name: &str| match name.strip_suffix('*') {
            Some(start) => row.name.starts_with(start),
            None => row.name == name,
        };
        let mut chosen = rows(&base.train.shape);
        if let Some(unknown) = self.rows.iter().find(|name| !chosen.iter().any(|row| is_named(row, name))) {
            bail!("there is no row {unknown}; --list names all");
        }
        // Every row is compared with the baseline.
        chosen.retain(|row| {
            self.rows.is_empty() || row.name == BASELINE || self.rows.iter().any(|name| is_named(row, name))
        });
        let first_seed = base.train.seed;
        let spec = |row: &Row, lambda: f64, seed: u64| RunSpec {
            row: row.name,
            lambda,
            seed,
            on_curve: row.extent != Extent::Option && seed == first_seed,
            bundle: match seed == first_seed {
                true => format!("{}/lambda-{lambda}.psb", row.name),
                false => format!("{}/lambda-{lambda}-seed-{seed}.psb", row.name),
            },
            overrides: row.overrides.clone(),
        };
        let (options, curves): (Vec<&Row>, Vec<&Row>) = chosen.iter().partition(|row| row.extent == Extent::Option);
        let mut specs = Vec::new();
        for row in &curves {
            specs.extend(lambdas.iter().map(|lambda| spec(row, *lambda, first_seed)));
        }
        for seed in 1..self.seeds {
            let seeded = curves.iter().filter(|row| row.extent == Extent::SeededCurve);
            specs.extend(seeded.map(|row| spec(row, option_lambda, first_seed + seed)));
        }
        specs.extend(options.iter().map(|row| spec(row, option_lambda, first_seed)));
        Ok(specs)
    }
}
