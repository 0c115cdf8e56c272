//! `pocketsplat export`: a bundle as explicit Gaussians, for programs that do not know bundles.

mod cameras;

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::Image;
use pocketsplat_core::Bundle;
use pocketsplat_files::Output;
use pocketsplat_gaussians::{Degree, Format, Gaussians};
use pocketsplat_trainer::bundle::{decoded_scene, normalisation_of};
use pocketsplat_trainer::explicit::frame;
use pocketsplat_trainer::explicit::render::Renderer;
use pocketsplat_trainer::export::{Refinement, bake, refine};
use pocketsplat_trainer::metrics::psnr_db;
use pocketsplat_trainer::ops::Pinhole;
use pocketsplat_trainer::render::decoder::core_image;
use rayon::prelude::*;
use serde::Serialize;

use super::bundle::BundleFile;
use super::capture::CaptureArgs;
use super::gaussians::GaussiansFile;
use super::output;
use super::outputs::{OverwriteArgs, command_that_makes, gaussians, reading_capture};
use super::progress::bar_of;
use crate::config::{CaptureOptions, Protocol};
use crate::say::say;
use cameras::Cameras;

/// Write a bundle as explicit Gaussians, which other programs draw: .ply, .spz or .sog.
///
/// Opacity, shape and colour of a bundle's Gaussians follow the view. A file keeps one opacity and one shape, and a colour in spherical
/// harmonics. They are fitted to what the training cameras see of the bundle, and the loss on the held-out views is measured with the
/// file as written. Without a capture, cameras are generated around what the bundle's own camera looks at. A file of Gaussians is
/// written in another format, as it is.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The bundle; or a .ply, .spz or .sog, to be written in another format.
    bundle: PathBuf,
    /// Folder of the capture, as for eval
    dataset: Option<PathBuf>,
    #[command(flatten)]
    options: CaptureOptions,
    /// The file to write; its name ends in .ply, .spz or .sog.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// How finely colours follow the view: degree of the spherical harmonics.
    #[arg(long, value_name = "0..3", value_parser = clap::value_parser!(u8).range(0..=3), default_value_t = 3)]
    sh_degree: u8,
    /// Steps of gradient descent towards the bundle's own pictures; 0 keeps the means over the views [default: 2000]
    #[arg(long, value_name = "N")]
    iterations: Option<u32>,
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
    /// Of the file's pictures to the bundle's.
    psnr_to_bundle_db: f64,
    n_views: usize,
    /// What was measured: test or train views of the capture, or generated cameras.
    split: String,
    seconds: f64,
}

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

    /// What Gaussians of the capture's frame show.
    fn pictures_of(&self, gaussians: &Gaussians, cameras: &[Camera]) -> Vec<Image> {
        let mut here = gaussians.clone();
        frame::to_normalised(&mut here, &normalisation_of(self.bundle));
        let renderer = Renderer::new(&here).with_compensation(self.compensation);
        cameras.par_iter().map(|camera| renderer.image(camera, self.background)).collect()
    }

    /// The bundle's Gaussians as a file has them, in the capture's frame, and the number that was left out.
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
        let mut gaussians = refine(baked.gaussians, &with, cameras.extent, on_step);
        bar.finish_and_clear();
        frame::to_capture(&mut gaussians, &normalisation_of(self.bundle));
        Ok((gaussians, baked.n_unseen))
    }
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let started = Instant::now();
    let format = Format::of_path(&args.output).ok_or_else(|| {
        let known = Format::ALL.map(|format| format!(".{}", format.extension())).join(", ");
        let command = command_that_makes(&args.output, &args.bundle);
        let command = command.map_or_else(String::new, |command| format!("; `{command}` makes such a file"));
        anyhow!("{}: export writes {known}; end the name in one of them{command}", args.output.display())
    })?;
    let outputs = args.overwrite.outputs().reading(&args.bundle);
    let mut outputs = args.dataset.iter().fold(outputs, |outputs, dataset| {
        let capture = CaptureArgs { dataset: dataset.clone(), options: args.options.clone() };
        reading_capture(outputs, &capture, &args.output)
    });
    let output = outputs.file(&args.output, gaussians(format))?;
    if GaussiansFile::is_one(&args.bundle) {
        return convert(args, format, &output);
    }
    if args.dataset.is_none() && args.options != CaptureOptions::default() {
        bail!("options of photographs need a capture; give its folder as CAPTURE, or leave them out");
    }
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
    let shown = source.pictures(&cameras.judged)?;
    let to_bundle = |pictures: &[Image]| {
        pictures.iter().zip(&shown).map(|(picture, shown)| psnr_db(picture, shown)).sum::<f64>() / shown.len() as f64
    };
    let bundle_psnr_db = cameras.psnr_db(&shown)?;
    // Of the numbers before they are rounded for the file; those of a .ply are not.
    let pictures = source.pictures_of(&gaussians, &cameras.judged);
    notes.compensation = source.compensation;
    notes.comments.push(comment(args, &cameras, to_bundle(&pictures), cameras.psnr_db(&pictures)?.zip(bundle_psnr_db)));

    let unreadable = |fault| anyhow!("{} {fault}", args.output.display());
    let bytes = format.to_bytes(&gaussians, &notes).map_err(unreadable)?;
    let (written, _) = format.from_bytes(&bytes).map_err(unreadable)?;
    output.write(&bytes)?;
    let pictures = source.pictures_of(&written, &cameras.judged);
    let file_psnr_db = cameras.psnr_db(&pictures)?;
    let export = Export {
        format: format.extension(),
        bytes: bytes.len(),
        bundle_bytes: file.bytes.len(),
        n_gaussians: written.len(),
        n_left_out,
        sh_degree: args.sh_degree,
        psnr_db: file_psnr_db,
        bundle_psnr_db,
        loss_db: bundle_psnr_db.zip(file_psnr_db).map(|(bundle, file)| bundle - file),
        psnr_to_bundle_db: to_bundle(&pictures),
        n_views: cameras.judged.len(),
        split: cameras.split,
        seconds: started.elapsed().as_secs_f64(),
    };
    output::print(&export, args.json)
}

/// A file of Gaussians in another format.
#[derive(Debug, Serialize)]
struct Conversion {
    format: &'static str,
    bytes: usize,
    source_bytes: usize,
    n_gaussians: usize,
    sh_degree: usize,
}

/// Writes the Gaussians of a file in another format; nothing is fitted.
fn convert(args: &Args, format: Format, output: &Output) -> Result<()> {
    if args.dataset.is_some() || args.iterations.is_some() || args.options != CaptureOptions::default() {
        bail!(
            "{} holds Gaussians, which are written as they are; leave CAPTURE, --iterations and options of photographs out",
            args.bundle.display()
        );
    }
    let file = GaussiansFile::read(&args.bundle)?;
    let gaussians = file.gaussians.reduced_to(Degree::ALL[usize::from(args.sh_degree)]);
    let bytes =
        format.to_bytes(&gaussians, &file.notes).map_err(|fault| anyhow!("{} {fault}", args.output.display()))?;
    output.write(&bytes)?;
    let conversion = Conversion {
        format: format.extension(),
        bytes: bytes.len(),
        source_bytes: file.n_bytes,
        n_gaussians: gaussians.len(),
        sh_degree: gaussians.degree.number(),
    };
    output::print(&conversion, args.json)
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
