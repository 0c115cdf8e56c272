//! Draws on this machine what `firmware-example` draws on a board: the same plan, the same cameras, and so the same bytes.

use std::fs;
use std::path::PathBuf;

use anyhow::Context as _;
use clap::Parser;
use pocketsplat_codec::bundle;
use pocketsplat_codec::render::decoder::image_of;
use pocketsplat_core::{Arithmetic, Budget, Bundle, Decoder, Overflow, Plan, ReferenceArithmetic, WithoutFpu};

/// Draws an orbit of a bundle's preview, as PPM files `frame0.ppm` and so on.
#[derive(Parser)]
struct Args {
    /// The bundle.
    bundle: PathBuf,
    /// The folder to write to.
    out: PathBuf,
    /// Bytes of scratch memory, which decide the plan; the firmware's log says how many it has.
    #[arg(long)]
    bytes: usize,
    /// Width and height of the frames, pixels; the preview's without it.
    #[arg(long, value_parser = size)]
    size: Option<[u16; 2]>,
    /// Frames of the orbit.
    #[arg(long, default_value_t = 4)]
    frames: u8,
    /// Draw with `WithoutFpu`.
    #[arg(long)]
    without_fpu: bool,
}

fn size(text: &str) -> Result<[u16; 2], String> {
    let sizes = text.split_once('x').and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    sizes.ok_or_else(|| "not WIDTHxHEIGHT, for instance 160x120".into())
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    if args.without_fpu { draw::<WithoutFpu>(&args) } else { draw::<ReferenceArithmetic>(&args) }
}

fn draw<A: Arithmetic>(args: &Args) -> anyhow::Result<()> {
    let bytes = bundle::load(&args.bundle)?;
    let bundle = Bundle::parse(&bytes)?;
    let preview = bundle.header().preview;
    let [width_px, height_px] = args.size.unwrap_or([preview.width_px, preview.height_px]);
    let preview = preview.resized(width_px, height_px);
    let budget = Budget::for_frame(width_px, height_px).in_bytes(args.bytes);
    let plan = Plan::new(&bundle, &budget).or_else(|_| Plan::new(&bundle, &budget.with_overflow(Overflow::Slabs)))?;
    let mut scratch = vec![0; plan.scratch_len()];
    let mut decoder = Decoder::bind_in::<A>(&bundle, plan, &mut scratch)?;
    fs::create_dir_all(&args.out).with_context(|| format!("cannot make {}", args.out.display()))?;
    for frame in 0..args.frames {
        let camera = preview.orbited(std::f32::consts::TAU * f32::from(frame) / f32::from(args.frames));
        let (image, report) = image_of(&mut decoder, &camera)?;
        let mut ppm = format!("P6\n{width_px} {height_px}\n255\n").into_bytes();
        ppm.extend(&image.rgb);
        let path = args.out.join(format!("frame{frame}.ppm"));
        fs::write(&path, ppm).with_context(|| format!("cannot write {}", path.display()))?;
        println!("{}: {report:?}", path.display());
    }
    Ok(())
}
