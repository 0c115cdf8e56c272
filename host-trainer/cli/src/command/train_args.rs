//! The options of `pocketsplat train`, each of which may also stand in a configuration.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use pocketsplat_capture::dataset::Background;
use pocketsplat_codec::bundle::PRUNING_RATES;
use pocketsplat_files::{Content, Output};
use pocketsplat_trainer::device::Limits;
use pocketsplat_trainer::effects::Price;
use pocketsplat_trainer::train::config::Backbone;
use pocketsplat_trainer::train::modules::pruning::Form;
use pocketsplat_trainer::train::run::{RunFolder, is_file_of_run};

use super::capture::CaptureArgs;
use super::device_args::DeviceArgs;
use super::devices::{DeviceChoice, DeviceOption};
use super::outputs::{OverwriteArgs, check_name, reading_capture};
use super::settings::{QualityOptions, RunOptions};
use crate::config::heading::{INPUT, OUTPUT, QUALITY, RUN};
use crate::config::{CaptureOptions, EXPLICIT, EffectsConfig, ExplicitRunConfig, Preset, RunConfig, absolute};
use crate::say::say;

/// Train a scene from a capture and write it as a bundle.
///
/// Works in a run folder beside the bundle, from which an interrupted run goes on with --resume and ends in the same
/// bytes.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the capture.
    #[arg(required_unless_present_any = ["config", "resume", "from"])]
    pub(super) dataset: Option<PathBuf>,
    /// First find the poses of photographs or a film, as `pocketsplat poses` does; the capture is left in OUT.capture.
    #[arg(long, conflicts_with_all = ["config", "resume", "from", "dry_run"], help_heading = INPUT, hide_short_help = true)]
    pub(super) poses: bool,
    #[command(flatten)]
    capture: CaptureOptions,
    /// Bundle to write; with --backbone 3dgs a .ply
    #[arg(short, long, value_name = "OUT.psb", required_unless_present_any = ["config", "resume"], help_heading = OUTPUT)]
    output: Option<PathBuf>,
    /// Folder for configuration, progress and checkpoints [default: OUT.run, or OUT.ply.run]
    #[arg(long, value_name = "DIR", conflicts_with = "resume", help_heading = OUTPUT, hide_short_help = true)]
    run: Option<PathBuf>,
    /// Print the result as JSON [default: as text]
    #[arg(long, help_heading = OUTPUT, hide_short_help = true)]
    pub(super) json: bool,
    /// Write no report.html.
    #[arg(long, help_heading = OUTPUT, hide_short_help = true)]
    pub(super) no_report: bool,
    /// Serve a page about the run while it goes on, to this machine alone, at a free port or the one given.
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "0", help_heading = OUTPUT, hide_short_help = true)]
    pub(super) watch: Option<u16>,
    /// Length of the run and size of the images: quick (2,000 iterations, 200 px), standard (7,000, 400 px), or full (30,000,
    /// images as they are) [default: standard]
    #[arg(long, value_name = "NAME", conflicts_with_all = ["config", "resume", "from"], hide_possible_values = true,
        help_heading = QUALITY)]
    preset: Option<Preset>,
    #[command(flatten)]
    pub(super) quality: QualityOptions,
    /// Rate weight: a larger one makes smaller files [default: 0.002 times the share of opaque pixels; by the limits for a device]
    #[arg(long, value_name = "X", help_heading = QUALITY)]
    lambda: Option<f64>,
    /// Move the training cameras to where their photographs fit the scene best, for poses that are slightly off.
    #[arg(long, help_heading = QUALITY, hide_short_help = true)]
    refine: bool,
    #[command(flatten)]
    device: DeviceArgs,
    /// Configuration to read, as config.toml of a run; keys that it lacks have their defaults, options override it, and a device's limits
    /// choose nothing.
    #[arg(long, value_name = "FILE.toml", conflicts_with = "resume", help_heading = RUN, hide_short_help = true)]
    config: Option<PathBuf>,
    /// Print the configuration that the run would have, with every key, and the estimate; train nothing and write nothing.
    #[arg(long, conflicts_with_all = ["resume", "from", "continues", "json"], help_heading = RUN, hide_short_help = true)]
    pub(super) dry_run: bool,
    /// Run folder of an interrupted run to go on with; give DATASET as well if the capture has moved.
    #[arg(long, value_name = "OUT.run", help_heading = RUN)]
    pub(super) resume: Option<PathBuf>,
    /// Resume or finish the run that --config names, or do nothing if it is complete.
    #[arg(long = "continue", requires = "config", conflicts_with_all = ["resume", "from", "overwrite"], help_heading = RUN,
        hide_short_help = true)]
    pub(super) continues: bool,
    /// Run folder of a run to branch off after iteration --at; the other options hold from there on, the size of the images too.
    #[arg(long, value_name = "OUT.run", requires = "at", conflicts_with_all = ["config", "resume"], help_heading = RUN,
        hide_short_help = true)]
    from: Option<PathBuf>,
    /// Iteration to branch off after, one that the other run was given as --fork-at.
    #[arg(long, value_name = "STEP", requires = "from", help_heading = RUN, hide_short_help = true)]
    at: Option<u32>,
    #[command(flatten)]
    pub(super) trainer: DeviceOption,
    #[command(flatten)]
    pub(super) overwrite: OverwriteArgs,
    #[command(flatten)]
    options: RunOptions,
}

fn is_same_folder(one: &Path, other: &Path) -> bool {
    let absolute = |path: &Path| path.canonicalize().or_else(|_| std::path::absolute(path)).ok();
    absolute(one) == absolute(other)
}

/// Refuses a weight of bits where none are weighed.
pub(super) fn check_lambda(given: Option<f64>, backbone: Backbone) -> Result<()> {
    if given.is_some() && !backbone.is_coded() {
        bail!("--lambda weighs the bits of a value, and scaffold scenes are trained without them; use --backbone hac");
    }
    Ok(())
}

impl Args {
    /// The run folder to begin from and the iteration, if any.
    pub(crate) fn fork(&self) -> Option<(&Path, u32)> {
        self.from.as_deref().zip(self.at)
    }

    /// Capture and output of a run as the command line names them, else as its configuration does.
    pub(crate) fn named_paths<'a>(&'a self, dataset: &'a Path, output: &'a Path) -> (&'a Path, &'a Path) {
        (self.dataset.as_deref().unwrap_or(dataset), self.output.as_deref().unwrap_or(output))
    }

    /// Checks where a run writes in the end, and what its name says.
    ///
    /// * `content`: what is written. * `run`: the folder that it works in.
    pub(crate) fn output(&self, capture: &CaptureArgs, output: &Path, content: Content, run: &Path) -> Result<Output> {
        check_name(self.named_paths(&capture.dataset, output).1, content, None)?;
        let is_in_run = |folder: &Path| is_same_folder(folder, run);
        if output.parent().is_some_and(is_in_run) && output.file_name().is_some_and(is_file_of_run) {
            bail!("{} is a file of the run itself; choose another --output or --run", output.display());
        }
        let files = self.config.iter().fold(self.overwrite.outputs(), |outputs, path| outputs.reading(path));
        let outputs = self.from.iter().fold(files, |outputs, run| outputs.reading_folder(run));
        Ok(reading_capture(outputs, capture, output).file(output, content)?)
    }

    /// The configuration of a new run: defaults, then `--config`, then what else the command line says.
    pub(crate) fn resolved(&self) -> Result<RunConfig> {
        let mut base = match (&self.config, &self.from) {
            (Some(path), _) => RunConfig::read(path)?,
            (None, Some(run)) => {
                let run = RunConfig::of_run(run)?;
                // What was decided on the way stays: effects are not chosen again.
                RunConfig { fork_at: Vec::new(), effects: EffectsConfig { auto: false, ..run.effects }, ..run }
            }
            (None, None) => self.preset.unwrap_or_default().config(),
        };
        let limits = self.device.limits()?;
        // Widths, tiers and λ of a configuration are its own: what a device affords is chosen without one.
        let is_for_device = !limits.is_none() && self.config.is_none() && self.from.is_none();
        if is_for_device {
            base.effects.price = Price::within(&limits);
        }
        let mut config = self.applied_to(base)?;
        config.scales_lambda &= self.lambda.is_none() && !is_for_device;
        if is_for_device {
            self.device.choose(&self.quality, self.lambda, &mut config)?;
            // What is set by hand goes before what the device's limits choose.
            config = self.options.with_set(config)?;
        }
        for (path, name, option) in [(&config.dataset, "dataset", "DATASET"), (&config.output, "output", "--output")] {
            if path.as_os_str().is_empty() {
                bail!("the configuration names no `{name}`; give it there or as {option}");
            }
        }
        check_lambda(self.lambda, config.train.backbone)?;
        if self.from.is_some() && self.capture.points.is_some() {
            bail!(
                "--points says where training starts, and a run of --from starts with the scene of another; leave it out"
            );
        }
        config.check()?;
        if config.train.backbone == Backbone::ContextGs && config.encoding.tiers != PRUNING_RATES {
            say!(
                "warning: contextgs is trained for the default --tiers; with these its anchors follow other anchors in the bundle \
                 than in training"
            );
        }
        let deepest = config.encoding.tiers.iter().copied().reduce(f32::max).unwrap_or_default();
        if let Some(pruning) = config.train.modules.pruning.filter(|pruning| pruning.form == Form::Tiered)
            && f64::from(deepest) > pruning.rate + 1e-6
        {
            say!(
                "warning: tiered-pruning leaves out {} of the anchors at most while it trains, and the deepest of --tiers {deepest}; \
                 --set train.modules.pruning.rate={deepest} trains for that",
                pruning.rate
            );
        }
        // Absolute, so that the run can go on from any folder.
        for path in [&mut config.dataset, &mut config.output] {
            *path = absolute(path)?;
        }
        Ok(config)
    }

    /// `config` with everything replaced that the command line says.
    pub(crate) fn applied_to(&self, config: RunConfig) -> Result<RunConfig> {
        let mut config = self.options.set_after(config, |config| self.with_options(config), RunOptions::with_set)?;
        config.train.learns_background = match self.capture.background {
            Some(background) => background == Background::Learned,
            None => config.train.learns_background || config.capture.background == Some(Background::Learned),
        };
        // As a run keeps it: the same options again are no other setting.
        config.train.shape = config.train.modules.shape(config.train.shape);
        Ok(config)
    }

    /// The same, but for what `--set` says.
    fn with_options(&self, mut config: RunConfig) -> Result<RunConfig> {
        // Absolute, so that the run can go on from any folder.
        for (into, given) in [(&mut config.dataset, &self.dataset), (&mut config.output, &self.output)] {
            if let Some(path) = given {
                *into = absolute(path)?;
            }
        }
        let (given, before) = (self.device.limits()?, config.encoding.limits);
        if let Some(level) = before.level {
            self.device.refuse_board_beside(level)?;
        }
        config.encoding.limits = Limits {
            ram_bytes: given.ram_bytes.or(before.ram_bytes),
            flash_bytes: given.flash_bytes.or(before.flash_bytes),
            processor: given.processor.or(before.processor),
            level: given.level.or(before.level),
        };
        config.effects.target = given.processor.or(config.effects.target);
        if let Some(lambda) = self.lambda {
            config.train.hac.lambda = lambda;
        }
        config.train.refine_poses |= self.refine;
        let frame = self.device.frame(self.capture.resolution, self.capture.max_resolution.is_some())?;
        let capture = CaptureOptions { resolution: frame, ..self.capture.clone() };
        config.capture = capture.or(&config.capture);
        self.quality.apply_to(&mut config)?;
        self.options.apply_to(&mut config);
        Ok(config)
    }

    /// The configuration of a new run on explicit Gaussians.
    pub(crate) fn explicit(&self) -> Result<ExplicitRunConfig> {
        for (name, given) in [("--config", self.config.is_some()), ("--from", self.from.is_some())] {
            if given {
                bail!("{name} works with anchors alone; leave it out with --backbone {EXPLICIT}");
            }
        }
        let (Some(dataset), Some(output)) = (&self.dataset, &self.output) else {
            bail!("the run needs DATASET and --output");
        };
        let config = ExplicitRunConfig::of_preset(self.preset.unwrap_or_default(), dataset.clone(), output.clone());
        self.applied_to_explicit(config)
    }

    /// `config` with everything replaced that the command line says.
    pub(crate) fn applied_to_explicit(&self, mut config: ExplicitRunConfig) -> Result<ExplicitRunConfig> {
        let mut refused = self.quality.of_anchors();
        let others = [
            ("--lambda", self.lambda.is_some()),
            ("--refine", self.refine),
            ("--watch", self.watch.is_some()),
            ("--device", matches!(self.trainer.trains_on, DeviceChoice::Gpu(_))),
        ];
        let given = others.into_iter().chain(self.device.given()).filter(|(_, given)| *given);
        refused.extend(given.map(|(name, _)| name));
        if !refused.is_empty() {
            bail!(
                "{} does not go with --backbone {EXPLICIT}, which trains Gaussians and compresses nothing; leave it out",
                refused.join(", ")
            );
        }
        if self.capture.background == Some(Background::Learned) {
            bail!("--background learned works with anchors alone; choose black or white with --backbone {EXPLICIT}");
        }
        let with_options = |mut config: ExplicitRunConfig| {
            config.capture = self.capture.or(&config.capture);
            self.quality.apply_to_explicit(&mut config.gaussians);
            self.options.applied_to_explicit(config)
        };
        config = self.options.set_after(config, with_options, RunOptions::with_set_explicit)?;
        for (into, given) in [(&mut config.dataset, &self.dataset), (&mut config.output, &self.output)] {
            let path = given.as_ref().unwrap_or(into);
            // Absolute, so that the run can go on from any folder.
            *into = absolute(path)?;
        }
        config.gaussians.validate()?;
        Ok(config)
    }

    /// Where a new run works.
    ///
    /// * `output`: what it writes in the end.
    pub(crate) fn run_folder(&self, output: &Path) -> Result<PathBuf> {
        run_folder(self.run.as_deref(), output, self.overwrite.is_given())
    }

    /// Refuses to replace what a run of another capture came to, unless that is asked for.
    ///
    /// * `run`: the folder that the new one works in. * `dataset`: what it is of.
    pub(crate) fn refuse_other_capture(&self, run: &Path, dataset: &Path) -> Result<()> {
        let other = path_of_run(run, "dataset").filter(|other| !is_same_folder(other, dataset));
        if let Some(other) = other.filter(|_| !self.overwrite.is_given()) {
            bail!(
                "{} has a run of another capture, {}; choose another --output, or replace that run with --overwrite",
                run.display(),
                other.display()
            );
        }
        Ok(())
    }
}

/// What a key of the configuration of the run in a folder says, of anchors or not.
fn path_of_run(folder: &Path, key: &str) -> Option<PathBuf> {
    let text = std::fs::read_to_string(folder.join("config.toml")).ok()?;
    Some(text.parse::<toml::Table>().ok()?.get(key)?.as_str()?.into())
}

/// Where a run works that writes `output` in the end: the folder `given`, else beside it.
///
/// * `overwrite`: whether it may be the folder of a run that wrote another file.
pub(super) fn run_folder(given: Option<&Path>, output: &Path, overwrite: bool) -> Result<PathBuf> {
    let folder = given.map_or_else(|| RunFolder::beside(output), Path::to_owned);
    if std::path::absolute(&folder).ok() == std::path::absolute(output).ok() {
        bail!("{} cannot be both output and run folder; choose another folder with --run", folder.display());
    }
    if let Some(other) =
        path_of_run(&folder, "output").filter(|other| !overwrite && other.file_name() != output.file_name())
    {
        bail!(
            "{} is the folder of the run that wrote {}; choose another folder with --run, or replace that run with --overwrite",
            folder.display(),
            other.display()
        );
    }
    Ok(folder)
}
