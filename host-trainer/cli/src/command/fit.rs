//! `pocketsplat fit`: what devices of different memories get of a bundle.

mod level;

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use bytesize::ByteSize;
use pocketsplat_capture::dataset::FrameSize;
use pocketsplat_codec::verify::Trial;
use pocketsplat_core::{Budget, Bundle, DecodeError, Overflow, Plan};
use pocketsplat_instructions::{Processor, predict};
use serde::Serialize;

use super::bundle::BundleFile;
use super::output;
use crate::config::named::level_number;
use crate::config::target::{BoardOrCore, board_or_core};
use level::LevelFit;

/// Plan memory and work for a device.
///
/// Shows what a decoder draws of a bundle within so much memory: the share of the scene, its quality, the work of a frame.
///
/// Quality is the manifest's, measured over at most 12 test views when the bundle was made (over training views that were held out, where
/// --validation-every said so). Work is a bound over the views
/// in the manifest.
///
/// RAM is the memory given, scratch what is taken of it, pruned the share of the anchors that is not drawn. "Kept in" says where anchors
/// are: in the bundle (decoded for every frame), in memory (decoded once), with the sums of their first layers, or baked as Gaussians. A
/// frame is drawn in strips, a strip in slabs of depth, each of at most so many splats. Head MMAC are millions of multiply-adds, decoded
/// the anchors that are decoded, Mpixels the millions of pixels of all splats. Minstr and seconds are predicted.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The bundle.
    bundle: PathBuf,
    /// Scratch memory of the decoder, as 192KiB or 65536, or several with commas between, to compare [default: steps from the least that suffices]
    #[arg(long, value_name = "BYTES", value_delimiter = ',')]
    ram: Vec<ByteSize>,
    /// Largest frame [default: the training size of the bundle]
    #[arg(long, value_name = "WxH")]
    resolution: Option<FrameSize>,
    /// Draw strips with too many splats in slabs of depth, instead of leaving anchors out; needs --ram.
    #[arg(long, requires = "ram")]
    slabs: bool,
    /// Device level to check each tier against, at the training size: says which fit, and what is over by how much.
    #[arg(long, value_name = "N", value_parser = level_number(), conflicts_with_all = ["ram", "resolution", "slabs", "target"])]
    level: Option<u8>,
    /// Board or kind of processor for which to predict the preview frame: its instructions, and on a board its seconds; a board also
    /// sets --ram and --resolution where these are not given [default: none]
    #[arg(long, value_name = "NAME", value_parser = board_or_core())]
    target: Option<BoardOrCore>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// What fits into so many bytes.
#[derive(Serialize)]
pub(crate) struct Point {
    ram_bytes: u64,
    /// What of them the decoder takes.
    scratch_bytes: usize,
    n_tiers: u8,
    /// Share of the anchors that is not drawn.
    pruning_rate: f32,
    n_anchors: u32,
    /// Whether anchors are decoded once, not in every frame.
    resident: bool,
    /// And their heads' first layers begun.
    sums: bool,
    baked: bool,
    n_strips: u8,
    /// Slabs of depth of the fullest strip, at most.
    n_slabs: u32,
    max_splats: u32,
    /// Of the tiers drawn; none where the manifest was not measured.
    psnr_db: Option<f32>,
    /// Of a frame, at most.
    head_macs: Option<u64>,
    decoded_anchors: Option<u64>,
    pixel_splats: Option<u64>,
    /// Of the preview, predicted; anchors kept in memory were decoded before.
    #[serde(skip_serializing_if = "Option::is_none")]
    instructions: Option<u64>,
    /// Of the preview on the board, from its instructions, the cycles of one and the clock.
    #[serde(skip_serializing_if = "Option::is_none")]
    seconds: Option<f64>,
}

#[derive(Serialize)]
struct Fit {
    bundle: PathBuf,
    bundle_bytes: usize,
    n_anchors: u32,
    width_px: u16,
    height_px: u16,
    points: Vec<Point>,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let file = BundleFile::read(&args.bundle)?;
    let bundle = file.parse()?;
    if let Some(number) = args.level {
        let fit = LevelFit::of(&args.bundle, file.bytes.len(), &bundle, number)?;
        return if args.json { output::print(&fit, true) } else { output::print_text(&fit.table()) };
    }
    let overflow = if args.slabs { Overflow::Slabs } else { Overflow::LeaveOut };
    let board = args.target.and_then(BoardOrCore::board);
    let size = args.resolution.or(board.map(|board| board.frame_px.into()));
    let rams: Vec<u64> = match board {
        Some(board) if args.ram.is_empty() => vec![board.ram_bytes],
        _ => args.ram.iter().map(ByteSize::as_u64).collect(),
    };
    let frame = frame_budget(&bundle, size)?.with_overflow(overflow);
    let plans = if rams.is_empty() {
        ladder(&bundle, &frame)?
    } else {
        let within = |ram_bytes: u64| {
            let plan = plan_within(&bundle, &frame, ram_bytes)
                .with_context(|| format!("{} do not suffice", ByteSize(ram_bytes)))?;
            Ok((ram_bytes, plan))
        };
        rams.into_iter().map(within).collect::<Result<_>>()?
    };
    let points = plans.iter().map(|(ram_bytes, plan)| {
        let processor = args.target.map(BoardOrCore::processor);
        let instructions = processor.map(|processor| preview_instructions(&bundle, plan, processor)).transpose()?;
        let seconds = board.zip(instructions).map(|(board, instructions)| board.seconds(instructions as f64));
        Ok(Point { instructions, seconds, ..point(&bundle, *ram_bytes, plan) })
    });
    let points = points.collect::<Result<_>>()?;
    let fit = Fit {
        bundle: args.bundle.clone(),
        bundle_bytes: file.bytes.len(),
        n_anchors: bundle.n_anchors(),
        width_px: frame.width_px,
        height_px: frame.height_px,
        points,
    };
    if args.json { output::print(&fit, true) } else { output::print_text(&table(&fit)) }
}

/// A budget for frames of a size, or of the training's, of memory without limit.
pub(crate) fn frame_budget(bundle: &Bundle<'_>, size: Option<FrameSize>) -> Result<Budget> {
    let [width_px, height_px] = match size {
        None => bundle.header().training_px,
        Some(FrameSize { width_px, height_px }) => {
            let most_px = Budget::MAX_FRAME_PX;
            let side = |px: u32| u16::try_from(px).ok().filter(|&px| px <= most_px);
            let sides = side(width_px).zip(side(height_px));
            let Some((width_px, height_px)) = sides else {
                bail!("the decoder draws frames of up to {most_px} px a side, not {width_px}x{height_px}");
            };
            [width_px, height_px]
        }
    };
    Ok(Budget::for_frame(width_px, height_px))
}

/// The best plan within `ram_bytes`; an error that names the bytes that would do.
pub(crate) fn plan_within(bundle: &Bundle<'_>, frame: &Budget, ram_bytes: u64) -> Result<Plan> {
    let in_bytes =
        |frame: &Budget| Plan::new(bundle, &frame.in_bytes(usize::try_from(ram_bytes).unwrap_or(usize::MAX)));
    in_bytes(frame).map_err(|error| match error {
        DecodeError::BudgetTooSmall { needed, .. } => {
            // A smaller frame needs no less: what is drawn at once is a strip.
            let slabs = in_bytes(&frame.with_overflow(Overflow::Slabs)).is_ok();
            anyhow::anyhow!(
                "the smallest scene of this bundle takes {needed} bytes for {}x{} px; give --ram {needed} or more, {}or train a bundle for this \
                 memory with --ram {ram_bytes}",
                frame.width_px,
                frame.height_px,
                if slabs { "time for `fit --slabs`, " } else { "" },
            )
        }
        error => error.into(),
    })
}

/// Draws the preview in the plan's size, and predicts from what it consists of.
fn preview_instructions(bundle: &Bundle<'_>, plan: &Plan, processor: Processor) -> Result<u64> {
    let Budget { width_px, height_px, .. } = *plan.budget();
    let camera = bundle.header().preview.resized(width_px, height_px);
    let Trial { report, .. } = Trial::run(bundle, *plan, &camera, 0, 0)?;
    let stages = predict(processor.instruction_set(), bundle, plan, &report, [width_px, height_px]);
    Ok(stages.iter().sum::<f64>() as u64)
}

fn point(bundle: &Bundle<'_>, ram_bytes: u64, plan: &Plan) -> Point {
    let tier = plan.n_tiers().checked_sub(1);
    let work = plan.work();
    Point {
        ram_bytes,
        scratch_bytes: plan.scratch_len(),
        n_tiers: plan.n_tiers(),
        pruning_rate: plan.pruning_rate(),
        n_anchors: tier.and_then(|tier| bundle.tier(tier)).map_or(0, |tier| tier.n_anchors),
        resident: plan.is_resident(),
        sums: plan.keeps_sums(),
        baked: plan.is_baked(),
        n_strips: plan.n_strips(),
        n_slabs: plan.n_slabs(),
        max_splats: plan.max_splats(),
        psnr_db: tier.and_then(|tier| bundle.measures(tier)).and_then(|measures| measures.psnr_db),
        head_macs: work.map(|work| work.head_macs),
        decoded_anchors: work.map(|work| work.decoded_anchors),
        pixel_splats: work.map(|work| work.pixel_splats),
        instructions: None,
        seconds: None,
    }
}

/// The memories at which something changes: from the least that does to where more is of no use.
fn ladder(bundle: &Bundle<'_>, frame: &Budget) -> Result<Vec<(u64, Plan)>> {
    let mut plans = Vec::new();
    // What the best plan within a budget leaves out of it, the next smaller budget lacks.
    let mut ram_bytes = Plan::new(bundle, frame)?.scratch_len();
    loop {
        match Plan::new(bundle, &frame.in_bytes(ram_bytes)) {
            Ok(plan) => {
                // What it takes beyond saves passes, from place to place.
                let least_len = plan.least_len();
                plans.push((least_len as u64, Plan::new(bundle, &frame.in_bytes(least_len))?));
                ram_bytes = least_len.saturating_sub(1);
            }
            Err(DecodeError::BudgetTooSmall { .. }) => break,
            Err(error) => return Err(error.into()),
        }
    }
    plans.reverse();
    Ok(plans)
}

fn table(fit: &Fit) -> String {
    let mut text = format!(
        "{}: {} bytes, {} anchors, frames of {}x{} px\n\n{:>10}{:>10}{:>8}{:>9}{:>10}{:>7}{:>6}{:>9}{:>8}{:>11}{:>9}{:>12}{:>9}{:>9}\n",
        fit.bundle.display(),
        fit.bundle_bytes,
        fit.n_anchors,
        fit.width_px,
        fit.height_px,
        "RAM",
        "scratch",
        "pruned",
        "anchors",
        "kept in",
        "strips",
        "slabs",
        "splats",
        "PSNR",
        "head MMAC",
        "decoded",
        "Mpixels",
        if fit.points.iter().any(|point| point.instructions.is_some()) { "Minstr" } else { "" },
        if fit.points.iter().any(|point| point.seconds.is_some()) { "seconds" } else { "" }
    );
    for point in &fit.points {
        let psnr = point.psnr_db.map_or_else(|| "-".to_owned(), |psnr| format!("{psnr:.2}"));
        let millions = |count: Option<u64>| count.map_or_else(|| "-".to_owned(), |n| format!("{:.2}", n as f64 / 1e6));
        let decoded = point.decoded_anchors.map_or_else(|| "-".to_owned(), |n| n.to_string());
        text += &format!(
            "{:>10}{:>10}{:>7.1}%{:>9}{:>10}{:>7}{:>6}{:>9}{psnr:>8}{:>11}{decoded:>9}{:>12}{:>9}{:>9}\n",
            point.ram_bytes,
            point.scratch_bytes,
            100.0 * point.pruning_rate,
            point.n_anchors,
            match (point.baked, point.sums, point.resident) {
                (true, ..) => "baked",
                (_, true, _) => "sums",
                (_, _, true) => "memory",
                _ => "bundle",
            },
            point.n_strips,
            point.n_slabs,
            point.max_splats,
            millions(point.head_macs),
            millions(point.pixel_splats),
            point.instructions.map_or_else(String::new, |n| format!("{:.1}", n as f64 / 1e6)),
            point.seconds.map_or_else(String::new, |seconds| format!("{seconds:.2}")),
        );
    }
    text
}
