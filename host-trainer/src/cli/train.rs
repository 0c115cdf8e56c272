//! `pocketsplat train`: a capture in, a bundle out.

use std::path::{Path, PathBuf};

use anyhow::Result;
use pocketsplat::bundle::{self, BundleInfo, QuantisationSteps};
use pocketsplat::dataset::{Background, Capture};
use pocketsplat::scene::{ModelShape, Scene};
use pocketsplat::train::{TrainConfig, Trainer};
use serde::Serialize;

use super::capture::CaptureArgs;
use super::output;
use super::progress::Progress;

/// The kinds of scene that can be trained.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Backbone {
    /// Scaffold-GS: anchors, three heads, static entropy tables.
    Scaffold,
}

/// Train a scene from a capture and write it as a bundle.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    capture: CaptureArgs,
    /// The bundle to write.
    #[arg(short, long, value_name = "OUT.psb")]
    output: PathBuf,
    /// Kind of scene.
    #[arg(long, value_enum, default_value_t = Backbone::Scaffold)]
    backbone: Backbone,
    /// Training steps; schedules scale with them.
    #[arg(long, default_value_t = TrainConfig::default().iterations)]
    iterations: u32,
    /// Everything random follows from it: same seed, same machine, same bundle.
    #[arg(long, default_value_t = TrainConfig::default().seed)]
    seed: u64,
    /// Feature width of an anchor, and hidden width of the heads.
    #[arg(long, value_name = "F", default_value_t = TrainConfig::default().shape.feature_dim)]
    feature_dim: usize,
    /// Gaussians of an anchor.
    #[arg(long, value_name = "K", default_value_t = TrainConfig::default().shape.n_offsets)]
    offsets: usize,
    /// Do not show the heads the direction of view.
    #[arg(long)]
    no_view_direction: bool,
    /// Show the heads the distance of view.
    #[arg(long)]
    view_distance: bool,
    /// Compensate opacities for the 0.3 px² dilation, for drawing at other resolutions than the training one.
    #[arg(long)]
    dilation_compensation: bool,
    /// Edge of a lattice cell, normalised units (the cameras span about 5).
    #[arg(long, default_value_t = TrainConfig::default().voxel_size)]
    voxel_size: f64,
    /// Quantisation step of the anchor features.
    #[arg(long, default_value_t = QuantisationSteps::default().feature)]
    feature_step: f32,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// What a finished run reports.
#[derive(Debug, Serialize)]
pub(crate) struct TrainResult {
    pub(crate) bundle: PathBuf,
    pub(crate) bundle_bytes: usize,
    pub(crate) n_anchors: usize,
    pub(crate) bytes_per_anchor: f64,
    pub(crate) iterations: u32,
    pub(crate) train_s: f64,
    pub(crate) iterations_per_s: f64,
    pub(crate) background: String,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let Backbone::Scaffold = args.backbone;
    let config = TrainConfig {
        shape: ModelShape {
            feature_dim: args.feature_dim,
            n_offsets: args.offsets,
            view_direction: !args.no_view_direction,
            view_distance: args.view_distance,
            dilation_compensation: args.dilation_compensation,
        },
        iterations: args.iterations,
        seed: args.seed,
        voxel_size: args.voxel_size,
        ..TrainConfig::default()
    };
    config.validate().map_err(anyhow::Error::msg)?;
    let steps = QuantisationSteps { feature: args.feature_step, ..QuantisationSteps::default() };
    output::check_writable(&args.output)?;
    let capture = args.capture.load(args.seed)?;
    let result = train(&capture, args.capture.background.unwrap_or(Background::Black), config, &steps, &args.output)?;
    output::print(&result, args.json)
}

/// Trains and writes the bundle.
pub(crate) fn train(
    capture: &Capture,
    background: Background,
    config: TrainConfig,
    steps: &QuantisationSteps,
    output: &Path,
) -> Result<TrainResult> {
    let mut trainer = Trainer::new(capture, config)?;
    let mut progress = Progress::new(config.iterations);
    trainer.run(&mut progress);
    let train_s = progress.elapsed().as_secs_f64();
    let bytes = encode(&trainer.scene, capture, background, steps)?;
    output::write_whole(output, &bytes)?;
    let n_anchors = trainer.scene.anchors.len();
    Ok(TrainResult {
        bundle: output.to_owned(),
        bundle_bytes: bytes.len(),
        n_anchors,
        bytes_per_anchor: bytes.len() as f64 / n_anchors as f64,
        iterations: config.iterations,
        train_s,
        iterations_per_s: f64::from(config.iterations) / train_s,
        background: background.to_string(),
    })
}

fn encode(scene: &Scene<f32>, capture: &Capture, background: Background, steps: &QuantisationSteps) -> Result<Vec<u8>> {
    let info = BundleInfo {
        normalisation: capture.normalisation,
        background: background.rgb8(),
        training_px: [capture.train[0].camera.width_px, capture.train[0].camera.height_px],
        // Any training view will do for a device that has no camera of its own; the first is as good as another.
        preview: capture.train[0].camera.clone(),
    };
    Ok(bundle::write(scene, &info, steps)?)
}
