//! What the plan variants of a bundle take, in bytes and in this machine's time: residency and strips, frame by frame in turn.

use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::ensure;
use clap::Parser;
use pocketsplat_capture::dataset::{self, LoadOptions};
use pocketsplat_codec::bundle;
use pocketsplat_core::{Budget, Bundle, Camera, Decoder, FrameReport, Plan, Residency, Strips, Tile, TileSink};
use pocketsplat_format::bundle::STRIPS;
use pocketsplat_kernels::camera::core_camera;

/// Draws views of a bundle by every plan variant there is and prints what each takes.
#[derive(Parser)]
struct Args {
    /// The bundle.
    bundle: PathBuf,
    /// The capture it was trained on, whose held-out views are drawn; without it the bundle's preview is.
    capture: Option<PathBuf>,
    /// Held-out views at most, evenly picked.
    #[arg(long, default_value_t = 8)]
    views: usize,
    /// Frames of each variant and view; medians count.
    #[arg(long, default_value_t = 5)]
    frames: usize,
    /// Tiers to draw at most.
    #[arg(long, default_value_t = u8::MAX)]
    tiers: u8,
}

/// A decoder with the name of its variant and what its frames took.
struct Variant<'b> {
    residency: Residency,
    n_strips: u8,
    scratch_len: usize,
    decoder: Decoder<'b, 'b>,
    /// Sum over the views of their median times, ms.
    time_ms: f64,
    reports: Vec<FrameReport>,
}

struct Nowhere;

impl TileSink for Nowhere {
    type Error = Infallible;

    fn tile(&mut self, tile: Tile<'_>) -> Result<(), Infallible> {
        std::hint::black_box(tile.rgb);
        Ok(())
    }
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let bytes = bundle::load(&args.bundle)?;
    let bundle = Bundle::parse(&bytes)?;
    let cameras = match &args.capture {
        None => vec![bundle.header().preview],
        Some(capture) => held_out(&bundle, capture, args.views)?,
    };
    let [width_px, height_px] = bundle.header().training_px;
    let mut variants = Vec::new();
    let baked = bundle.n_gaussians(0).map(|_| Residency::Baked);
    for residency in baked.into_iter().chain([Residency::AutoWithSums, Residency::Resident, Residency::Streamed]) {
        for n_strips in STRIPS {
            let budget = Budget::for_frame(width_px, height_px)
                .with_tiers(args.tiers)
                .with_residency(residency)
                .with_strips(Strips::Exactly(n_strips));
            let plan = Plan::new(&bundle, &budget)?;
            let decoder = Decoder::bind(&bundle, plan, vec![0; plan.scratch_len()].leak())?;
            let (scratch_len, reports) = (plan.scratch_len(), Vec::new());
            variants.push(Variant { residency, n_strips, scratch_len, decoder, time_ms: 0.0, reports });
        }
    }
    println!(
        "{}: {} bytes, {} anchors, {width_px}x{height_px}, means over {} views",
        args.bundle.display(),
        bytes.len(),
        bundle.n_anchors(),
        cameras.len(),
    );
    for camera in &cameras {
        let mut times = vec![Vec::new(); variants.len()];
        // In turn, so that all suffer alike from what else the machine does.
        for frame in 0..args.frames {
            for (variant, times) in variants.iter_mut().zip(&mut times) {
                let start = Instant::now();
                let report = variant.decoder.render(camera, &mut Nowhere)?;
                times.push(start.elapsed());
                if frame == 0 {
                    variant.reports.push(report);
                }
            }
        }
        for (variant, times) in variants.iter_mut().zip(&mut times) {
            variant.time_ms += median_ms(times);
        }
    }
    let first_ms = variants.first().map_or(1.0, |variant| variant.time_ms);
    println!("variant          bytes  most used  decoded  visible  head Mmac   splats  dropped  Mpixels     ms  ratio");
    for Variant { residency, n_strips, scratch_len, time_ms, reports, .. } in &variants {
        let n = cameras.len() as f64;
        let mean = |count: fn(&FrameReport) -> f64| reports.iter().map(count).sum::<f64>() / n;
        println!(
            "{:8} {n_strips} {scratch_len:>11} {:>10} {:>8.0} {:>8.0} {:>10.2} {:>8.0} {:>8.0} {:>8.2} {:>6.2} {:>6.2}",
            format!("{residency:?}"),
            reports.iter().map(|report| report.scratch_used).max().unwrap_or(0),
            mean(|report| report.anchors_decoded.into()),
            mean(|report| report.anchors_visible.into()),
            mean(|report| report.head_macs as f64 / 1e6),
            mean(|report| report.splats.into()),
            mean(|report| report.splats_dropped.into()),
            mean(|report| f64::from(report.pixel_splats) / 1e6),
            time_ms / n,
            time_ms / first_ms,
        );
    }
    Ok(())
}

/// The held-out views of a capture, in the frame that the bundle was trained in.
fn held_out(bundle: &Bundle<'_>, capture: &Path, most: usize) -> anyhow::Result<Vec<Camera>> {
    let longest_px = bundle.header().training_px.into_iter().max().map(u32::from);
    let (capture, _) = dataset::load(capture, &LoadOptions { max_resolution: longest_px, ..LoadOptions::default() })?;
    ensure!(
        bundle::normalisation_of(bundle) == capture.normalisation,
        "the capture is normalised otherwise than the bundle: load it as training did"
    );
    let n = capture.test.len().min(most);
    (0..n).map(|i| Ok(core_camera(&capture.test[i * capture.test.len() / n].camera)?)).collect()
}

fn median_ms(times: &mut [Duration]) -> f64 {
    times.sort_unstable();
    times.get(times.len() / 2).copied().unwrap_or_default().as_secs_f64() * 1e3
}
