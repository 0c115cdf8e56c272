//! `pocketsplat render`: one view as a PNG or a JPEG.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use pocketsplat_capture::dataset::{Image, Split};
use pocketsplat_trainer::render::decoder::core_image;
use pocketsplat_trainer::render::reference::ReferenceScene;

use super::bundle::BundleFile;
use super::capture::{CaptureArgs, views_of};
use super::eval::{Renderer, reference_image};
use super::output;
use crate::config::named::{SPLITS, one_of};

/// Draw one view of a capture from a bundle.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The bundle.
    bundle: PathBuf,
    #[command(flatten)]
    capture: CaptureArgs,
    /// Which view of the split, from 0.
    #[arg(long, value_name = "I")]
    view: usize,
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
    let (_, capture) = file.load(&bundle, &args.capture)?;
    let views = views_of(&capture, args.split)?;
    let Some(view) = views.get(args.view) else {
        bail!("--view {} of {} views; choose 0 to {}", args.view, views.len(), views.len() - 1);
    };
    let camera = file.camera(&bundle, &capture, view);
    let image = match args.renderer {
        Renderer::Core => core_image(&bundle, &camera)?.image,
        Renderer::Reference => reference_image(&bundle, &ReferenceScene::from_bundle(&bundle)?, &camera),
    };
    write(&image, &args.output).with_context(|| format!("could not write {}", args.output.display()))?;
    println!("{}: {}×{} px, view {}", args.output.display(), image.width_px, image.height_px, view.name);
    Ok(())
}
