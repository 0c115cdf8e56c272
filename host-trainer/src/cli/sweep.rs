//! `pocketsplat sweep`: the same capture at several rates, measured.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

use anyhow::{Context, Result, bail};
use pocketsplat::dataset::Capture;
use pocketsplat::metrics::Lpips;
use pocketsplat::plot::{Named, ResultRow, SizeAxis, names_of, rate_distortion_svg, results_csv};
use pocketsplat::train::TrainConfig;
use pocketsplat::train::config::Backbone;
use pocketsplat::train::run::{RunError, RunFolder};

use super::bundle::BundleFile;
use super::capture::{CaptureArgs, Split};
use super::eval::{Renderer, evaluate};
use super::lpips::{LpipsArgs, NO_WEIGHTS};
use super::run_config::RunConfig;
use super::settings::Settings;
use super::{output, stop, train};

/// Train a capture once for each weight of the bits, and measure every bundle on the held-out views.
///
/// After each point results.csv and rate_distortion.svg in the folder hold the points so far. The same command again
/// goes on with what was interrupted and trains nothing twice.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the capture.
    #[arg(required_unless_present = "config")]
    dataset: Option<PathBuf>,
    /// Folder for the bundles, their run folders and the results.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Weights of a value's bits in the loss, one point each; the larger, the smaller the bundle.
    #[arg(long = "lambda", value_name = "X,…", value_delimiter = ',', required = true)]
    lambdas: Vec<f64>,
    /// Read the configuration, as a run folder has it; options given beside it count more.
    #[arg(long, value_name = "FILE.toml")]
    config: Option<PathBuf>,
    #[command(flatten)]
    settings: Settings,
    #[command(flatten)]
    lpips: LpipsArgs,
}

/// The table of results and its figure, in the folder of a sweep.
const RESULTS: &str = "results.csv";
const FIGURE: &str = "rate_distortion.svg";
/// The configuration in a run folder.
const CONFIG: &str = "config.toml";

pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    let mut base = args.base()?;
    // All of them before the first is trained for an hour.
    for (i, &lambda) in args.lambdas.iter().enumerate() {
        if args.lambdas[..i].contains(&lambda) {
            bail!("--lambda names {lambda} twice; each point needs a weight of its own");
        }
        Args::point(&base, lambda).check()?;
    }
    let lpips = args.lpips.load()?;
    if lpips.is_none() {
        eprintln!("{NO_WEIGHTS}");
    }
    output::check_writable(&args.output.join(RESULTS))?;
    let capture = train::load(&mut base)?;
    Split::Test.views(&capture).context("a sweep measures on held-out views; see --test-every")?;
    let stop = stop::flag()?;
    let mut rows = Vec::new();
    for (i, &lambda) in args.lambdas.iter().enumerate() {
        eprintln!("{} of {}  lambda {lambda}", i + 1, args.lambdas.len());
        let config = Args::point(&base, lambda);
        if !trained(&config, &capture, &stop)? {
            eprintln!("the same command again goes on with the sweep");
            return Ok(ExitCode::from(stop::INTERRUPTED));
        }
        rows.push(measured(&config, lambda, lpips.as_ref())?);
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
        let dataset = self.dataset.as_ref().unwrap_or(&base.dataset).clone();
        // Absolute, so that a point can be gone on with from any folder.
        let absolute =
            |path: &Path| std::path::absolute(path).with_context(|| format!("`{}` is no path", path.display()));
        let (dataset, output) = (absolute(&dataset)?, absolute(&self.output)?);
        let base = self.settings.applied_to(RunConfig { dataset, output, ..base })?;
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

/// Brings a point to its end, from wherever it stands; false when it was interrupted before.
fn trained(config: &RunConfig, capture: &Capture, stop: &AtomicBool) -> Result<bool> {
    let path = config.output.with_extension("run");
    let (folder, resumes) = match RunFolder::reopen(&path) {
        Ok(folder) => {
            refuse_other(&RunConfig::read(&path.join(CONFIG))?, config, &path)?;
            (folder, true)
        }
        Err(RunError::Finished { .. }) if config.output.is_file() => {
            refuse_other(&RunConfig::read(&path.join(CONFIG))?, config, &path)?;
            eprintln!("trained before");
            return Ok(true);
        }
        // Finished without its bundle: somebody removed it.
        Err(RunError::NoRun { .. } | RunError::Finished { .. }) => {
            (RunFolder::start(&path, &config.to_toml()?, false)?, false)
        }
        Err(error) => return Err(error.into()),
    };
    Ok(train::train_in(folder, config, capture, resumes, stop)?.is_some())
}

/// Stops where the run in a point's folder is not the one that is asked for, in its bundle's bytes or its capture.
fn refuse_other(begun: &RunConfig, config: &RunConfig, folder: &Path) -> Result<()> {
    let difference = match begun.difference(config)? {
        Some(difference) => difference,
        None if begun.encoding != config.encoding => "its bundle is coded in another way".to_owned(),
        None if begun.dataset != config.dataset => {
            format!("its capture is {}, not {}", begun.dataset.display(), config.dataset.display())
        }
        None => return Ok(()),
    };
    bail!("the run in {} is not the one that is asked for: {difference}; choose another --output", folder.display())
}

/// The figures of a point.
fn measured(config: &RunConfig, lambda: f64, lpips: Option<&Lpips>) -> Result<ResultRow> {
    let file = BundleFile::read(&config.output)?;
    let capture = CaptureArgs { dataset: config.dataset.clone(), options: config.capture.clone() };
    let evaluation = evaluate(&file, &capture, Split::Test, Renderer::Core, false, lpips)?;
    Ok(ResultRow {
        submethod: format!("lambda={lambda}"),
        psnr_db: evaluation.psnr_db,
        ssim: Some(evaluation.ssim),
        lpips: evaluation.lpips,
        size_bytes: evaluation.bundle_bytes as f64,
        n_gaussians: Some(evaluation.n_gaussians as f64),
    })
}
