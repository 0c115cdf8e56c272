//! `pocketsplat cost`: what accuracy costs in time, for one bundle.

use std::path::PathBuf;

use anyhow::{Context, Result};
use bytesize::ByteSize;
use pocketsplat::cost::{Measured, Setting, Sight, knobs, measure, on_front, quality_grid};
use pocketsplat::dataset::{Capture, View};
use pocketsplat::device::Target;
use pocketsplat::plot::{TimePoint, time_accuracy_svg};
use pocketsplat::render::decoder::core_camera;
use pocketsplat::render::reference::ReferenceScene;
use pocketsplat_core::{Budget, Bundle, MaxSplats, Stage};
use rayon::prelude::*;
use serde::Serialize;

use super::bundle::BundleFile;
use super::capture::{CaptureArgs, Split};
use super::eval::reference_image;
use super::output;

/// Turn each of the decoder's knobs, and those of quality in all combinations, and measure what that costs in accuracy and
/// saves in time.
///
/// Writes cost.csv, cost.svg and cost.md: for each setting PSNR to the f64 reference and to the photographs, the time of a
/// frame here, and the instructions of each stage on the target, predicted from what the frames consist of where the arithmetic is
/// the one whose costs were counted.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The bundle.
    bundle: PathBuf,
    #[command(flatten)]
    capture: CaptureArgs,
    /// Folder for the results.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Which views.
    #[arg(long, value_enum, default_value_t = Split::Test)]
    split: Split,
    /// So many views at most, evenly picked; 0: all.
    #[arg(long, default_value_t = 8)]
    views: usize,
    /// Scratch memory of the decoder, as 192KiB or 65536. [default: without limit]
    #[arg(long, value_name = "BYTES")]
    ram: Option<ByteSize>,
    /// The processor whose instructions are predicted.
    #[arg(long, value_enum, default_value_t = Target::CortexM4)]
    target: Target,
}

/// One line of cost.csv.
#[derive(Serialize)]
struct Line<'a> {
    knob: &'a str,
    setting: &'a str,
    pruning_rate: f64,
    alpha_cut_255ths: u8,
    transmittance_stop: f64,
    detail: bool,
    #[serde(rename = "PSNR")]
    psnr_db: f64,
    psnr_to_reference_db: f64,
    worst_channel: u8,
    host_s: f64,
    scratch_bytes: usize,
    instructions: Option<u64>,
    decode: Option<u64>,
    context: Option<u64>,
    heads: Option<u64>,
    project: Option<u64>,
    sort: Option<u64>,
    blend: Option<u64>,
    output: Option<u64>,
    on_front: bool,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let file = BundleFile::read(&args.bundle)?;
    let bundle = file.parse()?;
    let capture = file.capture_options(&bundle, &args.capture)?.load(0)?;
    let views = picked(args.split.views(&capture)?, args.views);
    let sights = sights(&file, &bundle, &capture, &views)?;
    let [width, height] = [|s: &Sight<'_>| s.camera.width_px, |s: &Sight<'_>| s.camera.height_px]
        .map(|side| sights.iter().map(side).max().unwrap_or(1));
    let budget = Budget::for_frame(width, height).with_max_splats(MaxSplats::Worst);
    let budget = match args.ram {
        None => budget,
        // What a device would plan.
        Some(ram) => {
            let ram_bytes = usize::try_from(ram.as_u64()).unwrap_or(usize::MAX);
            budget.with_max_splats(MaxSplats::Measured).in_bytes(ram_bytes)
        }
    };
    let settings: Vec<Setting> = knobs(&bundle).into_iter().chain(quality_grid(&bundle)).collect();
    let mut measured = Vec::new();
    for (i, setting) in settings.iter().enumerate() {
        eprintln!("{} of {}  {}: {}", i + 1, settings.len(), setting.knob, setting.name);
        match measure(&bundle, &sights, setting, budget, args.target.costs()) {
            Ok(point) => measured.push(point),
            // A residency or number of strips that does not fit is no setting of this budget.
            Err(error) if i > 0 && args.ram.is_some() => eprintln!("  left out: {error}"),
            Err(error) => return Err(error).context("the scene as it is"),
        }
    }
    write(args, &measured, sights.len())
}

/// At most `n` of the views, evenly picked; all for 0.
fn picked(views: &[View], n: usize) -> Vec<&View> {
    let n = if n == 0 { views.len() } else { n.min(views.len()) };
    (0..n).map(|i| &views[i * views.len() / n]).collect()
}

fn sights<'a>(file: &BundleFile, bundle: &Bundle<'_>, capture: &Capture, views: &[&'a View]) -> Result<Vec<Sight<'a>>> {
    let oracle = ReferenceScene::from_bundle(bundle)?;
    views
        .par_iter()
        .map(|view| {
            let camera = file.camera(bundle, capture, view);
            Ok(Sight {
                camera: core_camera(&camera)?,
                reference: reference_image(bundle, &oracle, &camera),
                photograph: (&view.image, view.mask.as_ref()),
            })
        })
        .collect()
}

fn write(args: &Args, measured: &[Measured], n_views: usize) -> Result<()> {
    // What nobody counted is on no front.
    let points = measured.iter().map(|m| (m.total_instructions().unwrap_or(f64::INFINITY), m.psnr_db));
    let mut front = on_front(&points.collect::<Vec<_>>());
    for (on_front, m) in front.iter_mut().zip(measured) {
        *on_front &= m.instructions.is_some();
    }
    std::fs::create_dir_all(&args.output).with_context(|| format!("could not make {}", args.output.display()))?;
    let mut table = csv::Writer::from_writer(Vec::new());
    for (m, &on_front) in measured.iter().zip(&front) {
        table.serialize(line(m, on_front))?;
    }
    output::write_whole(&args.output.join("cost.csv"), &table.into_inner()?)?;
    let points: Vec<TimePoint> = measured
        .iter()
        .zip(&front)
        .filter_map(|(m, &on_front)| {
            Some(TimePoint {
                knob: m.setting.knob.to_owned(),
                name: m.setting.name.clone(),
                instructions: m.total_instructions()?,
                psnr_db: m.psnr_db,
                on_front,
            })
        })
        .collect();
    output::write_whole(&args.output.join("cost.svg"), time_accuracy_svg(&points)?.as_bytes())?;
    let page = page(args, measured, &front, n_views);
    output::write_whole(&args.output.join("cost.md"), page.as_bytes())?;
    output::print_text(&page)
}

fn line(m: &Measured, on_front: bool) -> Line<'_> {
    let of = |stage: Stage| m.instructions.map(|stages| stages[stage as usize].round() as u64);
    Line {
        knob: m.setting.knob,
        setting: &m.setting.name,
        pruning_rate: m.setting.pruning_rate,
        alpha_cut_255ths: m.setting.quality.alpha_cut,
        transmittance_stop: f64::from(m.setting.quality.transmittance_stop) / 1e4,
        detail: m.setting.quality.detail,
        psnr_db: m.psnr_db,
        psnr_to_reference_db: m.psnr_to_reference_db,
        worst_channel: m.worst_channel,
        host_s: m.host_s,
        scratch_bytes: m.scratch_bytes,
        instructions: m.total_instructions().map(|total| total.round() as u64),
        decode: of(Stage::Decode),
        context: of(Stage::Context),
        heads: of(Stage::Heads),
        project: of(Stage::Project),
        sort: of(Stage::Sort),
        blend: of(Stage::Blend),
        output: of(Stage::Output),
        on_front,
    }
}

/// The table as a page.
fn page(args: &Args, measured: &[Measured], front: &[bool], n_views: usize) -> String {
    let exact = &measured[0];
    let mut text = format!(
        "# What accuracy costs in time: {}\n\nMeans over {n_views} views; instructions of a frame on a {:?}, predicted, in \
         millions; time of a frame on this machine, one thread. PSNR to the f64 reference is the worst view's, the largest \
         difference of a channel of all views is in 255ths.\n\n\
         | knob | setting | PSNR, dB | to the reference, dB | worst | ms here | instructions | of exact | scratch |\n\
         |---|---|---|---|---|---|---|---|---|\n",
        args.bundle.file_name().unwrap_or_default().display(),
        args.target,
    );
    let of_exact = |m: &Measured| {
        let share = m.total_instructions().zip(exact.total_instructions()).map(|(total, exact)| total / exact);
        share.map_or_else(String::new, |share| format!("{share:.2}"))
    };
    for (m, &on_front) in measured.iter().zip(front).filter(|(m, on_front)| m.setting.knob != "quality" || **on_front) {
        let mark = if on_front { "**" } else { "" };
        text += &format!(
            "| {} | {mark}{}{mark} | {:.2} | {:.1} | {} | {:.1} | {} | {} | {} |\n",
            m.setting.knob,
            m.setting.name,
            m.psnr_db,
            m.psnr_to_reference_db,
            m.worst_channel,
            1e3 * m.host_s,
            m.total_instructions().map_or_else(String::new, |total| format!("{:.1}", total / 1e6)),
            of_exact(m),
            m.scratch_bytes,
        );
    }
    text + "\nBold: nothing measured takes fewer instructions at no less PSNR. Of the combinations only those are listed; \
            cost.csv has all.\n"
}
