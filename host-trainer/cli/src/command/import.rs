//! `pocketsplat import`: explicit Gaussians in, a bundle out.

mod cameras;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Background, Capture, FrameSize};
use pocketsplat_core::Budget;
use pocketsplat_files::shell_word;
use pocketsplat_gaussians::Frame;
use pocketsplat_trainer::explicit::bulk::Bulk;
use pocketsplat_trainer::explicit::frame;
use pocketsplat_trainer::explicit::pictures::{Pictures, capture};
use pocketsplat_trainer::train::config::ExposureChoice;
use pocketsplat_trainer::train::run::RunFolder;
use serde::Serialize;

use super::device_args::DeviceArgs;
use super::devices::DeviceOption;
use super::gaussians::{AxesArgs, GaussiansFile};
use super::loss::{LossArgs, loss_at_30_db};
use super::outputs::{BUNDLE, OverwriteArgs, check_name};
use super::settings::QualityOptions;
use super::stand::{StandArgs, bulk_of};
use super::train::{Attempt, GoesOn, HeldOut, TrainResult, begun_or_new, train_in};
use super::train_args::{check_lambda, run_folder};
use super::{output, process, stop};
use crate::config::heading::{INPUT, OUTPUT, QUALITY, RUN};
use crate::config::named::{BACKGROUNDS, one_of};
use crate::config::{CaptureOptions, RunConfig, absolute};
use crate::say::say;

/// Longest side of the pictures unless the user says otherwise, px.
const LONGEST_PX: u32 = 200;

/// One camera in so many is held out.
const HELD_OUT_EVERY: usize = 8;
/// Pictures wait in memory, and training takes some of its own.
const MOST_PICTURE_BYTES: u64 = 4_000_000_000;

/// Centres that training starts from, at most.
const N_POINTS: usize = 20_000;

/// Training steps: at 200 px about ten minutes on two cores.
const ITERATIONS: u32 = 5_000;

/// Weight of a value's bits in the loss.
const LAMBDA: f64 = 0.0005;

/// Compress splats that exist already into a bundle.
///
/// Draws pictures of the splats, trains a bundle on them, and measures what it lost.
///
/// Cameras stand around the scene's bulk or inside it, wherever more of it is seen; --cameras gives others. What was interrupted goes on
/// when the same command is given again.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The splats: .ply, .spz, .sog, .splat or .glb.
    points: PathBuf,
    /// Cameras to draw with, in the frame of the splats: a transforms.json, or a file as `render --camera` reads it
    /// [default: generated]
    #[arg(long, value_name = "FILE.json", help_heading = INPUT)]
    cameras: Option<PathBuf>,
    #[command(flatten)]
    stand: StandArgs,
    /// Generated cameras to train with; one for every seven of them is added to measure with.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(7..=10_000),
        conflicts_with = "cameras", help_heading = INPUT)]
    views: u32,
    /// Size of the pictures [default: 200x200; with --cameras theirs, at most 200 px]
    #[arg(long, value_name = "WxH", help_heading = INPUT)]
    resolution: Option<FrameSize>,
    #[command(flatten)]
    axes: AxesArgs,
    /// Colour behind the splats
    #[arg(long, value_name = "COLOUR", value_parser = one_of::<Background>(BACKGROUNDS), default_value = BACKGROUNDS[0],
        help_heading = INPUT)]
    background: Background,
    /// Bundle to write.
    #[arg(short, long, value_name = "OUT.psb", help_heading = OUTPUT)]
    output: PathBuf,
    /// Folder for configuration, progress and checkpoints [default: OUT.run]
    #[arg(long, value_name = "DIR", help_heading = OUTPUT)]
    run: Option<PathBuf>,
    /// Print the result as JSON [default: as text]
    #[arg(long, help_heading = OUTPUT)]
    json: bool,
    #[command(flatten)]
    loss: LossArgs,
    #[command(flatten)]
    quality: QualityOptions,
    /// Rate weight: a larger one makes smaller files [default: 0.0005; by the limits for a device]
    #[arg(long, value_name = "X", help_heading = QUALITY)]
    lambda: Option<f64>,
    #[command(flatten)]
    device: DeviceArgs,
    /// Seed of all random numbers: the same seed on the same machine gives the same bundle.
    #[arg(long, value_name = "N", default_value_t = 42, help_heading = RUN)]
    seed: u64,
    #[command(flatten)]
    trainer: DeviceOption,
    #[command(flatten)]
    overwrite: OverwriteArgs,
}

/// What an import reports.
#[derive(Debug, Serialize)]
struct ImportResult {
    bundle: PathBuf,
    bundle_bytes: usize,
    /// Of the file that was imported.
    original_bytes: usize,
    /// How many times smaller the bundle is.
    times_smaller: f64,
    original_gaussians: usize,
    /// Of them, those where no anchor begins, because they lie too far out.
    n_strays: usize,
    n_anchors: usize,
    drawn_offsets: usize,
    /// Of the bundle's frames to the original's, from cameras that training did not have.
    psnr_to_original_db: f64,
    /// What splats 30 dB from their photographs lose by that.
    loss_at_30_db: f64,
    ssim_to_original: f64,
    n_held_out_views: usize,
    n_training_views: usize,
    iterations: u32,
    train_s: f64,
    train_processor_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    peak_memory_bytes: Option<u64>,
}

pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    // What another format needs is written of the file that is imported.
    check_name(&args.output, BUNDLE, GaussiansFile::is_one(&args.output).then_some(&args.points))?;
    args.loss.check()?;
    let mut config = configured(args)?;
    let outputs = args.overwrite.outputs().reading(&args.points);
    let mut outputs = args.cameras.iter().fold(outputs, |outputs, path| outputs.reading(path));
    let output = outputs.file(&args.output, BUNDLE)?;
    let folder = run_folder(args.run.as_deref(), &args.output, args.overwrite.is_given())?;
    // Whose folder it is, before pictures are drawn for minutes; which run is in it says the configuration.
    RunFolder::check(&folder, true)?;
    let file = GaussiansFile::read(&args.points, args.axes)?;
    let Seen { bulk, train, test } = seen(args, config.capture.resolution, &file)?;
    let capture = captured(args, &file, &bulk, [&train, &test])?;
    say!(
        "{} Gaussians in {:.1} MB, drawn from {} cameras, {} of them held out",
        file.gaussians.len(),
        file.n_bytes as f64 / 1e6,
        train.len() + test.len(),
        test.len()
    );
    config.train = config.train.resolved_for(&capture);
    let (device, stop) = (args.trainer.trains_on.open()?, stop::flag()?);
    let (folder, start) = begun_or_new(&folder, &config, args.overwrite.is_given())?;
    let attempt = Attempt { device, stop: &stop, goes_on: GoesOn::SameCommand };
    let Some(trained) = train_in(folder, &config, &capture, start, attempt, &output)? else {
        return Ok(ExitCode::from(stop::INTERRUPTED));
    };
    let result = result(&file, &bulk, &capture, trained)?;
    output::print(&result, args.json)?;
    if output.is_file() {
        say!("see it:  pocketsplat view {} -o scene.html", shell_word(&args.output));
    }
    let remedy = "a smaller --lambda, more --iterations or the photographs' own --cameras lose less";
    Ok(args.loss.hold(&args.output, result.loss_at_30_db, remedy))
}

/// What is trained: as `train` does it, with the effects that every scene can have.
fn configured(args: &Args) -> Result<RunConfig> {
    let mut config = RunConfig::default();
    (config.dataset, config.output) = (absolute(&args.points)?, absolute(&args.output)?);
    config.scales_lambda = false;
    config.train.hac.lambda = args.lambda.unwrap_or(LAMBDA);
    config.train.iterations = ITERATIONS;
    config.train.seed = args.seed;
    config.effects.auto = false;
    // Pictures drawn of one scene.
    config.train.exposure = ExposureChoice::Off;
    args.quality.apply_to(&mut config)?;
    if config.effects.auto {
        bail!("import measures no effects; name them, as --effects +view-colour, and leave auto to train");
    }
    check_lambda(args.lambda, config.train.backbone)?;
    args.device.choose(&args.quality, args.lambda, &mut config)?;
    config.capture = CaptureOptions {
        max_resolution: None,
        resolution: args.device.frame(args.resolution, false)?,
        background: Some(args.background),
        ..CaptureOptions::default()
    };
    config.train.shape = config.train.modules.shape(config.train.shape);
    config.check()?;
    Ok(config)
}

/// What is seen, and from where.
struct Seen {
    bulk: Bulk,
    train: Vec<Camera>,
    /// Held out.
    test: Vec<Camera>,
}

/// * `size`: of the pictures, if it is asked for.
fn seen(args: &Args, size: Option<FrameSize>, file: &GaussiansFile) -> Result<Seen> {
    let (bulk, all) = match &args.cameras {
        Some(path) => {
            args.stand.refuse("--cameras has some")?;
            let of_scene = cameras::of_file(path, size, LONGEST_PX)?;
            (bulk_of(&args.points, file)?, of_scene.iter().map(|camera| file.camera(camera)).collect())
        }
        None => {
            let size_px = size.map_or([LONGEST_PX; 2], |frame| [frame.width_px, frame.height_px]);
            let stand = args.stand.stand(&args.points, file)?;
            let all = stand.cameras(args.views as usize * HELD_OUT_EVERY / (HELD_OUT_EVERY - 1), size_px);
            (stand.bulk, all)
        }
    };
    let largest = all.iter().map(|camera| camera.width_px.max(camera.height_px)).max().unwrap_or(0);
    let most_px = Budget::MAX_FRAME_PX;
    if largest > u32::from(most_px) {
        bail!(
            "pictures of {largest} px are wider or higher than the {most_px} px that the decoder draws; use --resolution"
        );
    }
    let n_bytes: u64 = all.iter().map(|camera| 3 * u64::from(camera.width_px) * u64::from(camera.height_px)).sum();
    if n_bytes > MOST_PICTURE_BYTES {
        bail!(
            "{} pictures take {:.1} GB of memory, needed: at most {:.1}; ask for a smaller --resolution or fewer cameras",
            all.len(),
            n_bytes as f64 / 1e9,
            MOST_PICTURE_BYTES as f64 / 1e9
        );
    }
    let (mut train, mut test) = (Vec::new(), Vec::new());
    for (i, camera) in all.into_iter().enumerate() {
        if i % HELD_OUT_EVERY == HELD_OUT_EVERY - 1 { test.push(camera) } else { train.push(camera) }
    }
    if train.len() < 2 || test.is_empty() {
        bail!("there are {} cameras, needs {HELD_OUT_EVERY}: one in so many is held out", train.len() + test.len());
    }
    Ok(Seen { bulk, train, test })
}

/// * `cameras`: to train with, and held out.
fn captured(args: &Args, file: &GaussiansFile, bulk: &Bulk, cameras: [&[Camera]; 2]) -> Result<Capture> {
    let background = args.background.rgb8().map(|channel| f32::from(channel) / 255.0);
    let how = Pictures { compensation: file.compensation(), background, n_points: N_POINTS, seed: args.seed };
    let centre = args.cameras.is_none().then_some(bulk.centre);
    let capture = capture(&file.gaussians, bulk, centre, cameras, &how);
    let mut capture = capture.context("all cameras stand in one point; give --cameras that stand apart")?;
    capture.normalisation = frame::of_scene_through_file(&file.notes.frame, &capture.normalisation);
    warn_of_the_blind(args, bulk, &file.notes.frame, &capture)?;
    Ok(capture)
}

/// Says how many cameras see no Gaussian.
///
/// * `frame`: where the numbers of `bulk` lie in the scene, which the cameras stand in.
///
/// # Errors
/// None sees one: cameras of another frame, or with other axes.
fn warn_of_the_blind(args: &Args, bulk: &Bulk, frame: &Frame, capture: &Capture) -> Result<()> {
    let background = args.background.rgb8();
    let mut n_seeing = 0;
    for view in &capture.train {
        n_seeing += usize::from(view.photograph()?.image.rgb.chunks_exact(3).any(|rgb| *rgb != background));
    }
    let n = capture.train.len();
    let [x, y, z] = std::array::from_fn(|i| frame.offset[i] + frame.scale * bulk.centre[i]);
    let whose = args.cameras.as_deref().map(|path| format!(" of {}", path.display())).unwrap_or_default();
    let what = format!(
        "of {n} cameras{whose} {n_seeing} see a Gaussian of {}, whose bulk has its middle at ({x:.4}, {y:.4}, {z:.4}) and a radius of {:.4}",
        args.points.display(),
        frame.scale * bulk.radius
    );
    if n_seeing == 0 {
        bail!(
            "{what}; needed: cameras in the frame of the scene, that look at the splats, in front of a --background of another colour"
        );
    }
    if n_seeing < n {
        say!("warning: {what}");
    }
    Ok(())
}

fn result(file: &GaussiansFile, bulk: &Bulk, capture: &Capture, trained: TrainResult) -> Result<ImportResult> {
    let TrainResult { bundle, bundle_bytes, n_anchors, drawn_offsets, iterations, train_s, .. } = trained;
    let HeldOut { psnr_db, ssim, n_test_views, .. } = trained.held_out.context("cameras are held out")?;
    Ok(ImportResult {
        bundle,
        bundle_bytes,
        original_bytes: file.n_bytes,
        times_smaller: file.n_bytes as f64 / bundle_bytes as f64,
        original_gaussians: file.gaussians.len(),
        n_strays: bulk.n_strays,
        n_anchors,
        drawn_offsets,
        psnr_to_original_db: psnr_db,
        loss_at_30_db: loss_at_30_db(psnr_db),
        ssim_to_original: ssim,
        n_held_out_views: n_test_views,
        n_training_views: capture.train.len(),
        iterations,
        train_s,
        train_processor_s: trained.train_processor_s,
        peak_memory_bytes: process::peak_memory_bytes(),
    })
}
