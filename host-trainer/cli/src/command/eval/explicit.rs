//! How good explicit Gaussians are.

use anyhow::{Result, bail};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Capture, Split, View};

use super::super::capture::views_of;
use super::super::gaussians::GaussiansFile;
use super::super::output;
use super::{Args, Evaluation, Measurements, Renderer, drawn_views, lpips_of, mean, view_evaluations};
use crate::config::{CaptureOptions, Protocol};

/// The name of what draws them.
const RENDERER: &str = "explicit";

/// `eval` for a file of Gaussians.
pub(super) fn run(args: &Args) -> Result<()> {
    if args.renderer == Renderer::Reference || args.against_reference || args.per_tier {
        bail!(
            "{} holds Gaussians and no bundle; leave out --renderer, --against-reference and --per-tier",
            args.bundle.display()
        );
    }
    let file = GaussiansFile::read(&args.bundle)?;
    let lpips = args.lpips.load()?;
    let (options, capture) = file.load(&args.capture)?;
    let what = Measurements { lpips: lpips.as_ref(), ..Measurements::default() };
    let evaluation = measure(&file, &capture, &options, args.split, &what)?;
    output::print_or(&evaluation, args.json, &evaluation)
}

/// Draws and measures every view of a split of a loaded capture.
///
/// * `options`: how it was loaded. * `what`: LPIPS alone counts.
pub(crate) fn measure(
    file: &GaussiansFile,
    loaded: &Capture,
    options: &CaptureOptions,
    split: Split,
    what: &Measurements<'_>,
) -> Result<Evaluation> {
    let views = views_of(loaded, split)?;
    let renderer = file.renderer(&loaded.normalisation);
    let draw = |view: &View| Ok((renderer.image(&view.camera, loaded.background), 0));
    let rows = drawn_views(views, draw, |_, _| f64::INFINITY, what.lpips)?;
    let Camera { width_px, height_px, .. } = views[0].camera;
    let (lpips, views) = view_evaluations(&rows, views);
    Ok(Evaluation {
        psnr_db: mean(&rows, |row| row.psnr_db),
        ssim: mean(&rows, |row| row.ssim),
        lpips,
        lpips_of: what.lpips.map(lpips_of),
        half_size_copy_psnr_db: mean(&rows, |row| row.half_size_copy_psnr_db),
        bundle_bytes: file.n_bytes,
        bundle_crc: None,
        n_anchors: 0,
        n_gaussians: file.gaussians.len() as u64,
        n_views: rows.len(),
        split: split.to_string(),
        renderer: RENDERER.to_owned(),
        width_px,
        height_px,
        background: options.background.map_or_else(String::new, |b| b.to_string()),
        decode_s: file.read_s,
        render_s_per_view: mean(&rows, |row| row.seconds),
        scratch_bytes: 0,
        psnr_to_reference_db: None,
        tiers: Vec::new(),
        protocol: Some(Protocol::of(loaded, options)),
        views,
    })
}
