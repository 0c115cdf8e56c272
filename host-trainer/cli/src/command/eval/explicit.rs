//! How good explicit Gaussians are.

use anyhow::{Result, bail};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Capture, Split, View};

use super::super::capture::{background_of, views_of};
use super::super::gaussians::GaussiansFile;
use super::super::output;
use super::drawn::{drawn_views, mean, view_evaluations};
use super::{Args, Evaluation, Measurements, Renderer, lpips_of};
use crate::config::{CaptureOptions, Protocol};
use crate::program;
use crate::say::say;

/// Below it a picture may have nothing to do with the photograph: a scene of other axes has 5 dB, and 13 where most of both is background.
const ANOTHER_SCENE_DB: f64 = 15.0;
/// Axes that are right are better by more than this.
const CLEARLY_DB: f64 = 1.0;

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
    let file = GaussiansFile::read(&args.bundle, args.axes)?;
    let lpips = args.lpips.load()?;
    let (options, capture) = file.load(&args.capture)?;
    let what = Measurements { lpips: lpips.as_ref(), ..Measurements::default() };
    let mut evaluation = measure(&file, &capture, &options, args.split, &what)?;
    if let Some(axes) = file.notes.spz_axes.filter(|_| evaluation.psnr_db < ANOTHER_SCENE_DB) {
        let psnr_db = psnr_db_turned(&file, &capture, args.split)?;
        evaluation.psnr_with_other_axes_db = Some(psnr_db);
        let other = axes.other().name();
        if psnr_db > evaluation.psnr_db + CLEARLY_DB {
            say!(
                "warning: {} shows another scene ({:.2} dB), and this one with the other axes ({psnr_db:.2} dB): read it with \
                 `--spz-axes {other}`",
                args.bundle.display(),
                evaluation.psnr_db
            );
        } else {
            say!("with `--spz-axes {other}` it has {psnr_db:.2} dB: its axes are not what is wrong");
        }
    }
    output::print_or(&evaluation, args.json, &evaluation)
}

/// Mean PSNR of the views of a split, were the axes of a .spz the other ones.
fn psnr_db_turned(file: &GaussiansFile, loaded: &Capture, split: Split) -> Result<f64> {
    let turned = GaussiansFile { gaussians: file.gaussians.turned(), notes: file.notes.clone(), ..*file };
    let renderer = turned.renderer(&loaded.normalisation);
    let views = views_of(loaded, split)?;
    let draw = |view: &View| Ok((renderer.image(&view.camera, loaded.background), 0));
    Ok(mean(&drawn_views(views, draw, |_, _| f64::INFINITY, None)?, |row| row.psnr_db))
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
    let trained = file.protocol().map(|protocol| protocol.program);
    Ok(Evaluation {
        program: program::of_figures(trained.as_deref()),
        psnr_db: mean(&rows, |row| row.psnr_db),
        cc_psnr_db: Some(mean(&rows, |row| row.cc_psnr_db)),
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
        background: background_of(loaded),
        decode_s: file.read_s,
        render_s_per_view: rows[0].seconds,
        scratch_bytes: 0,
        psnr_with_other_axes_db: None,
        psnr_to_reference_db: None,
        tiers: Vec::new(),
        protocol: Some(Protocol::of(loaded, options)),
        views,
    })
}
