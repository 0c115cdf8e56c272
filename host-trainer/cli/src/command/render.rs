//! `pocketsplat render`: one view as a PNG or a JPEG.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{FrameSize, Image, Split};
use pocketsplat_core::Bundle;
use pocketsplat_trainer::camera::host_camera;
use pocketsplat_trainer::render::decoder::core_image;
use pocketsplat_trainer::render::reference::ReferenceScene;

use super::bundle::BundleFile;
use super::capture::{CaptureArgs, views_of};
use super::eval::{Renderer, reference_image};
use super::fit::frame_budget;
use super::output;
use crate::config::CaptureOptions;
use crate::config::named::{SPLITS, one_of};

/// Draw one view of a capture from a bundle, or the bundle's own camera.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The bundle.
    bundle: PathBuf,
    /// Folder of the capture, as for eval
    #[arg(required_unless_present = "preview")]
    dataset: Option<PathBuf>,
    #[command(flatten)]
    options: CaptureOptions,
    /// Which view of the split, from 0.
    #[arg(long, value_name = "I", required_unless_present = "preview")]
    view: Option<usize>,
    /// Draw the bundle's own camera instead, which a device draws first; with --resolution at the size of its display
    #[arg(long, conflicts_with_all = [
        "dataset", "view", "split", "max_resolution", "background", "images", "model", "test_every"
    ])]
    preview: bool,
    /// Which views.
    #[arg(long, value_parser = one_of::<Split>(SPLITS), default_value = SPLITS[0])]
    split: Split,
    /// The picture to write: a PNG, or a JPEG where the name ends in .jpg or .jpeg.
    #[arg(short, long, value_name = "OUT.png")]
    output: PathBuf,
    /// What draws it.
    #[arg(long, value_enum, default_value_t = Renderer::Core)]
    renderer: Renderer,
}

/// Writes an image to a file.
type Writer = fn(&Image, &Path) -> Result<(), image::ImageError>;

/// The format that the end of a picture's name asks for.
fn writer(path: &Path) -> Result<Writer> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match extension.as_str() {
        "png" => Ok(Image::write_png),
        "jpg" | "jpeg" => Ok(Image::write_jpeg),
        _ => bail!("{}: pictures are written as .png, .jpg or .jpeg; end the name in one of these", path.display()),
    }
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let file = BundleFile::read(&args.bundle)?;
    let bundle = file.parse()?;
    let write = writer(&args.output)?;
    output::check_writable(&args.output)?;
    let (camera, name) = match (&args.dataset, args.view) {
        (Some(dataset), Some(index)) => {
            let capture = CaptureArgs { dataset: dataset.clone(), options: args.options.clone() };
            let (_, capture) = file.load(&bundle, &capture)?;
            let views = views_of(&capture, args.split)?;
            let Some(view) = views.get(index) else {
                bail!("--view {index} of {} views; choose 0 to {}", views.len(), views.len() - 1);
            };
            (file.camera(&bundle, &capture, view), format!("view {}", view.name))
        }
        // The command line has both or neither.
        _ => (preview(&bundle, args.options.resolution)?, "preview".to_owned()),
    };
    let image = match args.renderer {
        Renderer::Core => core_image(&bundle, &camera)?.image,
        Renderer::Reference => reference_image(&bundle, &ReferenceScene::from_bundle(&bundle)?, &camera),
    };
    write(&image, &args.output).with_context(|| format!("could not write {}", args.output.display()))?;
    println!("{}: {}×{} px, {name}", args.output.display(), image.width_px, image.height_px);
    Ok(())
}

/// The camera in the bundle, at its own size or scaled to a display's, as a firmware scales it.
fn preview(bundle: &Bundle<'_>, size: Option<FrameSize>) -> Result<Camera> {
    let preview = bundle.header().preview;
    let Some(_) = size else { return Ok(host_camera(&preview)) };
    let frame = frame_budget(bundle, size)?;
    Ok(host_camera(&preview.resized(frame.width_px, frame.height_px)))
}
