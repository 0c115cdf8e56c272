//! Draws a bundle's preview on this machine as a PPM file: what a device's frame is compared with.

use std::fs;
use std::path::PathBuf;

use anyhow::Context as _;
use clap::Parser;
use pocketsplat::bundle;
use pocketsplat::render::decoder::core_image;
use pocketsplat::render::host_camera;
use pocketsplat_core::Bundle;

/// Draws a bundle's preview with the decoder, as a PPM file.
#[derive(Parser)]
struct Args {
    /// The bundle.
    bundle: PathBuf,
    /// The PPM file to write.
    out: PathBuf,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let bytes = bundle::load(&args.bundle)?;
    let bundle = Bundle::parse(&bytes)?;
    let frame = core_image(&bundle, &host_camera(&bundle.header().preview))?;
    let mut ppm = format!("P6\n{} {}\n255\n", frame.image.width_px, frame.image.height_px).into_bytes();
    ppm.extend(&frame.image.rgb);
    fs::write(&args.out, ppm).with_context(|| format!("cannot write {}", args.out.display()))?;
    println!("{}: {:?}, {} bytes of scratch", args.out.display(), frame.report, frame.scratch_bytes);
    Ok(())
}
