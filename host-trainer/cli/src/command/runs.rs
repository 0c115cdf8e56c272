//! Several runs over one capture: each trained and measured once, with a table of results and a figure.

use std::fmt;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use pocketsplat_capture::dataset::Split;
use pocketsplat_files::{Content, Outputs};
use pocketsplat_trainer::train::TrainConfig;
use pocketsplat_trainer::train::config::Backbone;

use super::capture::views_of;
use super::devices::DeviceChoice;
use super::eval::Evaluation;
use super::loaded::LoadedCapture;
use super::lpips::LpipsArgs;
use super::outputs::{self, BUNDLE, OverwriteArgs, RESULTS};
use super::settings::{QualityOptions, RunOptions, applied};
use super::workflow::Planner;
use super::{output, point, stop, train};
use crate::config::heading::{OUTPUT, RUN};
use crate::config::{CaptureOptions, EffectsConfig, RunConfig};
use crate::plot::{Named, ResultRow, SizeAxis, names_of, rate_distortion_svg, results_csv};
use crate::program;
use crate::say::say;

/// The curves of all rows, in the folder of the runs.
pub(super) const FIGURE: (&str, Content) = ("rate_distortion.svg", outputs::FIGURE);

/// What all runs share.
#[derive(clap::Args)]
pub(super) struct RunsArgs {
    /// Folder of the capture.
    #[arg(required_unless_present = "config")]
    dataset: Option<PathBuf>,
    #[command(flatten)]
    capture: CaptureOptions,
    /// Folder for the bundles, their run folders and the results.
    #[arg(short, long, value_name = "DIR", required = true, help_heading = OUTPUT)]
    output: Option<PathBuf>,
    #[command(flatten)]
    quality: QualityOptions,
    /// Configuration to read, as a run folder has it; options override it.
    #[arg(long, value_name = "FILE.toml", help_heading = RUN)]
    config: Option<PathBuf>,
    #[command(flatten)]
    run: RunOptions,
    #[command(flatten)]
    lpips: LpipsArgs,
    /// What trains: cpu, gpu, gpu:N as `pocketsplat devices` lists them, or auto, a GPU where there is one
    #[arg(long, value_name = "NAME", default_value_t = DeviceChoice::Cpu, help_heading = RUN)]
    device: DeviceChoice,
    /// Write a Snakemake workflow that trains the runs into the folder, and train nothing.
    #[arg(long, help_heading = RUN)]
    plan: bool,
    #[command(flatten)]
    overwrite: OverwriteArgs,
}

/// One run, by what distinguishes it from the configuration that all share.
pub(super) struct RunSpec {
    /// The row of the results that it belongs to.
    pub(super) row: &'static str,
    pub(super) lambda: f64,
    pub(super) seed: u64,
    /// Whether it is a point of its row's curve.
    pub(super) on_curve: bool,
    /// Its bundle, within the folder of the runs.
    pub(super) bundle: String,
    /// Other keys of the configuration, each as `table.key=value`.
    pub(super) overrides: Vec<String>,
}

/// A run and what it came to.
pub(super) struct MeasuredRun<'a> {
    pub(super) spec: &'a RunSpec,
    pub(super) evaluation: Evaluation,
}

impl fmt::Display for RunSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, lambda {}, seed {}", self.row, self.lambda, self.seed)
    }
}

impl RunSpec {
    fn config(&self, base: &RunConfig) -> Result<RunConfig> {
        let mut keys = self.overrides.clone();
        keys.extend([format!("train.hac.lambda={}", self.lambda), format!("train.seed={}", self.seed)]);
        let mut config = base.with_keys(&keys)?;
        config.output = base.output.join(&self.bundle);
        // As a run keeps it.
        config.train.shape = config.train.modules.shape(config.train.shape);
        Ok(config)
    }
}

impl RunsArgs {
    /// The configuration that all runs share, HAC unless said otherwise; its output is the folder of the runs.
    ///
    /// Paths are absolute, so that a run can be resumed from anywhere. Effects are not measured: runs compare only if they have
    /// the same.
    pub(super) fn base(&self) -> Result<RunConfig> {
        let absolute =
            |path: &Path| std::path::absolute(path).with_context(|| format!("`{}` is no path", path.display()));
        // An option that stands alone, as `ablate --list`, comes without it.
        let output = self.output.as_deref().context("no folder for the runs; give --output")?;
        let config = match &self.config {
            Some(path) => RunConfig::read(path)?,
            None => RunConfig { train: TrainConfig::of(Backbone::Hac), ..RunConfig::default() },
        };
        let dataset = absolute(self.dataset.as_deref().unwrap_or(&config.dataset))?;
        let effects = EffectsConfig { auto: false, ..config.effects };
        let config = RunConfig { dataset, output: absolute(output)?, effects, ..config };
        let config = applied(&self.capture, &self.quality, &self.run, config)?;
        if config.effects.auto {
            bail!(
                "runs that are compared need the same effects; force them, as --effects +view-colour, and leave auto to train"
            );
        }
        Ok(config)
    }

    /// Trains and measures the runs one after another, from wherever each stands, and then prints what `tables` returns; or, with
    /// `--plan`, writes the workflow that does.
    ///
    /// After each run `tables` writes the results so far.
    ///
    /// * `files`: what `tables` writes.
    pub(super) fn train(
        &self,
        base: &RunConfig,
        specs: &[RunSpec],
        files: &[(&str, Content)],
        tables: impl Fn(&[MeasuredRun<'_>], &mut Outputs) -> Result<Vec<u8>>,
    ) -> Result<ExitCode> {
        let outputs = self.config.iter().fold(self.overwrite.outputs(), |outputs, path| outputs.reading(path));
        let outputs = outputs.reading_folder(&base.dataset);
        // All of them before the first is trained for an hour.
        for (file, content) in files {
            outputs.clone().file(&base.output.join(file), *content)?;
        }
        for (i, spec) in specs.iter().enumerate() {
            if specs[..i].iter().any(|other| other.bundle == spec.bundle) {
                bail!("--lambda names {} twice; each run needs a weight of its own", spec.lambda);
            }
            let config = spec.config(base)?;
            config.check().with_context(|| format!("cannot train {spec}"))?;
            outputs.clone().file(&config.output, BUNDLE)?;
        }
        let lpips = self.lpips.load()?;
        if self.plan {
            return self.plan(base, specs, files, &outputs);
        }
        let mut loaded = LoadedCapture::for_training(base.output.clone());
        let stop = stop::flag()?;
        let mut measured = Vec::new();
        let mut text = Vec::new();
        for (i, spec) in specs.iter().enumerate() {
            say!("{} of {}  {spec}", i + 1, specs.len());
            let mut config = spec.config(base)?;
            let capture = loaded.of(&mut config)?;
            views_of(capture, Split::Test).context("runs are compared on held-out views; see --test-every")?;
            if !point::trained(&config, capture, self.device, &stop)? {
                say!("the same command again resumes here");
                return Ok(ExitCode::from(stop::INTERRUPTED));
            }
            measured.push(MeasuredRun { spec, evaluation: point::measured(&config, lpips.as_ref())? });
            // The names are taken anew each time.
            text = tables(&measured, &mut outputs.clone())?;
        }
        program::warn_of_several(measured.iter().map(|run| run.evaluation.program.as_str()));
        output::print_text(&String::from_utf8(text)?)?;
        drop(loaded);
        train::clear_photographs(&base.output, ExitCode::SUCCESS);
        Ok(ExitCode::SUCCESS)
    }

    /// Writes the workflow of the runs, which ends with this command once more: by then nothing is left but its tables.
    fn plan(
        &self,
        base: &RunConfig,
        specs: &[RunSpec],
        files: &[(&str, Content)],
        outputs: &Outputs,
    ) -> Result<ExitCode> {
        let mut loaded = LoadedCapture::default();
        let lpips = self.lpips.options()?;
        let mut planner = Planner::default();
        for spec in specs {
            let config = spec.config(base)?;
            let name = spec.bundle.trim_end_matches(".psb").to_owned();
            planner.add(name, config, self.device, None, &lpips, &mut loaded)?;
        }
        let arguments = std::env::args().skip(1).filter(|argument| argument != "--plan").collect();
        output::print_text(&planner.write(&base.output, arguments, files, outputs)?)?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Writes a table for each row's curve, `ROW.csv`, and the figure of all; returns the tables.
pub(super) fn write_curves(folder: &Path, runs: &[MeasuredRun<'_>], outputs: &mut Outputs) -> Result<Vec<u8>> {
    let mut curves: Vec<(PathBuf, Vec<ResultRow>)> = Vec::new();
    for MeasuredRun { spec, evaluation } in runs.iter().filter(|run| run.spec.on_curve) {
        let path = folder.join(format!("{}.csv", spec.row));
        let point = evaluation.result_row(format!("lambda={}", spec.lambda));
        match curves.iter_mut().find(|(other, _)| *other == path) {
            Some((_, points)) => points.push(point),
            None => curves.push((path, vec![point])),
        }
    }
    let (mut named, mut tables) = (Vec::new(), Vec::new());
    for (path, what) in curves {
        let table = results_csv(&what)?;
        outputs.file(&path, RESULTS)?.write(&table)?;
        tables.extend(table);
        named.push(Named { name: names_of(&[path]).swap_remove(0), what });
    }
    // The figure shows what seeds change as well.
    for MeasuredRun { spec, evaluation } in runs.iter().filter(|run| !run.spec.on_curve) {
        let point = evaluation.result_row(format!("lambda={}", spec.lambda));
        if let Some(curve) = named.iter_mut().find(|curve| curve.name == spec.row) {
            curve.what.push(point);
        }
    }
    let figure = rate_distortion_svg(&named, SizeAxis::Linear)?;
    outputs.file(&folder.join(FIGURE.0), FIGURE.1)?.write(figure.as_bytes())?;
    Ok(tables)
}
