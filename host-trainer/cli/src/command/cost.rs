//! `pocketsplat cost`: what accuracy costs in time, for one bundle.

mod machine;
mod report;

use std::path::PathBuf;

use anyhow::{Context, Result};
use bytesize::ByteSize;
use pocketsplat_capture::dataset::{Capture, Split, View};
use pocketsplat_codec::render::reference::ReferenceScene;
use pocketsplat_core::{Budget, Bundle, Camera, MaxSplats, Plan};
use pocketsplat_instructions::Processor;
use pocketsplat_kernels::camera::core_camera;
use pocketsplat_trainer::cost::{
    ArithmeticChoice, CountError, Counter, Instructions, MOST_VIEWS, Measured, Setting, Sight, measure, parameters,
    quality_grid,
};
use rayon::prelude::*;

use self::machine::{Machine, machine};
use self::report::{Report, ReportFiles};
use super::bundle::BundleFile;
use super::capture::{CaptureArgs, views_of};
use super::eval::reference_image;
use super::outputs::OverwriteArgs;
use crate::config::named::{SPLITS, one_of};
use crate::program;
use crate::say::say;

/// Measure quality and time of each decoder setting.
///
/// Settings change one at a time, those of quality in all combinations. Writes cost.csv, cost.svg and cost.md: for each setting PSNR to the f64 reference and to the photographs, the time of a
/// frame here, and the instructions of each stage on each target. Where the firmware's folder and QEMU are at hand, the firmware
/// counts them for each setting by itself; else, and for the combinations, they are predicted from what the frames consist of, if the
/// arithmetic is the one whose costs were counted. Targets that all lack an FPU draw without one.
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
    #[arg(long, value_parser = one_of::<Split>(SPLITS), default_value = SPLITS[0])]
    split: Split,
    /// Largest number of views, evenly picked; 0 takes all.
    #[arg(long, default_value_t = 8)]
    views: usize,
    /// Scratch memory of the decoder, as 192KiB or 65536 [default: no limit]
    #[arg(long, value_name = "BYTES")]
    ram: Option<ByteSize>,
    /// Machines whose time is compared: boards in milliseconds, kinds of processors in instructions; a board sets neither --ram nor
    /// --resolution here.
    #[arg(long, value_parser = machine(), value_delimiter = ',', value_name = "NAME,…", default_value = "cortex-m4")]
    target: Vec<Machine>,
    /// Views, at most 10, whose instructions the firmware counts [default: 2 where it can, else none]
    #[arg(long, value_name = "VIEWS")]
    count: Option<usize>,
    /// Folder of the firmware that counts.
    #[arg(long, value_name = "DIR", default_value = "firmware-example")]
    firmware: PathBuf,
    #[command(flatten)]
    overwrite: OverwriteArgs,
}

/// Views whose instructions are counted when nobody says how many: a count draws each of them for every setting.
const COUNTED_VIEWS: usize = 2;

pub(crate) fn run(args: &Args) -> Result<()> {
    let file = BundleFile::read(&args.bundle)?;
    let bundle = file.parse()?;
    let mut outputs = args.overwrite.outputs().reading(&args.bundle).reading_folder(&args.capture.dataset);
    let files = ReportFiles::checked(&args.output, &mut outputs)?;
    let targets: Vec<Processor> = args.target.iter().filter_map(|machine| machine.device()).collect();
    let counter = args.counter(&targets)?;
    if targets.iter().any(|target| target.has_fpu()) && !targets.iter().all(|target| target.has_fpu()) {
        say!(
            "warning: not all targets have an FPU, so all draw as with one; name those without in a call of their own, which draws as \
             their firmware should"
        );
    }
    let (_, capture) = file.load(&bundle, &args.capture)?;
    let views = picked(views_of(&capture, args.split)?, args.views);
    let mut sights = sights(&file, &bundle, &capture, &views)?;
    if counter.is_some() {
        let n = args.count.unwrap_or(COUNTED_VIEWS).clamp(1, MOST_VIEWS);
        let counted: Vec<usize> = picked_of(sights.len(), n).collect();
        sights.iter_mut().enumerate().for_each(|(i, sight)| sight.counts = counted.contains(&i));
    }
    let [width, height] = [|s: &Sight| s.camera.width_px, |s: &Sight| s.camera.height_px]
        .map(|side| sights.iter().map(side).max().unwrap_or(1));
    // What a device would plan: with places for more splats a frame of strips goes over fewer anchors.
    let budget = Budget::for_frame(width, height);
    let budget = match args.ram {
        None => budget,
        Some(ram) => budget.in_bytes(usize::try_from(ram.as_u64()).unwrap_or(usize::MAX)),
    };
    let counted: Vec<Camera> = sights.iter().filter(|sight| sight.counts).map(|sight| sight.camera).collect();
    let arithmetic = ArithmeticChoice::of_all(&targets);
    let (parameters, grid) = (parameters(&bundle, arithmetic), quality_grid(&bundle, arithmetic));
    let n_parameters = parameters.len();
    let settings: Vec<Setting> = parameters.into_iter().chain(grid).collect();
    let mut measured = Vec::new();
    for (i, setting) in settings.iter().enumerate() {
        say!("{} of {}  {}: {}", i + 1, settings.len(), setting.parameter, setting.name);
        // The base is whatever the memory has room for.
        if i > 0 && Plan::new(&bundle, &setting.of(budget)).is_ok_and(|plan| !setting.is_kept_by(&plan)) {
            say!("  left out: this memory has no room for it");
            continue;
        }
        let mut point = match measure(&bundle, &sights, setting, budget, &targets) {
            // Splats that are larger than plans reckon with, and memory without limit.
            Ok(point) if point.splats_dropped > 0 && args.ram.is_none() => {
                measure(&bundle, &sights, setting, budget.with_max_splats(MaxSplats::Worst), &targets)?
            }
            Ok(point) => point,
            // A residency or number of strips that does not fit is no setting of this budget.
            Err(error) if i > 0 && args.ram.is_some() => {
                say!("  left out: {error}");
                continue;
            }
            Err(error) => return Err(error).context("the scene as it is"),
        };
        if let Some(counter) = counter.as_ref().filter(|_| i < n_parameters) {
            count(counter, &targets, &counted, &mut point);
        }
        measured.push(point);
    }
    let program = program::of_figures(file.protocol(&bundle).map(|protocol| protocol.program).as_deref());
    let bundle_name = args.bundle.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let report = Report {
        program: &program,
        bundle_name,
        machines: &args.target,
        measured: &measured,
        n_views: sights.len(),
        n_counted: counted.len(),
    };
    report.write(&files)
}

impl Args {
    /// Who counts instructions; nobody, with a word about it, where nobody was asked for and something is missing.
    fn counter(&self, targets: &[Processor]) -> Result<Option<Counter>> {
        if targets.is_empty() || self.count == Some(0) {
            return Ok(None);
        }
        match Counter::new(&self.firmware, &self.bundle, &self.output.join("counted"), targets) {
            Ok(counter) => Ok(Some(counter)),
            Err(missing @ (CountError::NoFirmware(_) | CountError::NoProgram(_))) if self.count.is_none() => {
                say!("instructions are predicted: {missing}");
                Ok(None)
            }
            Err(error) => Err(error).context("counting instructions; --count 0 predicts them"),
        }
    }
}

/// Replaces what was predicted by what the firmware counts, where it can.
fn count(counter: &Counter, targets: &[Processor], cameras: &[Camera], point: &mut Measured) {
    for (i, target) in targets.iter().enumerate() {
        // Boards may have the same processor.
        if let Some(before) = targets[..i].iter().position(|counted| counted == target) {
            point.instructions[i] = point.instructions[before];
            continue;
        }
        match counter.count(*target, &point.setting, cameras, point.scratch_bytes) {
            Ok(stages) => point.instructions[i] = Some(Instructions { stages, counted: true }),
            Err(error) => say!("  not counted: {error}"),
        }
    }
}

/// At most `n` of the views, evenly picked; all for 0.
fn picked(views: &[View], n: usize) -> Vec<&View> {
    picked_of(views.len(), if n == 0 { views.len() } else { n }).map(|i| &views[i]).collect()
}

/// At most `n` of `0..of`, evenly picked.
fn picked_of(of: usize, n: usize) -> impl Iterator<Item = usize> {
    let n = n.min(of);
    (0..n).map(move |i| i * of / n)
}

fn sights(file: &BundleFile, bundle: &Bundle<'_>, capture: &Capture, views: &[&View]) -> Result<Vec<Sight>> {
    let oracle = ReferenceScene::from_bundle(bundle)?;
    views
        .par_iter()
        .map(|view| {
            let camera = file.camera(bundle, capture, view);
            Ok(Sight {
                camera: core_camera(&camera)?,
                reference: reference_image(bundle, &oracle, &camera),
                photograph: view.photograph()?,
                counts: true,
            })
        })
        .collect()
}
