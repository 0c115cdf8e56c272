//! `pocketsplat verify`: a bundle held to the memory contract.

use std::iter;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use bytesize::ByteSize;
use pocketsplat_capture::dataset::FrameSize;
use pocketsplat_codec::manifest::cameras_to_measure;
use pocketsplat_codec::render::decoder::core_image_of_tiers;
use pocketsplat_codec::render::reference::ReferenceScene;
use pocketsplat_codec::verify::{
    Violation, declared_levels, exact_bytes, keeps_level, memory_does_not_show, variants_match, work_is_bounded,
};
use pocketsplat_core::{Budget, Bundle, Camera, Plan, Residency, Strips};
use pocketsplat_format::bundle::crc32;
use pocketsplat_instructions::level::{Bound, Level};
use pocketsplat_kernels::camera::core_camera;
use pocketsplat_kernels::camera::host_camera;
use pocketsplat_metrics::psnr_db;
use serde::Serialize;

use super::bundle::BundleFile;
use super::capture::CaptureArgs;
use super::eval::reference_image;
use super::fit::{frame_budget, plan_within};
use super::output;
use crate::config::CaptureOptions;
use crate::config::named::level_number;

/// Views that are compared with the slow reference.
const REFERENCE_VIEWS: usize = 3;
/// Both frames are rounded to 8 bits, which alone costs 58.9 dB.
const MIN_REFERENCE_DB: f64 = 50.0;
/// Share of the planned memory that the fullest of the views measured needs.
const MIN_USED: f64 = 0.9;

/// Check a bundle's guarantees: memory plan, work bounds, device level, match with the reference renderer.
///
/// Exits with 1 if a check fails.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The bundle.
    bundle: PathBuf,
    /// The capture it was trained on, whose views the manifest was measured over; without it the bundle's preview is drawn.
    dataset: Option<PathBuf>,
    /// Scratch memory of the decoder, as 192KiB [default: no limit]
    #[arg(long, value_name = "BYTES")]
    ram: Option<ByteSize>,
    /// Level whose every bound the whole scene is to keep, and whose scratch memory the decoder gets [default: those that the
    /// tiers declare]
    #[arg(long, value_name = "N", value_parser = level_number(), conflicts_with = "ram")]
    level: Option<u8>,
    #[command(flatten)]
    capture: CaptureOptions,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// One property over all that it was tried on.
#[derive(Serialize)]
struct Property {
    #[serde(rename = "law")]
    name: &'static str,
    trials: usize,
    /// What was found, or the first violation.
    finding: String,
    holds: bool,
}

#[derive(Serialize)]
struct Verification {
    bundle: PathBuf,
    ram_bytes: Option<u64>,
    scratch_bytes: usize,
    n_tiers: u8,
    pruning_rate: f32,
    /// Scratch memory of the whole scene in the most strips, where the limit leaves tiers out.
    #[serde(skip_serializing_if = "Option::is_none")]
    whole_scene_bytes: Option<usize>,
    n_views: usize,
    #[serde(rename = "laws")]
    properties: Vec<Property>,
    /// CRC-32 of each view's pixels, what a device's frame can be compared with.
    frames: Vec<String>,
}

pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    let file = BundleFile::read(&args.bundle)?;
    let bundle = file.parse()?;
    let measured = args.dataset.is_some();
    let cameras = cameras(args, &file, &bundle)?;
    let size = args.capture.resolution.unwrap_or_else(|| largest(&cameras));
    let budget = frame_budget(&bundle, Some(size))?;
    let level = args.level.and_then(Level::numbered);
    let ram_bytes = args.ram.map(|ram| ram.as_u64()).or(level.map(|level| level.most(Bound::Scratch)));
    let plan = plan_within(&bundle, &budget, ram_bytes.unwrap_or(u64::MAX))?;
    let plans: Vec<Plan> = (1..=plan.n_tiers())
        .map(|tiers| plan_within(&bundle, &budget.with_tiers(tiers), ram_bytes.unwrap_or(u64::MAX)))
        .collect::<Result<_>>()?;
    let mut properties = vec![
        property(
            "the planned bytes suffice, one fewer is refused by number",
            plans.iter().map(|plan| exact_bytes(&bundle, *plan)),
        ),
        property(
            "residency and strips change no pixel",
            plans.iter().flat_map(|plan| {
                let budget = budget.with_tiers(plan.n_tiers());
                let bundle = &bundle;
                cameras.iter().take(REFERENCE_VIEWS).map(move |camera| variants_match(bundle, budget, camera))
            }),
        ),
    ];
    let marks = cameras.iter().map(|camera| memory_does_not_show(&bundle, plan, camera).map(|touched| touched.mark));
    let (row, most_used) =
        with_most("content and place of the memory do not show, nothing beside it is touched", marks);
    properties.push(row);
    properties.push(used(most_used, &plan, measured));
    let drawn = cameras.iter().map(|camera| core_image_of_tiers(&bundle, &host_camera(camera), plan.n_tiers()));
    let drawn = drawn.collect::<Result<Vec<_>, _>>()?;
    if measured {
        // The manifest's maxima are over these views, for the whole frame at once.
        let whole = Plan::new(&bundle, &budget.with_tiers(plan.n_tiers()))?;
        properties.push(property(
            "work is within what was predicted",
            drawn.iter().map(|frame| {
                let mut work = frame.report.work();
                if whole.is_resident() || whole.is_baked() {
                    work.decoded_anchors = 0;
                }
                if whole.is_baked() {
                    work.head_macs = 0;
                }
                work_is_bounded(whole, &work)
            }),
        ));
    }
    properties.push(property("tiers keep the levels that they declare", declared_levels(&bundle)));
    if let Some(level) = level {
        let whole = bundle.n_tiers().saturating_sub(1);
        properties
            .push(property("the whole scene keeps the level", iter::once(keeps_level(&bundle, whole, level.number))));
    }
    properties.push(reference_property(&file, &bundle, plan.n_tiers(), &cameras)?);
    let whole_scene_bytes = if plan.n_tiers() < bundle.n_tiers() {
        let whole = budget.with_residency(Residency::Streamed).with_strips(Strips::Exactly(Budget::MAX_STRIPS));
        Some(Plan::new(&bundle, &whole)?.scratch_len())
    } else {
        None
    };
    let holds = properties.iter().all(|property| property.holds);
    let verification = Verification {
        bundle: args.bundle.clone(),
        ram_bytes,
        scratch_bytes: plan.scratch_len(),
        n_tiers: plan.n_tiers(),
        pruning_rate: plan.pruning_rate(),
        whole_scene_bytes,
        n_views: cameras.len(),
        properties,
        frames: drawn.iter().map(|frame| format!("{:08x}", crc32(&frame.image.rgb))).collect(),
    };
    if args.json {
        output::print(&verification, true)?;
    } else {
        output::print_text(&table(&verification))?;
    }
    Ok(if holds { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The views that the manifest was measured over, or the preview.
fn cameras(args: &Args, file: &BundleFile, bundle: &Bundle<'_>) -> Result<Vec<Camera>> {
    let Some(dataset) = &args.dataset else {
        let preview = bundle.header().preview;
        let size = args.capture.resolution.map(|size| frame_budget(bundle, Some(size))).transpose()?;
        return Ok(vec![size.map_or(preview, |size: Budget| preview.resized(size.width_px, size.height_px))]);
    };
    let source = CaptureArgs { dataset: dataset.clone(), options: args.capture.clone() };
    let (_, capture) = file.load(bundle, &source)?;
    let cameras: Vec<_> = capture.train.iter().map(|view| file.camera(bundle, &capture, view)).collect();
    let cameras = cameras_to_measure(&cameras);
    cameras.iter().map(|camera| core_camera(camera).context("a view of the capture cannot be drawn")).collect()
}

/// A frame that holds each of the views.
fn largest(cameras: &[Camera]) -> FrameSize {
    let most = |side: fn(&Camera) -> u16| cameras.iter().map(side).max().unwrap_or(1).into();
    FrameSize { width_px: most(|camera| camera.width_px), height_px: most(|camera| camera.height_px) }
}

fn property(name: &'static str, trials: impl Iterator<Item = Result<(), Violation>>) -> Property {
    with_most(name, trials.map(|trial| trial.map(|()| 0))).0
}

/// A property whose trials return numbers, with the largest of these.
fn with_most(name: &'static str, trials: impl Iterator<Item = Result<usize, Violation>>) -> (Property, usize) {
    let (mut n, mut most, mut first) = (0, 0, None);
    for trial in trials {
        n += 1;
        match trial {
            Ok(number) => most = most.max(number),
            Err(violation) => first = first.or(Some(violation)),
        }
    }
    let holds = first.is_none();
    (Property { name, trials: n, finding: first.unwrap_or_default(), holds }, most)
}

/// How much of the plan the fullest view needs; only views that the manifest was measured over can be asked for it.
fn used(most: usize, plan: &Plan, measured: bool) -> Property {
    // What the plan takes beyond saves passes.
    let share = most as f64 / plan.least_len() as f64;
    Property {
        name: "the planned bytes are needed",
        trials: 1,
        finding: format!("{most} of {} bytes, {:.1} %", plan.least_len(), 100.0 * share),
        holds: !measured || share >= MIN_USED,
    }
}

/// Each tier's frames against the f64 reference's.
fn reference_property(file: &BundleFile, bundle: &Bundle<'_>, n_tiers: u8, cameras: &[Camera]) -> Result<Property> {
    let chunks_at = bundle.sections().last().map_or(0, |section| section.offset as usize);
    let (mut lowest, mut trials) = (f64::INFINITY, 0);
    for tier in (0..n_tiers).filter_map(|tier| bundle.tier(tier)) {
        let cut = Bundle::parse(&file.bytes[..chunks_at + tier.end as usize])?;
        let reference = ReferenceScene::from_bundle(&cut)?;
        for camera in cameras.iter().take(REFERENCE_VIEWS).map(host_camera) {
            let frame = core_image_of_tiers(&cut, &camera, u8::MAX)?;
            lowest = lowest.min(psnr_db(&frame.image, &reference_image(&cut, &reference, &camera)));
            trials += 1;
        }
    }
    let finding = format!("{lowest:.1} dB at least, needed {MIN_REFERENCE_DB}");
    Ok(Property { name: "frames are the f64 reference's", trials, finding, holds: lowest >= MIN_REFERENCE_DB })
}

fn table(verification: &Verification) -> String {
    let mut text = format!(
        "{}: {} tiers, {:.1} % pruned, {} bytes of scratch memory, {} views\n\n",
        verification.bundle.display(),
        verification.n_tiers,
        100.0 * verification.pruning_rate,
        verification.scratch_bytes,
        verification.n_views
    );
    if let Some(bytes) = verification.whole_scene_bytes {
        text += &format!("the whole scene takes {bytes} bytes; what is checked is the part within the limit\n\n");
    }
    for Property { name, trials, finding, holds } in &verification.properties {
        text += &format!("{:<6}{trials:>5}  {name}", if *holds { "holds" } else { "BROKEN" });
        text += &if finding.is_empty() { "\n".to_owned() } else { format!(": {finding}\n") };
    }
    let shown = 8;
    text += &format!("\nframes {}", verification.frames.iter().take(shown).cloned().collect::<Vec<_>>().join(" "));
    text + if verification.frames.len() > shown { " …\n" } else { "\n" }
}
