//! The options of `pocketsplat train`, each of which may also stand in a configuration.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::ArgAction;
use pocketsplat::bundle::QuantisationSteps;
use pocketsplat::train::TrainConfig;
use pocketsplat::train::config::{Backbone, Hac};

use super::capture::CaptureOptions;
use super::run_config::RunConfig;

/// Train a scene from a capture and write it as a bundle.
///
/// Works in a run folder beside the bundle, from which an interrupted run goes on with --resume and ends in the same
/// bytes.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the capture.
    #[arg(required_unless_present_any = ["config", "resume"])]
    dataset: Option<PathBuf>,
    #[command(flatten)]
    capture: CaptureOptions,
    /// The bundle to write.
    #[arg(short, long, value_name = "OUT.psb", required_unless_present_any = ["config", "resume"])]
    output: Option<PathBuf>,
    /// Folder for configuration, progress and checkpoints. [default: OUT.run]
    #[arg(long, value_name = "DIR", conflicts_with = "resume")]
    run: Option<PathBuf>,
    /// Read the configuration, as a run folder has it; options given beside it count more.
    #[arg(long, value_name = "FILE.toml", conflicts_with = "resume")]
    config: Option<PathBuf>,
    /// Go on with the run in this folder. A capture that has moved since is given as DATASET.
    #[arg(long, value_name = "OUT.run")]
    resume: Option<PathBuf>,
    /// Start anew where an unfinished run lies.
    #[arg(short = 'w', long, conflicts_with = "resume")]
    overwrite: bool,
    /// Iterations from one checkpoint to the next; 0: only on interruption. [default: by time, every minute]
    #[arg(long, value_name = "N")]
    checkpoint_every: Option<u32>,
    /// Keep the last two checkpoints of the finished run.
    #[arg(long)]
    keep_checkpoints: bool,
    /// Kind of scene. [default: scaffold]
    #[arg(long, value_enum)]
    backbone: Option<BackboneName>,
    #[arg(long, help = with_default("Weight of a value's bits in the loss, for `--backbone hac`", Hac::default().lambda))]
    lambda: Option<f64>,
    #[arg(long, value_name = "N", help = with_default("Hold out every N-th training view, to measure with; 0: none",
        TrainConfig::default().validation_every))]
    validation_every: Option<u32>,
    #[arg(long, help = with_default("Training steps; schedules scale with them", TrainConfig::default().iterations))]
    iterations: Option<u32>,
    #[arg(long, help = with_default("Everything random follows from it: same seed, same machine, same bundle",
        TrainConfig::default().seed))]
    seed: Option<u64>,
    /// Feature width of an anchor, and hidden width of the heads. [default: 32, with `--backbone hac` 50]
    #[arg(long, value_name = "F")]
    feature_dim: Option<usize>,
    #[arg(long, value_name = "K", help = with_default("Gaussians of an anchor", TrainConfig::default().shape.n_offsets))]
    offsets: Option<usize>,
    /// Do not show the heads the direction of view.
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true",
        action = ArgAction::Set)]
    no_view_direction: Option<bool>,
    /// Show the heads the distance of view. [default: false, with `--backbone hac` true]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true",
        action = ArgAction::Set)]
    view_distance: Option<bool>,
    /// Compensate opacities for the 0.3 px² dilation, for drawing at other resolutions than the training one.
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true",
        action = ArgAction::Set)]
    dilation_compensation: Option<bool>,
    /// Edge of a lattice cell, normalised units (the cameras span about 5). [default: from the points' spacing]
    #[arg(long)]
    voxel_size: Option<f64>,
    /// Grow no further than this many anchors; the candidates with the largest gradients come first. [default: no limit]
    #[arg(long, value_name = "N")]
    max_anchors: Option<usize>,
    #[arg(long, help = with_default("Quantisation step of the anchor features", QuantisationSteps::default().feature))]
    feature_step: Option<f32>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// [`Backbone`] on the command line.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum BackboneName {
    /// Scaffold-GS: anchors and three heads, trained for the image alone.
    Scaffold,
    /// HAC: the same, trained for image and bits, with a context model.
    Hac,
}

impl From<BackboneName> for Backbone {
    fn from(name: BackboneName) -> Self {
        match name {
            BackboneName::Scaffold => Self::Scaffold,
            BackboneName::Hac => Self::Hac,
        }
    }
}

fn with_default(help: &str, default: impl std::fmt::Display) -> String {
    format!("{help} [default: {default}]")
}

impl Args {
    /// The run folder to go on in, if any.
    pub(crate) fn resume(&self) -> Option<&Path> {
        self.resume.as_deref()
    }

    /// Whether an unfinished run may be replaced.
    pub(crate) fn overwrite(&self) -> bool {
        self.overwrite
    }

    /// Whether the result is printed as JSON.
    pub(crate) fn json(&self) -> bool {
        self.json
    }

    /// The configuration of a new run: defaults, then `--config`, then what else the command line says.
    pub(crate) fn resolved(&self) -> Result<RunConfig> {
        let base = match &self.config {
            Some(path) => RunConfig::read(path)?,
            None => RunConfig::default(),
        };
        let mut config = self.applied_to(base)?;
        for (path, name, option) in [(&config.dataset, "dataset", "DATASET"), (&config.output, "output", "--output")] {
            if path.as_os_str().is_empty() {
                bail!("the configuration names no `{name}`; give it there or as {option}");
            }
        }
        config.train.validate().map_err(anyhow::Error::msg)?;
        let QuantisationSteps { feature, log_scale, offset } = config.quantisation;
        for (name, step) in [("feature", feature), ("log_scale", log_scale), ("offset", offset)] {
            if !(step > 0.0 && step.is_finite()) {
                bail!("the quantisation step of `{name}` is {step}, needs a positive number");
            }
        }
        // Absolute, so that the run can go on from any folder.
        for path in [&mut config.dataset, &mut config.output] {
            *path = std::path::absolute(&path).with_context(|| format!("{} is no path", path.display()))?;
        }
        Ok(config)
    }

    /// `config` with everything replaced that the command line says.
    pub(crate) fn applied_to(&self, mut config: RunConfig) -> Result<RunConfig> {
        fn set<T: Clone>(into: &mut T, given: &Option<T>) {
            if let Some(value) = given {
                *into = value.clone();
            }
        }
        // Absolute, so that the run can go on from any folder.
        for (into, given) in [(&mut config.dataset, &self.dataset), (&mut config.output, &self.output)] {
            if let Some(path) = given {
                *into = std::path::absolute(path).with_context(|| format!("{} is no path", path.display()))?;
            }
        }
        config.capture = self.capture.or(&config.capture);
        config.checkpoint_every = self.checkpoint_every.or(config.checkpoint_every);
        config.keep_checkpoints |= self.keep_checkpoints;
        if let Some(backbone) = self.backbone {
            config.train = config.train.with_backbone(backbone.into());
        }
        set(&mut config.quantisation.feature, &self.feature_step);
        let train = &mut config.train;
        set(&mut train.iterations, &self.iterations);
        set(&mut train.seed, &self.seed);
        set(&mut train.hac.lambda, &self.lambda);
        set(&mut train.validation_every, &self.validation_every);
        train.voxel_size = self.voxel_size.or(train.voxel_size);
        train.densification.max_anchors = self.max_anchors.or(train.densification.max_anchors);
        set(&mut train.shape.feature_dim, &self.feature_dim);
        set(&mut train.shape.n_offsets, &self.offsets);
        set(&mut train.shape.view_direction, &self.no_view_direction.map(|no| !no));
        set(&mut train.shape.view_distance, &self.view_distance);
        set(&mut train.shape.dilation_compensation, &self.dilation_compensation);
        Ok(config)
    }

    /// Where a new run works.
    pub(crate) fn run_folder(&self, config: &RunConfig) -> Result<PathBuf> {
        let folder = self.run.clone().unwrap_or_else(|| config.output.with_extension("run"));
        if std::path::absolute(&folder).ok() == std::path::absolute(&config.output).ok() {
            bail!("{} can not be both bundle and run folder; choose another folder with --run", folder.display());
        }
        Ok(folder)
    }
}
