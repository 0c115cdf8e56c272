//! `pocketsplat ablate`: what each module is worth on a capture.

mod rows;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use pocketsplat::metrics::{RateDifference, RatePoint, bd_psnr_db, bd_rate_percent, rate_difference};
use pocketsplat::plot::{Named, ResultRow, SizeAxis, rate_distortion_svg, results_csv};
use pocketsplat::train::TrainConfig;
use pocketsplat::train::config::Backbone;
use serde::Serialize;

use super::capture::Split;
use super::eval::Evaluation;
use super::lpips::{LpipsArgs, NO_WEIGHTS};
use super::run_config::RunConfig;
use super::settings::Settings;
use super::{output, point, stop, train};
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
    /// Folder for the runs and the results.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Weights of a value's bits in the loss; options and seeds are compared at the second, or the only one.
    #[arg(long = "lambda", value_name = "X,…", value_delimiter = ',', default_values_t = [0.004, 0.002, 0.001, 0.0005])]
    lambdas: Vec<f64>,
    /// Seeds that `none` and `all` are trained with at that rate, so that it is known what a seed alone changes.
    #[arg(long, default_value_t = 3)]
    seeds: u64,
    /// Only these rows, by name; a trailing * stands for anything.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    rows: Vec<String>,
    /// List the rows and stop.
    #[arg(long)]
    list: bool,
    /// Read the configuration, as a run folder has it; options given beside it count more.
    #[arg(long, value_name = "FILE.toml")]
    config: Option<PathBuf>,
    #[command(flatten)]
    settings: Settings,
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

/// One line of ablation.csv.
#[derive(Serialize)]
struct Line {
    row: &'static str,
    lambda: f64,
    seed: u64,
    #[serde(rename = "PSNR")]
    psnr_db: f64,
    #[serde(rename = "SSIM")]
    ssim: f64,
    #[serde(rename = "LPIPS")]
    lpips: Option<f64>,
    #[serde(rename = "Size [Bytes]")]
    size_bytes: usize,
    anchors: u32,
    #[serde(rename = "#Gaussians")]
    gaussians: u64,
    decode_s: f64,
    render_s: f64,
    /// Where the run is tiered: `rate:dB` of each tier.
    tiers: String,
}

/// One line of summary.csv: a row against `none`.
#[derive(Serialize)]
struct Comparison {
    row: &'static str,
    /// Over the rates that both have.
    bd_rate_percent: Option<f64>,
    bd_psnr_db: Option<f64>,
    /// At the rate of the options, at equal quality; with its 95 % interval where there are seeds.
    rate_percent: Option<f64>,
    rate_low_percent: Option<f64>,
    rate_high_percent: Option<f64>,
    /// At the rate of the options, first seed.
    psnr_difference_db: Option<f64>,
    bytes_percent: Option<f64>,
    anchors_percent: Option<f64>,
    decode_percent: Option<f64>,
    render_percent: Option<f64>,
}

pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    if args.list {
        let lines = rows().iter().map(|row| format!("{:24} {}\n", row.name, row.what)).collect::<String>();
        return output::print_text(&lines).map(|()| ExitCode::SUCCESS);
    }
    let mut base = args.base()?;
    let lpips = args.lpips.load()?;
    if lpips.is_none() {
        eprintln!("{NO_WEIGHTS}");
    }
    output::check_writable(&args.output.join("ablation.csv"))?;
    let capture = train::load(&mut base)?;
    Split::Test.views(&capture).context("an ablation measures on held-out views; see --test-every")?;
    let plan = args.plan(&base)?;
    let stop = stop::flag()?;
    let mut lines: Vec<Line> = Vec::new();
    for (i, run) in plan.iter().enumerate() {
        eprintln!("{} of {}  {}, lambda {}, seed {}", i + 1, plan.len(), run.row, run.lambda, run.seed);
        if let Some(folder) = run.config.output.parent() {
            std::fs::create_dir_all(folder).with_context(|| format!("could not make {}", folder.display()))?;
        }
        if !point::trained(&run.config, &capture, &stop)? {
            eprintln!("the same command again goes on with the ablation");
            return Ok(ExitCode::from(stop::INTERRUPTED));
        }
        lines.push(run.line(&point::measured(&run.config, lpips.as_ref())?));
        args.write_results(&lines, base.train.seed)?;
    }
    let summary = csv_of(&args.summary(&lines, base.train.seed))?;
    output::print_text(&String::from_utf8(summary)?)?;
    Ok(ExitCode::SUCCESS)
}

impl Args {
    /// What all runs share; its output is the folder of theirs.
    fn base(&self) -> Result<RunConfig> {
        let base = match &self.config {
            Some(path) => RunConfig::read(path)?,
            None => RunConfig { train: TrainConfig::of(Backbone::Hac), ..RunConfig::default() },
        };
        let base = self.settings.applied_to(point::base(base, self.dataset.as_deref(), &self.output)?)?;
        if !base.train.modules.attached().is_empty() {
            bail!("the rows of an ablation attach the modules; leave --modules and --prune out");
        }
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
        plan.iter().try_for_each(|run| {
            run.config.check().with_context(|| format!("the row {} can not be trained", run.row))
        })?;
        Ok(plan)
    }

    fn write_results(&self, lines: &[Line], seed: u64) -> Result<()> {
        output::write_whole(&self.output.join("ablation.csv"), &csv_of(lines)?)?;
        output::write_whole(&self.output.join("summary.csv"), &csv_of(&self.summary(lines, seed))?)?;
        let mut curves = Vec::new();
        for row in rows().iter().filter(|row| row.at_all_rates) {
            let points: Vec<ResultRow> =
                lines.iter().filter(|line| line.row == row.name && line.seed == seed).map(Line::result_row).collect();
            if !points.is_empty() {
                output::write_whole(&self.output.join(format!("{}.csv", row.name)), &results_csv(&points)?)?;
                curves.push(Named { name: row.name.to_owned(), what: points });
            }
        }
        let figure = rate_distortion_svg(&curves, SizeAxis::Linear)?;
        output::write_whole(&self.output.join("rate_distortion.svg"), figure.as_bytes())
    }

    /// Every row but `none`, in the order of the plan.
    fn summary(&self, lines: &[Line], seed: u64) -> Vec<Comparison> {
        let mut names: Vec<&'static str> = Vec::new();
        for line in lines.iter().filter(|line| line.row != "none") {
            if !names.contains(&line.row) {
                names.push(line.row);
            }
        }
        names.into_iter().map(|row| self.comparison(row, lines, seed)).collect()
    }

    fn comparison(&self, row: &'static str, lines: &[Line], seed: u64) -> Comparison {
        let at = self.option_lambda();
        let curve = |row: &str| -> Vec<RatePoint> {
            lines.iter().filter(|line| line.row == row && line.seed == seed).map(Line::rate_point).collect()
        };
        let runs = |row: &str| -> Vec<RatePoint> {
            lines.iter().filter(|line| line.row == row && line.lambda == at).map(Line::rate_point).collect()
        };
        let first = |row: &str| lines.iter().find(|line| line.row == row && line.lambda == at && line.seed == seed);
        let (none, own) = (curve("none"), curve(row));
        let by_seeds = rate_difference(&none, &runs("none"), &runs(row));
        let pair = first("none").zip(first(row));
        let alone = pair.and_then(|(_, line)| pocketsplat::metrics::ln_excess(&none, &line.rate_point()));
        let share = |of: fn(&Line) -> f64| pair.map(|(none, line)| 100.0 * (of(line) / of(none) - 1.0));
        Comparison {
            row,
            bd_rate_percent: bd_rate_percent(&none, &own).ok(),
            bd_psnr_db: bd_psnr_db(&none, &own).ok(),
            rate_percent: by_seeds.map(|d| d.percent).or(alone.map(|ln| 100.0 * ln.exp_m1())),
            rate_low_percent: by_seeds.map(|RateDifference { interval, .. }| interval[0]),
            rate_high_percent: by_seeds.map(|RateDifference { interval, .. }| interval[1]),
            psnr_difference_db: pair.map(|(none, line)| line.psnr_db - none.psnr_db),
            bytes_percent: share(|line| line.size_bytes as f64),
            anchors_percent: share(|line| f64::from(line.anchors)),
            decode_percent: share(|line| line.decode_s),
            render_percent: share(|line| line.render_s),
        }
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

impl Run {
    fn line(&self, evaluation: &Evaluation) -> Line {
        Line {
            row: self.row,
            lambda: self.lambda,
            seed: self.seed,
            psnr_db: evaluation.psnr_db,
            ssim: evaluation.ssim,
            lpips: evaluation.lpips,
            size_bytes: evaluation.bundle_bytes,
            anchors: evaluation.n_anchors,
            gaussians: evaluation.n_gaussians,
            decode_s: evaluation.decode_s,
            render_s: evaluation.render_s_per_view,
            tiers: evaluation
                .tiers
                .iter()
                .map(|tier| format!("{:.2}:{:.3}", tier.pruning_rate, tier.psnr_db))
                .collect::<Vec<_>>()
                .join(" "),
        }
    }
}

impl Line {
    fn rate_point(&self) -> RatePoint {
        RatePoint { size_bytes: self.size_bytes as f64, psnr_db: self.psnr_db }
    }

    fn result_row(&self) -> ResultRow {
        ResultRow {
            submethod: format!("lambda={}", self.lambda),
            psnr_db: self.psnr_db,
            ssim: Some(self.ssim),
            lpips: self.lpips,
            size_bytes: self.size_bytes as f64,
            n_gaussians: Some(self.gaussians as f64),
        }
    }
}

fn csv_of<T: Serialize>(lines: &[T]) -> Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for line in lines {
        writer.serialize(line)?;
    }
    Ok(writer.into_inner().map_err(|error| error.into_error())?)
}
