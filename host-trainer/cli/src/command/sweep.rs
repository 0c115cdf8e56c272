//! `pocketsplat sweep`: the same capture at several rates, measured.

use std::path::PathBuf;
use std::process::ExitCode;

use crate::plot::{Named, ResultRow, SizeAxis, names_of, rate_distortion_svg, results_csv};
use anyhow::{Context, Result, bail};
use pocketsplat_trainer::train::TrainConfig;
use pocketsplat_trainer::train::config::Backbone;

use super::capture::Split;
use super::lpips::LpipsArgs;
use super::settings::{QualityOptions, RunOptions, applied};
use super::{output, point, stop, train};
use crate::config::heading::{OUTPUT, QUALITY, RUN};
use crate::config::{CaptureOptions, RunConfig};

/// Train a capture once for each weight of the bits, and measure every bundle on the held-out views.
///
/// After each point results.csv and rate_distortion.svg in the folder hold the points so far. The same command again
/// goes on with what was interrupted and trains nothing twice.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the capture.
    #[arg(required_unless_present = "config")]
    dataset: Option<PathBuf>,
    #[command(flatten)]
    capture: CaptureOptions,
    /// Folder for the bundles, their run folders and the results.
    #[arg(short, long, value_name = "DIR", help_heading = OUTPUT)]
    output: PathBuf,
    #[command(flatten)]
    quality: QualityOptions,
    /// Weights of a value's bits in the loss, one point each: the larger, the smaller the bundle.
    #[arg(long = "lambda", value_name = "X,…", value_delimiter = ',', required = true, help_heading = QUALITY)]
    lambdas: Vec<f64>,
    /// Configuration to read, as a run folder has it; options beside it count more.
    #[arg(long, value_name = "FILE.toml", help_heading = RUN)]
    config: Option<PathBuf>,
    #[command(flatten)]
    run: RunOptions,
    #[command(flatten)]
    lpips: LpipsArgs,
}

/// The table of results and its figure, in the folder of a sweep.
const RESULTS: &str = "results.csv";
const FIGURE: &str = "rate_distortion.svg";

pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    let mut base = args.base()?;
    // All of them before the first is trained for an hour.
    point::check_distinct(&args.lambdas)?;
    args.lambdas.iter().try_for_each(|lambda| Args::point(&base, *lambda).check())?;
    let lpips = args.lpips.load()?;
    output::check_writable(&args.output.join(RESULTS))?;
    let capture = train::load(&mut base)?;
    Split::Test.views(&capture).context("a sweep measures on held-out views; see --test-every")?;
    let stop = stop::flag()?;
    let mut rows = Vec::new();
    for (i, &lambda) in args.lambdas.iter().enumerate() {
        eprintln!("{} of {}  lambda {lambda}", i + 1, args.lambdas.len());
        let config = Args::point(&base, lambda);
        if !point::trained(&config, &capture, &stop)? {
            eprintln!("the same command again goes on with the sweep");
            return Ok(ExitCode::from(stop::INTERRUPTED));
        }
        let evaluation = point::measured(&config, lpips.as_ref())?;
        rows.push(evaluation.result_row(format!("lambda={lambda}")));
        args.write_results(&rows)?;
    }
    output::print_text(&String::from_utf8(results_csv(&rows)?)?)?;
    Ok(ExitCode::SUCCESS)
}

impl Args {
    /// What all points share; its output is the folder of theirs.
    fn base(&self) -> Result<RunConfig> {
        let base = match &self.config {
            Some(path) => RunConfig::read(path)?,
            None => RunConfig { train: TrainConfig::of(Backbone::Hac), ..RunConfig::default() },
        };
        let base = point::base(base, self.dataset.as_deref(), &self.output)?;
        let base = applied(&self.capture, &self.quality, &self.run, base)?;
        point::check_effects(&base)?;
        if base.train.backbone != Backbone::Hac {
            bail!(
                "a sweep varies the weight of the bits, and they have none in this configuration; use --backbone hac"
            );
        }
        Ok(base)
    }

    /// One point: its bundle is `DIR/lambda-X.psb`, its run folder beside it.
    fn point(base: &RunConfig, lambda: f64) -> RunConfig {
        let mut config = RunConfig { output: base.output.join(format!("lambda-{lambda}.psb")), ..base.clone() };
        config.train.hac.lambda = lambda;
        config
    }

    fn write_results(&self, rows: &[ResultRow]) -> Result<()> {
        let path = self.output.join(RESULTS);
        output::write_whole(&path, &results_csv(rows)?)?;
        let name = names_of(&[&path]).swap_remove(0);
        let figure = rate_distortion_svg(&[Named { name, what: rows.to_vec() }], SizeAxis::Linear)?;
        output::write_whole(&self.output.join(FIGURE), figure.as_bytes())
    }
}
