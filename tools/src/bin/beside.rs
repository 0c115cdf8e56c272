//! Puts images of one size beside each other, enlarged pixel by pixel: a device's frame beside the photograph.

use std::path::PathBuf;

use anyhow::{Context as _, bail};
use clap::Parser;
use image::imageops::{FilterType, replace, resize};
use image::{Rgb, RgbImage};

/// Pixels between two images.
const GAP_PX: u32 = 8;

/// Puts images of one size beside each other.
#[derive(Parser)]
struct Args {
    /// PNG, JPEG or PPM, from the left.
    #[arg(required = true)]
    images: Vec<PathBuf>,
    /// The PNG to write.
    #[arg(short, long)]
    output: PathBuf,
    /// How many pixels a pixel becomes along each axis.
    #[arg(long, default_value_t = 3)]
    enlarge: u32,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let read = |path: &PathBuf| {
        let image = image::open(path).with_context(|| format!("could not read {}", path.display()))?;
        anyhow::Ok(image.to_rgb8())
    };
    let images = args.images.iter().map(read).collect::<anyhow::Result<Vec<_>>>()?;
    let (width, height) = images[0].dimensions();
    for (path, image) in args.images.iter().zip(&images) {
        if image.dimensions() != (width, height) {
            let (w, h) = image.dimensions();
            bail!("{} is of {w}x{h} px, the first of {width}x{height}", path.display());
        }
    }
    let (wide, high) = (width * args.enlarge, height * args.enlarge);
    let n = u32::try_from(images.len())?;
    let mut all = RgbImage::from_pixel(n * wide + (n - 1) * GAP_PX, high, Rgb([255; 3]));
    for (i, image) in (0..).zip(&images) {
        replace(&mut all, &resize(image, wide, high, FilterType::Nearest), i * i64::from(wide + GAP_PX), 0);
    }
    all.save(&args.output).with_context(|| format!("could not write {}", args.output.display()))
}
