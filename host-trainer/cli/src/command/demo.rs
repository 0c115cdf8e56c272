//! `pocketsplat demo`: the whole path once, on a capture it makes itself.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use pocketsplat_capture::dataset::{Image, Split};
use pocketsplat_capture::synth::{SynthOptions, write_capture};
use pocketsplat_codec::render::decoder::core_image;
use pocketsplat_codec::render::reference::ReferenceScene;
use pocketsplat_files::Outputs;
use pocketsplat_trainer::train::run::RunFolder;

use super::bundle::BundleFile;
use super::capture::CaptureArgs;
use super::devices::DeviceOption;
use super::eval::{Measurements, Renderer, evaluate, reference_image};
use super::outputs::{BUNDLE, OverwriteArgs, PNG, keep, marked_png};
use super::train::{Attempt, GoesOn, begun_or_new, decide, train_in};
use super::{output, settings, stop};
use crate::config::{RunConfig, absolute};
use crate::say::say;

/// Train, compress and draw a procedural capture.
///
/// The whole path on a capture that it makes itself: about three minutes on two cores. What was interrupted goes on when the same
/// command is given again.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder for everything; a finished demo there is replaced, one that was interrupted goes on.
    #[arg(short, long, default_value = "demo")]
    output: PathBuf,
    /// Training steps.
    #[arg(long, default_value_t = 4000)]
    iterations: u32,
    /// Width and height of the images, pixels.
    #[arg(long, default_value_t = SynthOptions::default().size_px)]
    size: u32,
    #[command(flatten)]
    device: DeviceOption,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    overwrite: OverwriteArgs,
}

/// Where the demo's capture lies.
const CAPTURE: &str = "capture";
/// The same while it is being made.
const BEGUN: &str = ".capture-being-made";
/// Lies in a capture that a demo made, and only there: without it nothing is removed.
const MARKER: &str = ".made-by-pocketsplat-demo";

pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    let folder = &args.output;
    let capture_folder = folder.join(CAPTURE);
    Outputs::folder(folder)?;
    let mut outputs = args.overwrite.outputs();
    let bundle_output = outputs.file(&folder.join("scene.psb"), BUNDLE)?;
    let picture_output = outputs.file(&folder.join("truth_reference_decoder.png"), PNG)?;
    clear_capture(&capture_folder)?;
    say!("1 of 4  ray-tracing a capture into {}", capture_folder.display());
    // Under another name until it is whole, so that what an interrupt leaves is known to be nobody else's.
    let begun = folder.join(BEGUN);
    if begun.exists() {
        std::fs::remove_dir_all(&begun).with_context(|| format!("could not remove {}", begun.display()))?;
    }
    write_capture(&begun, &SynthOptions { size_px: args.size, ..SynthOptions::default() })?;
    keep(&begun.join(MARKER), b"")?;
    std::fs::rename(&begun, &capture_folder).with_context(|| format!("could not make {}", capture_folder.display()))?;

    say!("2 of 4  training {} steps", args.iterations);
    let bundle_path = bundle_output.path();
    let mut config = configured(args, &capture_folder, bundle_path)?;
    let capture_args = CaptureArgs { dataset: capture_folder, options: config.capture.clone() };
    let capture = capture_args.load_to_train(config.train.seed, None, &[])?;
    decide(&mut config, &capture)?;
    let stop = stop::flag()?;
    let (folder, start) = begun_or_new(&RunFolder::beside(bundle_path), &config, args.overwrite.is_given())?;
    let attempt = Attempt { device: args.device.trains_on.open()?, stop: &stop, goes_on: GoesOn::SameCommand };
    let Some(trained) = train_in(folder, &config, &capture, start, attempt, &bundle_output)? else {
        return Ok(ExitCode::from(stop::INTERRUPTED));
    };

    say!("3 of 4  drawing the held-out views with the decoder");
    let file = BundleFile::read(bundle_path)?;
    let what = Measurements { against_reference: true, per_tier: true, ..Measurements::default() };
    let evaluation = evaluate(&file, &capture_args, Split::Test, Renderer::Core, &what)?;

    let picture = picture_output.path();
    say!("4 of 4  {}: truth | f64 reference | decoder", picture.display());
    let bundle = file.parse()?;
    let view = &capture.test[0];
    let reference = reference_image(&bundle, &ReferenceScene::from_bundle(&bundle)?, &view.camera);
    let decoder = core_image(&bundle, &view.camera)?.image;
    let beside = side_by_side(&[&view.photograph()?.image, &reference, &decoder]);
    picture_output.write(&marked_png(&beside.to_png().context("could not encode the picture")?))?;

    let report = serde_json::json!({
        "bundle": bundle_path,
        "picture": picture,
        "psnr_db": evaluation.psnr_db,
        "half_size_copy_psnr_db": evaluation.half_size_copy_psnr_db,
        "ssim": evaluation.ssim,
        "psnr_db_without_40_percent": evaluation.tiers.first().map(|tier| tier.psnr_db),
        "decoder_to_reference_psnr_db": evaluation.psnr_to_reference_db,
        "bundle_bytes": evaluation.bundle_bytes,
        "n_anchors": evaluation.n_anchors,
        "train_s": trained.train_s,
        "render_s_per_view": evaluation.render_s_per_view,
        "scratch_bytes": evaluation.scratch_bytes,
    });
    output::print(&report, args.json)?;
    Ok(ExitCode::SUCCESS)
}

/// What is trained: as `train` does it, with tiers, for the bundle serves devices of several sizes.
fn configured(args: &Args, capture: &Path, bundle: &Path) -> Result<RunConfig> {
    let mut config = RunConfig { dataset: absolute(capture)?, output: absolute(bundle)?, ..RunConfig::default() };
    // As large as the capture is made.
    config.capture.max_resolution = None;
    config.effects.auto = false;
    config.train.iterations = args.iterations;
    config.train.modules.pruning = Some(settings::tiers_of(&config.train.modules));
    config.check()?;
    Ok(config)
}

/// Removes the capture of an earlier demo, and nothing that is not one.
fn clear_capture(folder: &Path) -> Result<()> {
    if !folder.exists() {
        return Ok(());
    }
    if !folder.join(MARKER).is_file() {
        bail!("{} exists and is not the capture of an earlier demo; choose another --output", folder.display());
    }
    std::fs::remove_dir_all(folder).with_context(|| format!("could not remove {}", folder.display()))
}

/// Width that a small picture is enlarged to, about, so that a person sees its pixels.
const PICTURE_PX: u32 = 1000;

/// Images of one size next to each other, each pixel as a square of pixels where they are small.
fn side_by_side(images: &[&Image]) -> Image {
    let (width, height) = (images[0].width_px, images[0].height_px);
    let n = u32::try_from(images.len()).unwrap_or(u32::MAX);
    let zoom = (PICTURE_PX / (n * width)).max(1);
    let pixel = |x: u32, y: u32| {
        let (image, x) = (images[(x / width) as usize], x % width);
        let at = 3 * (y * width + x) as usize;
        [image.rgb[at], image.rgb[at + 1], image.rgb[at + 2]]
    };
    let (width_px, height_px) = (n * width * zoom, height * zoom);
    let pixel = &pixel;
    let rgb = (0..height_px).flat_map(|y| (0..width_px).flat_map(move |x| pixel(x / zoom, y / zoom))).collect();
    Image { width_px, height_px, rgb }
}
