//! `pocketsplat eval`: how good a bundle or a file of Gaussians is, how large, how fast.

mod drawn;
mod evaluation;
pub(crate) mod explicit;
mod summary;

use std::path::PathBuf;
use std::time::Instant;

use anyhow::Result;
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Capture, Image, Split, View};
use pocketsplat_codec::bundle::decoded_scene;
use pocketsplat_codec::render::decoder::{core_image, core_image_of_tiers};
use pocketsplat_codec::render::reference::{ReferenceScene, to_image};
use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::crc32;
use pocketsplat_metrics::{Lpips, psnr_db, psnr_db_masked};
use rayon::prelude::*;

use self::drawn::{drawn_views, mean, view_evaluations};
use super::bundle::BundleFile;
use super::capture::{CaptureArgs, background_name, views_of};
use super::gaussians::{AxesArgs, GaussiansFile};
use super::lpips::LpipsArgs;
use super::output;
use crate::config::named::{SPLITS, one_of};
use crate::config::{CaptureOptions, Protocol};
use crate::program;

pub(crate) use evaluation::{Evaluation, TierEvaluation, ViewEvaluation};

/// What draws the frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Renderer {
    /// decoder-core: what a device draws, bit for bit.
    Core,
    /// The slow f64 reference.
    Reference,
}

impl Renderer {
    /// As an [`Evaluation`] names it.
    pub(crate) fn name(self) -> String {
        format!("{self:?}").to_lowercase()
    }
}

/// Which LPIPS a figure is of, as an [`Evaluation`] says it.
pub(crate) fn lpips_of(lpips: &Lpips) -> String {
    format!("VGG16, input in {}", lpips.range())
}

/// Compare a bundle's frames with the photographs of a capture.
///
/// Takes a file of Gaussians too.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The bundle, or a file of Gaussians: .ply, .spz, .sog, .glb or .splat.
    bundle: PathBuf,
    #[command(flatten)]
    capture: CaptureArgs,
    /// Which views.
    #[arg(long, value_parser = one_of::<Split>(SPLITS), default_value = SPLITS[0])]
    split: Split,
    /// What draws the frames.
    #[arg(long, value_enum, default_value_t = Renderer::Core)]
    renderer: Renderer,
    /// Also compare every frame with the f64 reference (psnr_to_reference_db, the lowest over the views).
    #[arg(long)]
    against_reference: bool,
    /// Also measure what smaller devices draw, tier by tier.
    #[arg(long)]
    per_tier: bool,
    #[command(flatten)]
    axes: AxesArgs,
    #[command(flatten)]
    lpips: LpipsArgs,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// What is measured besides PSNR and SSIM.
#[derive(Clone, Copy, Default)]
pub(crate) struct Measurements<'a> {
    pub(crate) against_reference: bool,
    pub(crate) per_tier: bool,
    pub(crate) lpips: Option<&'a Lpips>,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    if GaussiansFile::is_one(&args.bundle) {
        return explicit::run(args);
    }
    args.axes.refuse_unless(false, &args.bundle)?;
    let file = BundleFile::read(&args.bundle)?;
    let lpips = args.lpips.load()?;
    let what =
        Measurements { against_reference: args.against_reference, per_tier: args.per_tier, lpips: lpips.as_ref() };
    let evaluation = evaluate(&file, &args.capture, args.split, args.renderer, &what)?;
    output::print_or(&evaluation, args.json, &evaluation)
}

/// Times that a file is decoded to measure how long it takes.
const DECODES: usize = 3;

/// What the bytes of a file are decoded to, and the seconds of the fastest of a few times: what other processes take is not the file's.
///
/// * `decode`: from bytes in memory to what views are drawn of, in memory.
pub(crate) fn timed<T>(decode: impl Fn() -> Result<T>) -> Result<(T, f64)> {
    let once = || {
        let started = Instant::now();
        decode().map(|decoded| (decoded, started.elapsed().as_secs_f64()))
    };
    let (mut decoded, mut decode_s) = once()?;
    for _ in 1..DECODES {
        // Never two of them in memory.
        drop(decoded);
        let seconds;
        (decoded, seconds) = once()?;
        decode_s = decode_s.min(seconds);
    }
    Ok((decoded, decode_s))
}

/// The f64 reference's frame on the bundle's background, 8 bit.
pub(crate) fn reference_image(bundle: &Bundle<'_>, scene: &ReferenceScene, camera: &Camera) -> Image {
    let background = bundle.header().background.map(|c| f64::from(c) / 255.0);
    to_image(&scene.render(camera, background), camera.width_px, camera.height_px)
}

/// Draws every view with each number of tiers.
fn tiers(file: &BundleFile, bundle: &Bundle<'_>, capture: &Capture, views: &[View]) -> Result<Vec<TierEvaluation>> {
    let evaluated = (1..=bundle.n_tiers()).map(|n_tiers| {
        let psnr = |view: &View| -> Result<f64> {
            let image = core_image_of_tiers(bundle, &file.camera(bundle, capture, view), n_tiers)?.image;
            let photograph = view.photograph()?;
            Ok(psnr_db_masked(&image, &photograph.image, photograph.mask.as_ref()))
        };
        let of_views = views.par_iter().map(psnr).collect::<Result<Vec<f64>>>()?;
        let n_anchors = bundle.tier(n_tiers - 1).map_or(0, |tier| tier.n_anchors);
        Ok(TierEvaluation {
            pruning_rate: 1.0 - f64::from(n_anchors) / f64::from(bundle.header().n_anchors.max(1)),
            psnr_db: of_views.iter().sum::<f64>() / of_views.len() as f64,
        })
    });
    evaluated.collect()
}

/// Loads the capture as the bundle's was prepared, and measures every view of a split.
pub(crate) fn evaluate(
    file: &BundleFile,
    capture: &CaptureArgs,
    split: Split,
    renderer: Renderer,
    what: &Measurements<'_>,
) -> Result<Evaluation> {
    let (options, loaded) = file.load(&file.parse()?, capture)?;
    measure(file, &loaded, &options, split, renderer, what)
}

/// Draws and measures every view of a split of a loaded capture.
///
/// * `options`: how it was loaded.
pub(crate) fn measure(
    file: &BundleFile,
    loaded: &Capture,
    options: &CaptureOptions,
    split: Split,
    renderer: Renderer,
    what: &Measurements<'_>,
) -> Result<Evaluation> {
    let Measurements { against_reference, per_tier, lpips } = *what;
    let bundle = file.parse()?;
    let views = views_of(loaded, split)?;
    let (scene, decode_s) = timed(|| Ok(decoded_scene(&file.parse()?)?))?;
    let n_offsets = scene.anchors.len() * scene.shape.n_offsets;
    let n_gaussians = (0..n_offsets).filter(|offset| scene.anchors.is_drawn(*offset)).count() as u64;
    drop(scene);

    let oracle = if renderer == Renderer::Reference || against_reference {
        Some(ReferenceScene::from_bundle(&bundle)?)
    } else {
        None
    };
    let draw = |view: &View| {
        let camera = file.camera(&bundle, loaded, view);
        match oracle.as_ref().filter(|_| renderer == Renderer::Reference) {
            Some(scene) => Ok((reference_image(&bundle, scene, &camera), 0)),
            None => Ok(core_image(&bundle, &camera).map(|frame| (frame.image, frame.scratch_bytes))?),
        }
    };
    let to_reference = |image: &Image, view: &View| match oracle.as_ref().filter(|_| against_reference) {
        Some(scene) => psnr_db(image, &reference_image(&bundle, scene, &file.camera(&bundle, loaded, view))),
        None => f64::INFINITY,
    };
    let rows = drawn_views(views, draw, to_reference, lpips)?;
    let (lpips_mean, of_views) = view_evaluations(&rows, views);
    let trained = file.protocol(&bundle).map(|protocol| protocol.program);
    Ok(Evaluation {
        program: program::of_figures(trained.as_deref()),
        psnr_db: mean(&rows, |row| row.psnr_db),
        cc_psnr_db: Some(mean(&rows, |row| row.cc_psnr_db)),
        ssim: mean(&rows, |row| row.ssim),
        lpips: lpips_mean,
        lpips_of: lpips.map(lpips_of),
        half_size_copy_psnr_db: mean(&rows, |row| row.half_size_copy_psnr_db),
        bundle_bytes: file.bytes.len(),
        bundle_crc: Some(crc32(&file.bytes)),
        n_anchors: bundle.n_anchors(),
        n_gaussians,
        n_views: rows.len(),
        split: split.to_string(),
        renderer: renderer.name(),
        width_px: views[0].camera.width_px,
        height_px: views[0].camera.height_px,
        background: background_name(bundle.header().background),
        decode_s,
        render_s_per_view: rows[0].seconds,
        scratch_bytes: rows.iter().map(|row| row.scratch_bytes).max().unwrap_or(0),
        tiers: if per_tier { tiers(file, &bundle, loaded, views)? } else { Vec::new() },
        psnr_with_other_axes_db: None,
        psnr_to_reference_db: against_reference
            .then(|| rows.iter().map(|row| row.psnr_to_reference_db).fold(f64::INFINITY, f64::min)),
        protocol: Some(Protocol::of(loaded, options)),
        views: of_views,
    })
}
