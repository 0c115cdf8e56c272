//! `pocketsplat export`: a bundle as explicit Gaussians, for programs that do not know bundles.

mod cameras;
mod conversion;
mod rounding;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::Image;
use pocketsplat_codec::bundle::{decoded_scene, normalisation_of};
use pocketsplat_codec::render::decoder::core_image;
use pocketsplat_files::{Output, shell_word};
use pocketsplat_format::Bundle;
use pocketsplat_gaussians::{Degree, Format, Frame, Gaussians, Notes, Written};
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_trainer::explicit::frame;
use pocketsplat_trainer::explicit::render::Renderer;
use pocketsplat_trainer::export::{Refinement, bake, refine};
use rayon::prelude::*;
use serde::Serialize;

use super::bundle::BundleFile;
use super::capture::CaptureArgs;
use super::gaussians::{AxesArgs, GaussiansFile, write_gaussians};
use super::loss::{LossArgs, loss_at_30_db};
use super::output;
use super::outputs::{OverwriteArgs, command_that_makes, gaussians, reading_capture};
use super::progress::bar_of;
use crate::config::{CaptureOptions, Protocol};
use crate::say::say;
use cameras::Cameras;
use rounding::Rounding;

/// Write a bundle as explicit Gaussians that other programs draw: .ply, .spz, .sog or .glb.
///
/// Opacity, shape and colour of a bundle's Gaussians follow the view. A file keeps one opacity and one shape, and a colour in spherical
/// harmonics. They are fitted to what the training cameras see of the bundle, and the loss on the held-out views is measured with the
/// file as written. Without a capture, cameras are generated around what the bundle's own camera looks at. A file of Gaussians is
/// written in another format, and both are drawn to measure what that lost.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The bundle; or a .ply, .spz, .sog, .glb or .splat, to be written in another format.
    bundle: PathBuf,
    /// Folder of the capture, as for eval
    dataset: Option<PathBuf>,
    #[command(flatten)]
    options: CaptureOptions,
    /// The file to write; its name ends in .ply, .spz, .sog or .glb.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// How finely colours follow the view: degree of the spherical harmonics.
    #[arg(long, value_name = "0..3", value_parser = clap::value_parser!(u8).range(0..=3), default_value_t = 3)]
    sh_degree: u8,
    /// Steps of gradient descent towards the bundle's own pictures; 0 keeps the means over the views [default: 2000]
    #[arg(long, value_name = "N")]
    iterations: Option<u32>,
    #[command(flatten)]
    axes: AxesArgs,
    #[command(flatten)]
    loss: LossArgs,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    overwrite: OverwriteArgs,
}

/// Steps of gradient descent where nobody says how many.
const ITERATIONS: u32 = 2000;

/// What was written, and what it lost.
#[derive(Debug, Serialize)]
struct Export {
    format: &'static str,
    bytes: usize,
    bundle_bytes: usize,
    n_gaussians: usize,
    /// Offsets that no mask takes away, but no camera sees.
    n_left_out: usize,
    sh_degree: u8,
    /// Of the file, read again, to the photographs of the split.
    #[serde(skip_serializing_if = "Option::is_none")]
    psnr_db: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    bundle_psnr_db: Option<f64>,
    /// The bundle's less the file's.
    #[serde(skip_serializing_if = "Option::is_none")]
    loss_db: Option<f64>,
    /// What a scene of 30 dB loses by that, where there are no photographs.
    #[serde(skip_serializing_if = "Option::is_none")]
    loss_at_30_db: Option<f64>,
    /// Of the file's pictures to the bundle's.
    psnr_to_bundle_db: f64,
    /// The same before numbers were rounded to the file's.
    unrounded_psnr_to_bundle_db: f64,
    /// Where the file's numbers lie in the capture, where they are not its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    frame: Option<FrameRecord>,
    n_views: usize,
    /// What was measured: test or train views of the capture, or generated cameras.
    split: String,
    seconds: f64,
}

/// A point of the scene is `offset` + `scale` · the file's.
#[derive(Debug, Serialize)]
struct FrameRecord {
    offset: [f64; 3],
    scale: f64,
}

impl FrameRecord {
    /// `None` for the scene's own numbers.
    fn of(frame: &Frame) -> Option<Self> {
        (!frame.is_identity()).then_some(Self { offset: frame.offset, scale: frame.scale })
    }
}

/// Losses above it are warned of.
const LARGE_LOSS_DB: f64 = 0.5;

/// What a bundle draws with.
struct Source<'a> {
    bundle: &'a Bundle<'a>,
    background: [f32; 3],
    compensation: bool,
}

impl<'a> Source<'a> {
    fn new(bundle: &'a Bundle<'a>) -> Self {
        let header = bundle.header();
        let background = header.background.map(|channel| f32::from(channel) / 255.0);
        Self { bundle, background, compensation: header.features.effects.dilation_compensation }
    }

    /// What the bundle shows.
    fn pictures(&self, cameras: &[Camera]) -> Result<Vec<Image>> {
        cameras.par_iter().map(|camera| Ok(core_image(self.bundle, camera)?.image)).collect()
    }

    /// What Gaussians of the normalised frame show.
    fn pictures_of(&self, gaussians: &Gaussians, cameras: &[Camera]) -> Vec<Image> {
        let renderer = Renderer::new(gaussians).with_compensation(self.compensation);
        cameras.par_iter().map(|camera| renderer.image(camera, self.background)).collect()
    }

    /// The bundle's Gaussians as a file has them, in the normalised frame, and the number that was left out.
    fn gaussians(&self, cameras: &Cameras<'_>, degree: Degree, n_steps: u32) -> Result<(Gaussians, usize)> {
        let scene = decoded_scene(self.bundle).context("could not decode the bundle")?;
        let pinholes: Vec<Pinhole<f32>> = cameras.fitted.iter().map(Pinhole::new).collect();
        say!("what {} cameras see of {} anchors", pinholes.len(), scene.anchors.len());
        let baked = bake(&scene, &pinholes, degree);
        let pictures = if n_steps == 0 { Vec::new() } else { self.pictures(&cameras.fitted)? };
        let with = Refinement {
            cameras: &pinholes,
            pictures: &pictures,
            background: self.background,
            compensation: self.compensation,
            n_steps,
        };
        let bar = bar_of(0, n_steps);
        let on_step = |done: u32| bar.set_position(u64::from(done));
        let gaussians = refine(baked.gaussians, &with, cameras.extent, on_step);
        bar.finish_and_clear();
        Ok((gaussians, baked.n_unseen))
    }
}

pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    let started = Instant::now();
    let format = Format::of_path(&args.output).ok_or_else(|| no_format(args))?;
    args.loss.check()?;
    let outputs = args.overwrite.outputs().reading(&args.bundle);
    let mut outputs = args.dataset.iter().fold(outputs, |outputs, dataset| {
        let capture = CaptureArgs { dataset: dataset.clone(), options: args.options.clone() };
        reading_capture(outputs, &capture, &args.output)
    });
    let output = outputs.file(&args.output, gaussians(format))?;
    if GaussiansFile::is_one(&args.bundle) {
        return conversion::run(args, format, &output);
    }
    if args.dataset.is_none() && args.options != CaptureOptions::default() {
        bail!("options of photographs need a capture; give its folder as CAPTURE, or leave them out");
    }
    args.axes.refuse_unless(format == Format::Spz, &args.output)?;
    let file = BundleFile::read(&args.bundle)?;
    let bundle = file.parse()?;
    let source = Source::new(&bundle);
    let capture = match &args.dataset {
        Some(dataset) => {
            let capture = CaptureArgs { dataset: dataset.clone(), options: args.options.clone() };
            Some(file.load(&bundle, &capture)?)
        }
        None => None,
    };
    let (cameras, protocol) = match &capture {
        Some((options, capture)) => {
            (Cameras::of_capture(&file, &bundle, capture)?, Some(Protocol::of(capture, options)))
        }
        None => (Cameras::generated(&bundle)?, None),
    };
    let mut notes = GaussiansFile::notes_of(protocol.as_ref(), cameras.fitted.iter())?;

    let degree = Degree::ALL[usize::from(args.sh_degree)];
    let (gaussians, n_left_out) = source.gaussians(&cameras, degree, args.iterations.unwrap_or(ITERATIONS))?;
    if gaussians.is_empty() {
        bail!(
            "nothing is left of {}: its {} cameras see 0 Gaussians, needed: 1; give the folder of its photographs as CAPTURE",
            args.bundle.display(),
            cameras.fitted.len()
        );
    }
    let shown = source.pictures(&cameras.judged)?;
    let to_bundle = |pictures: &[Image]| rounding::mean_psnr_db(pictures, &shown);
    let bundle_psnr_db = cameras.psnr_db(&shown)?;
    // Of the numbers before they are rounded for the file.
    let unrounded = source.pictures_of(&gaussians, &cameras.judged);
    let unrounded_psnr_db = cameras.psnr_db(&unrounded)?;
    notes.compensation = source.compensation;
    notes.comments.push(comment(args, &cameras, to_bundle(&unrounded), unrounded_psnr_db.zip(bundle_psnr_db)));
    let normalisation = normalisation_of(&bundle);
    notes.frame = frame::of_normalised(&normalisation);
    notes.spz_axes = args.axes.spz_axes;

    let file_bytes = write_gaussians(format, &output, &gaussians, &notes)?;
    let (mut written, written_notes) = read_again(format, &output, &file_bytes, args)?;
    frame::to_normalised(&mut written, &frame::of_file(&written_notes.frame, &normalisation));
    let pictures = source.pictures_of(&written, &cameras.judged);
    let file_psnr_db = cameras.psnr_db(&pictures)?;
    let fitting_db = bundle_psnr_db.zip(unrounded_psnr_db).map(|(bundle, fitted)| bundle - fitted);
    let rounding_db = unrounded_psnr_db
        .zip(file_psnr_db)
        .map_or_else(|| loss_at_30_db(rounding::mean_psnr_db(&pictures, &unrounded)), |(fitted, file)| fitted - file);
    let rounding = Rounding {
        given: &gaussians,
        written: &written,
        sources: &file_bytes.sources,
        cameras: &cameras.judged,
        background: source.background,
        compensation: source.compensation,
    };
    warn_of_loss(&args.output, fitting_db, rounding_db, &rounding);
    let loss_db = bundle_psnr_db.zip(file_psnr_db).map(|(bundle, file)| bundle - file);
    let psnr_to_bundle_db = to_bundle(&pictures);
    let export = Export {
        format: format.extension(),
        bytes: file_bytes.bytes.len(),
        bundle_bytes: file.bytes.len(),
        n_gaussians: written.len(),
        n_left_out,
        sh_degree: args.sh_degree,
        psnr_db: file_psnr_db,
        bundle_psnr_db,
        loss_db,
        loss_at_30_db: loss_db.is_none().then(|| loss_at_30_db(psnr_to_bundle_db)),
        psnr_to_bundle_db,
        unrounded_psnr_to_bundle_db: to_bundle(&unrounded),
        frame: FrameRecord::of(&file_bytes.frame),
        n_views: cameras.judged.len(),
        split: cameras.split,
        seconds: started.elapsed().as_secs_f64(),
    };
    output::print(&export, args.json)?;
    let loss_db = loss_db.unwrap_or_else(|| loss_at_30_db(psnr_to_bundle_db));
    let degree = if args.sh_degree < 3 { " or a higher --sh-degree" } else { "" };
    Ok(args.loss.hold(
        &args.output,
        loss_db,
        &format!("more --iterations{degree} may lose less, and a .ply rounds nothing"),
    ))
}

/// The Gaussians of what was written, as others read them: not from the output, which may be a FIFO.
fn read_again(format: Format, output: &Output, written: &Written, args: &Args) -> Result<(Gaussians, Notes)> {
    let read = format.read(&written.bytes, args.axes.spz_axes);
    read.map_err(|fault| anyhow!("{} {fault}", output.path().display()))
}

/// Says where an export lost much.
///
/// * `fitting_db`: to the photographs, by one opacity and one shape for all views; `None` where there are none. * `rounding_db`: by the
///   file's numbers.
fn warn_of_loss(path: &Path, fitting_db: Option<f64>, rounding_db: f64, rounding: &Rounding<'_>) {
    let path = path.display();
    if let Some(loss) = fitting_db.filter(|loss| *loss > LARGE_LOSS_DB) {
        say!(
            "warning: {path}: one opacity and one shape for all views lose {loss:.2} dB, before any number is rounded; more --iterations or \
             a higher --sh-degree may lose less"
        );
    }
    if rounding_db > LARGE_LOSS_DB {
        say!("warning: {path}: the format's numbers lose {rounding_db:.2} dB, {}; a .ply loses none", rounding.worst());
    }
}

/// Says which names are written.
fn no_format(args: &Args) -> anyhow::Error {
    let path = &args.output;
    let known = Format::ALL.map(|format| format!(".{}", format.extension())).join(", ");
    if path.to_string_lossy().to_lowercase().ends_with(".compressed.ply") {
        let plain = Path::new("scene.ply");
        return anyhow!(
            "{}: this is the name of a compressed .ply, which is read and not written; write {known}, and compress a .ply with \
             `splat-transform {} {}`",
            path.display(),
            plain.display(),
            shell_word(path)
        );
    }
    let command = command_that_makes(path, &args.bundle);
    let command = command.map_or_else(String::new, |command| format!("; `{command}` makes such a file"));
    anyhow!("{}: export writes {known}; end the name in one of them{command}", path.display())
}

/// What the file says of its making; a .ply alone has room for it.
fn comment(args: &Args, cameras: &Cameras<'_>, to_bundle_db: f64, to_photographs: Option<(f64, f64)>) -> String {
    let name = args.bundle.file_name().unwrap_or_default().to_string_lossy();
    let (n, split) = (cameras.judged.len(), &cameras.split);
    match to_photographs {
        Some((own, bundle)) => {
            format!(
                "Exported by pocketsplat from {name}: {own:.3} dB on {n} {split} views, {:.3} dB below the bundle",
                bundle - own
            )
        }
        None => format!(
            "Exported by pocketsplat from {name}: {to_bundle_db:.3} dB to the bundle's pictures on {n} {split} cameras"
        ),
    }
}
