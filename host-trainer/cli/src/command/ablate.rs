//! `pocketsplat ablate`: what each module is worth on a capture.

mod results;
mod rows;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use pocketsplat_trainer::train::TrainConfig;
use pocketsplat_trainer::train::config::Backbone;
use pocketsplat_trainer::train::module::Modules;

use super::capture::Split;
use super::lpips::LpipsArgs;
use super::settings::{QualityOptions, RunOptions, applied};
use super::{output, point, stop, train};
use crate::config::heading::{OUTPUT, QUALITY, RUN};
use crate::config::{CaptureOptions, RunConfig};
use results::Results;
use rows::{Row, rows};

/// Train a capture without modules, with each alone and with all, at several rates, and with their options at one.
///
/// Every run and every measurement is kept in the folder: the same command again goes on where it was interrupted, and more
/// rows or rates add to what is there. After each run ablation.csv and summary.csv hold the results so far,
/// rate_distortion.svg the curves.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the capture.
    #[arg(required_unless_present = "config")]
    dataset: Option<PathBuf>,
    #[command(flatten)]
    capture: CaptureOptions,
    /// Folder for the runs and the results.
    #[arg(short, long, value_name = "DIR", help_heading = OUTPUT)]
    output: PathBuf,
    #[command(flatten)]
    quality: QualityOptions,
    /// Weights of a value's bits in the loss; options and seeds are compared at the second, or the only one.
    #[arg(long = "lambda", value_name = "X,…", value_delimiter = ',', default_values_t = [0.004, 0.002, 0.001, 0.0005],
        help_heading = QUALITY)]
    lambdas: Vec<f64>,
    /// Rows to train, by name, where a trailing * stands for anything [default: all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', help_heading = RUN)]
    rows: Vec<String>,
    /// List the rows and stop.
    #[arg(long, help_heading = RUN)]
    list: bool,
    /// Seeds that `none` and `all` are trained with, to show what a seed alone changes.
    #[arg(long, default_value_t = 3, help_heading = RUN)]
    seeds: u64,
    /// Configuration to read, as a run folder has it; options beside it count more.
    #[arg(long, value_name = "FILE.toml", help_heading = RUN)]
    config: Option<PathBuf>,
    #[command(flatten)]
    run: RunOptions,
    #[command(flatten)]
    lpips: LpipsArgs,
}

/// One run of the plan.
struct Run {
    row: &'static str,
    lambda: f64,
    seed: u64,
    config: RunConfig,
}

pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    if args.list {
        let lines = rows().iter().map(|row| format!("{:24} {}\n", row.name, row.what)).collect::<String>();
        return output::print_text(&lines).map(|()| ExitCode::SUCCESS);
    }
    let mut base = args.base()?;
    let lpips = args.lpips.load()?;
    output::check_writable(&args.output.join("ablation.csv"))?;
    let capture = train::load(&mut base)?;
    Split::Test.views(&capture).context("an ablation measures on held-out views; see --test-every")?;
    let plan = args.plan(&base)?;
    let stop = stop::flag()?;
    let mut results = Results::new(args.output.clone(), args.option_lambda(), base.train.seed);
    for (i, run) in plan.iter().enumerate() {
        eprintln!("{} of {}  {}, lambda {}, seed {}", i + 1, plan.len(), run.row, run.lambda, run.seed);
        if let Some(folder) = run.config.output.parent() {
            std::fs::create_dir_all(folder).with_context(|| format!("could not make {}", folder.display()))?;
        }
        if !point::trained(&run.config, &capture, &stop)? {
            eprintln!("the same command again goes on with the ablation");
            return Ok(ExitCode::from(stop::INTERRUPTED));
        }
        let evaluation = point::measured(&run.config, lpips.as_ref())?;
        results.add(run.row, run.lambda, run.seed, &evaluation);
        results.write()?;
    }
    output::print_text(&results.summary_text()?)?;
    Ok(ExitCode::SUCCESS)
}

impl Args {
    /// What all runs share; its output is the folder of theirs.
    fn base(&self) -> Result<RunConfig> {
        let base = match &self.config {
            Some(path) => RunConfig::read(path)?,
            None => RunConfig { train: TrainConfig::of(Backbone::Hac), ..RunConfig::default() },
        };
        let base = point::base(base, self.dataset.as_deref(), &self.output)?;
        let base = applied(&self.capture, &self.quality, &self.run, base)?;
        if base.train.modules != Modules::default() {
            bail!("the rows of an ablation attach the modules; leave --modules and --effects +detail out");
        }
        point::check_effects(&base)?;
        point::check_distinct(&self.lambdas)?;
        Ok(base)
    }

    /// Where options and seeds are compared.
    fn option_lambda(&self) -> f64 {
        self.lambdas[usize::from(self.lambdas.len() > 1)]
    }

    /// All runs, the curves first, then seeds, then options.
    fn plan(&self, base: &RunConfig) -> Result<Vec<Run>> {
        let all = rows();
        let wanted = |row: &&Row| {
            self.rows.is_empty()
                || self.rows.iter().any(|name| match name.strip_suffix('*') {
                    Some(start) => row.name.starts_with(start),
                    None => row.name == name,
                })
        };
        let chosen: Vec<&Row> = all.iter().filter(wanted).collect();
        if chosen.is_empty() {
            bail!("there is no row {}; --list names all", self.rows.join(", "));
        }
        // Without a rate there is nothing to vary.
        let lambdas = if base.train.backbone == Backbone::Hac { self.lambdas.as_slice() } else { &self.lambdas[..1] };
        let mut plan = Vec::new();
        for row in chosen.iter().filter(|row| row.at_all_rates) {
            for lambda in lambdas {
                plan.push(run_of(base, row, *lambda, base.train.seed)?);
            }
        }
        let at = if lambdas.len() > 1 { self.option_lambda() } else { lambdas[0] };
        for seed in 1..self.seeds {
            for row in chosen.iter().filter(|row| row.with_seeds) {
                plan.push(run_of(base, row, at, base.train.seed + seed)?);
            }
        }
        for row in chosen.iter().filter(|row| !row.at_all_rates) {
            plan.push(run_of(base, row, at, base.train.seed)?);
        }
        // All of them before the first is trained for an hour.
        plan.iter()
            .try_for_each(|run| run.config.check().with_context(|| format!("the row {} cannot be trained", run.row)))?;
        Ok(plan)
    }
}

/// A run in `DIR/ROW/`, named as `sweep` names its points where the seed is the first.
fn run_of(base: &RunConfig, row: &Row, lambda: f64, seed: u64) -> Result<Run> {
    let mut config = row.applied_to(base)?;
    config.train.hac.lambda = lambda;
    let seeded = if seed == base.train.seed { String::new() } else { format!("-seed-{seed}") };
    config.train.seed = seed;
    config.output = base.output.join(row.name).join(format!("lambda-{lambda}{seeded}.psb"));
    // As a run keeps it.
    config.train.shape = config.train.modules.shape(config.train.shape);
    Ok(Run { row: row.name, lambda, seed, config })
}
