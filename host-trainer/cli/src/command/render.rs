//! `pocketsplat render`: views of a capture, or of a bundle alone, as pictures.

mod cameras;
mod explicit;
mod pictures;

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Image, Split, View};
use pocketsplat_codec::render::decoder::core_image;
use pocketsplat_codec::render::reference::ReferenceScene;
use pocketsplat_files::Outputs;
use pocketsplat_format::Bundle;
use rayon::prelude::*;

use super::bundle::BundleFile;
use super::capture::{CaptureArgs, views_of};
use super::eval::{Renderer, reference_image};
use super::gaussians::{AxesArgs, GaussiansFile};
use super::output;
use super::outputs::{OverwriteArgs, reading_capture};
use super::stand::StandArgs;
use crate::config::CaptureOptions;
use crate::config::named::{SPLITS, one_of};
pub(super) use cameras::CameraRecord;
use cameras::Shot;
use pictures::{Format, Target};

/// Options that speak of a capture, which pictures of a bundle alone do without.
const OF_A_CAPTURE: [&str; 9] =
    ["dataset", "split", "max_resolution", "background", "scene", "images", "model", "test_every", "points"];

/// Draw a bundle as pictures.
///
/// Views of a capture, the bundle's own camera, a turn around it, or cameras of a file.
///
/// Draws a .ply, .spz, .sog or .glb too; one without a camera of its own is looked at from where `import` would begin.
#[derive(clap::Args)]
#[command(group = clap::ArgGroup::new("cameras").required(true).args(["view", "all", "preview", "orbit", "camera"]))]
pub(crate) struct Args {
    /// The bundle, or a .ply, .spz, .sog or .glb file of Gaussians.
    bundle: PathBuf,
    /// Folder of the capture, as for eval
    #[arg(required_unless_present_any = ["preview", "orbit", "camera"])]
    dataset: Option<PathBuf>,
    #[command(flatten)]
    options: CaptureOptions,
    #[command(flatten)]
    stand: StandArgs,
    #[command(flatten)]
    axes: AxesArgs,
    /// Which view of the split, from 0.
    #[arg(long, value_name = "I")]
    view: Option<usize>,
    /// Draw every view of the split.
    #[arg(long)]
    all: bool,
    /// Draw the bundle's own camera, which a device draws first; with --resolution at the size of its display
    #[arg(long, conflicts_with_all = OF_A_CAPTURE)]
    preview: bool,
    /// Draw N pictures of a turn around the scene, from the bundle's own camera on.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=3600), conflicts_with_all = OF_A_CAPTURE)]
    orbit: Option<u16>,
    /// Draw the cameras of a file: {"cameras": [...]}, each as `inspect --json` prints `preview`.
    #[arg(long, value_name = "FILE.json", conflicts_with_all = OF_A_CAPTURE, conflicts_with = "resolution")]
    camera: Option<PathBuf>,
    /// Which views.
    #[arg(long, value_parser = one_of::<Split>(SPLITS), default_value = SPLITS[0])]
    split: Split,
    /// What to write: .png or .jpg; of several pictures .gif, .apng, or a folder for numbered .png.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Put all pictures on one sheet, a .png or .jpg.
    #[arg(long)]
    contact_sheet: bool,
    /// What draws it.
    #[arg(long, value_enum, default_value_t = Renderer::Core)]
    renderer: Renderer,
    #[command(flatten)]
    overwrite: OverwriteArgs,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let format = Format::of(&args.output, &args.bundle)?;
    let mut outputs = args.outputs();
    let target = Target::checked(&args.output, format, &mut outputs)?;
    let (shots, pictures) = if GaussiansFile::is_one(&args.bundle) {
        let scene = explicit::Shown::read(args)?;
        format.check(scene.shots.len(), args.contact_sheet, &args.output)?;
        scene.draw()
    } else {
        args.stand.refuse("a bundle has a camera of its own")?;
        args.axes.refuse_unless(false, &args.bundle)?;
        let file = BundleFile::read(&args.bundle)?;
        let bundle = file.parse()?;
        let shots = shots(args, &file, &bundle)?;
        format.check(shots.len(), args.contact_sheet, &args.output)?;
        let pictures = draw(&bundle, &shots, args.renderer)?;
        (shots, pictures)
    };
    target.write(&pictures, args.contact_sheet)?;
    let (Some(picture), Some(shot)) = (pictures.first(), shots.first()) else {
        bail!("there is no view to draw");
    };
    let what = if let [shot] = &shots[..] {
        shot.name.clone()
    } else {
        format!("{} pictures from {}", shots.len(), shot.name)
    };
    let place = args.output.display();
    output::print_text(&format!("{place}: {}×{} px, {what}\n", picture.width_px, picture.height_px))
}

impl Args {
    /// What may be written, and what is read.
    fn outputs(&self) -> Outputs {
        let outputs = self.overwrite.outputs().reading(&self.bundle);
        let outputs = self.camera.iter().fold(outputs, |outputs, path| outputs.reading(path));
        let Some(dataset) = &self.dataset else { return outputs };
        let capture = CaptureArgs { dataset: dataset.clone(), options: self.options.clone() };
        reading_capture(outputs, &capture, &self.output)
    }
}

/// The cameras of a file as `--camera` reads it.
pub(super) fn cameras_of_file(path: &Path) -> Result<Vec<Camera>> {
    Ok(cameras::of_file(path)?.into_iter().map(|shot| shot.camera).collect())
}

/// What to draw, in its order.
fn shots(args: &Args, file: &BundleFile, bundle: &Bundle<'_>) -> Result<Vec<Shot>> {
    if let Some(path) = &args.camera {
        return cameras::of_file(path);
    }
    if let Some(n) = args.orbit {
        return cameras::orbit(bundle, args.options.resolution, n);
    }
    let Some(dataset) = &args.dataset else { return Ok(vec![cameras::preview(bundle, args.options.resolution)?]) };
    let capture = CaptureArgs { dataset: dataset.clone(), options: args.options.clone() };
    let (_, capture) = file.load(bundle, &capture)?;
    let views = views_of(&capture, args.split)?;
    let shot = |view: &View| Shot { name: format!("view {}", view.name), camera: file.camera(bundle, &capture, view) };
    let Some(index) = args.view else { return Ok(views.iter().map(shot).collect()) };
    match views.get(index) {
        Some(view) => Ok(vec![shot(view)]),
        None => bail!("--view {index} of {} views; choose 0 to {}", views.len(), views.len() - 1),
    }
}

fn draw(bundle: &Bundle<'_>, shots: &[Shot], renderer: Renderer) -> Result<Vec<Image>> {
    let reference = match renderer {
        Renderer::Core => None,
        Renderer::Reference => Some(ReferenceScene::from_bundle(bundle)?),
    };
    let draw = |shot: &Shot| match &reference {
        None => Ok(core_image(bundle, &shot.camera)?.image),
        Some(scene) => Ok(reference_image(bundle, scene, &shot.camera)),
    };
    shots.par_iter().map(draw).collect()
}
