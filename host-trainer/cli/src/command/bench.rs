//! `pocketsplat bench`: what a training step takes on this machine.

use std::fmt;
use std::sync::PoisonError;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use pocketsplat_capture::dataset::FrameSize;
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::image::rasterise::DrawCounts;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::coding::Coding;
use pocketsplat_kernels::step::{Loss, LossWeights, SharedDevice, StageSeconds, StepReport, TargetView, Workspace};
use pocketsplat_trainer::train::bench_scene;
use pocketsplat_trainer::train::config::{LearningRate, Rates};
use pocketsplat_trainer::train::density::Statistics;
use pocketsplat_trainer::train::optimiser::Optimiser;
use pocketsplat_trainer::train::run::device_sync::trained;
use serde::Serialize;

use super::devices::{DeviceChoice, usable};
use super::output;
use crate::say::say;

/// Time the stages of a training step, and count what it has to do.
///
/// Of a scene for the image alone and of one for image and bits, on every device of this machine, and on the CPU with 1, 2, 4, … threads.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Splats of the scenes.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_values_t = [20_000, 100_000, 400_000])]
    splats: Vec<usize>,
    /// Sizes of the images.
    #[arg(long, value_name = "WxH,…", value_delimiter = ',', default_values_t = SIZES)]
    sizes: Vec<FrameSize>,
    /// Steps whose median is taken, after one that is not timed.
    #[arg(long, value_name = "N", default_value_t = 5)]
    steps: usize,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

const SIZES: [FrameSize; 3] = [
    FrameSize { width_px: 400, height_px: 400 },
    FrameSize { width_px: 800, height_px: 800 },
    FrameSize { width_px: 1600, height_px: 1060 },
];

/// Medians of one scene at one size on one device, milliseconds.
#[derive(Serialize)]
struct Row {
    device: String,
    threads: usize,
    scene: &'static str,
    size: String,
    #[serde(flatten)]
    counts: Counts,
    /// Prefilter, copying the visible anchors, what coding does to their values; and the rate backwards.
    context_ms: f64,
    /// Heads, Gaussians, projection.
    anchors_ms: f64,
    tiles_ms: f64,
    rasterise_ms: f64,
    loss_ms: f64,
    rasterise_backward_ms: f64,
    anchors_backward_ms: f64,
    /// On a GPU, which is not waited for, it is a part of the next step's time.
    optimiser_ms: Option<f64>,
    /// Of a step as training has it, the optimiser included.
    step_ms: f64,
}

/// What a step has to do, of the scene as it is at first.
#[derive(Clone, Copy, Serialize)]
struct Counts {
    /// Gaussians of the scene that their masks draw.
    resident: usize,
    /// Of these, what reaches the image.
    active: usize,
    /// Of a tile and a splat.
    pairs: usize,
    /// Of a pixel and a splat whose alpha is looked at.
    evaluated: u64,
    /// Of a pixel and a splat that changes it.
    blended: u64,
}

#[derive(Serialize)]
struct Table {
    rows: Vec<Row>,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    ensure!(args.steps > 0, "--steps is 0, and takes at least 1");
    ensure!(args.splats.iter().all(|n| *n > 0), "--splats has a 0 in it; each takes at least 1");
    let most = rayon::current_num_threads();
    let mut threads: Vec<usize> = std::iter::successors(Some(1), |n| Some(2 * n)).take_while(|n| *n < most).collect();
    threads.push(most);
    let gpus = usable();
    let mut rows = Vec::new();
    for n_splats in &args.splats {
        for step in [Step::plain(*n_splats), Step::coded(*n_splats)] {
            for size in &args.sizes {
                let counts = step.counts(*size);
                for threads in &threads {
                    say!("{n_splats} splats, {}, {size}, cpu, {threads} threads", step.name);
                    rows.push(measure(&step, *size, counts, args.steps, *threads, None)?);
                }
                for index in &gpus {
                    say!("{n_splats} splats, {}, {size}, gpu:{index}", step.name);
                    let measured = DeviceChoice::Gpu(Some(*index))
                        .open_silently()
                        .and_then(|device| measure(&step, *size, counts, args.steps, most, device));
                    // What one device has no room for, another may have.
                    match measured {
                        Ok(row) => rows.push(row),
                        Err(error) => say!("left out: {error:#}"),
                    }
                }
            }
        }
    }
    let table = Table { rows };
    output::print_or(&table, args.json, &table)
}

/// A step to be measured.
struct Step {
    name: &'static str,
    scene: Scene<f32>,
    coding: Coding<'static, f32>,
}

impl Step {
    /// For the image alone.
    fn plain(n_splats: usize) -> Self {
        let scene = bench_scene::scene(n_anchors(n_splats, bench_scene::SPLATS_PER_ANCHOR));
        Self { name: "plain", scene, coding: Coding::Raw }
    }

    /// For image and bits, after pruning.
    fn coded(n_splats: usize) -> Self {
        let scene = bench_scene::coded(n_anchors(n_splats, bench_scene::SPLATS_PER_CODED_ANCHOR));
        Self { name: "coded", scene, coding: bench_scene::coding() }
    }

    fn counts(&self, size: FrameSize) -> Counts {
        let (anchors, camera) = (&self.scene.anchors, camera_of(size));
        let DrawCounts { splats: active, pairs, evaluated, blended } =
            Workspace::new(&self.scene.shape).count(&self.scene, &camera);
        let resident = (0..anchors.mask_logits.len()).filter(|offset| anchors.is_drawn(*offset)).count();
        Counts { resident, active, pairs, evaluated, blended }
    }
}

fn camera_of(size: FrameSize) -> Pinhole<f32> {
    Pinhole::new(&bench_scene::camera([size.width_px, size.height_px]))
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of anchors")]
fn n_anchors(n_splats: usize, splats_per_anchor: f64) -> usize {
    (n_splats as f64 / splats_per_anchor).ceil() as usize
}

fn measure(
    step: &Step,
    size: FrameSize,
    counts: Counts,
    n_steps: usize,
    threads: usize,
    device: Option<SharedDevice<f32>>,
) -> Result<Row> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.with_context(|| format!("could not start {threads} threads"))?;
    let camera = camera_of(size);
    let n_values = 3 * camera.size_px[0] * camera.size_px[1];
    // Bytes without a pattern.
    let truth = (0..n_values as u32).map(|i| f32::from((i.wrapping_mul(2_654_435_761) >> 24) as u8) / 255.0).collect();
    let target = TargetView::new(&camera, truth, None, [0.0; 3]).numbered(0);
    let loss = Loss::plain(LossWeights::default());
    let Step { scene, coding, .. } = step;
    // Masks stay where anchors are pruned by rate and distortion, as in every preset.
    let rates = Rates { mask: LearningRate::falling(0.0, 0.0), ..Rates::default() };
    let (half_way, extent) = (0.5, 5.0);
    let mut optimiser = Optimiser::new(scene);
    pool.install(|| {
        let (name, timed) = match device {
            None => {
                let (mut moving, mut workspace) = (scene.clone(), Workspace::new(&scene.shape));
                let timed = after_one(n_steps, || {
                    let report = workspace.try_step(&moving, &target, &loss, coding)?;
                    let stepped = Instant::now();
                    optimiser.apply(&mut moving, &workspace, &rates, half_way, extent);
                    Ok((report, Some(stepped.elapsed().as_secs_f64())))
                })?;
                ("cpu".to_owned(), timed)
            }
            // As training has it: the scene is there, and stays.
            Some(device) => {
                let mut device = device.lock().unwrap_or_else(PoisonError::into_inner);
                let name = device.name();
                let statistics = Statistics::new(scene.anchors.len(), scene.shape.n_offsets);
                let device = device.resident();
                device.load(&trained(scene, &optimiser, &statistics))?;
                let mut run = |times_stages| {
                    device.time_stages(times_stages);
                    after_one(n_steps, || {
                        let report = device.step(&target, &loss, coding, f32::MAX)?.report;
                        let mut steps = optimiser.next(&rates, half_way, extent);
                        steps.context =
                            scene.context.as_ref().and_then(|_| optimiser.next_of_context(&rates, half_way));
                        device.move_by(&steps)?;
                        Ok((report, None))
                    })
                };
                // Stages that are waited for make the step longer.
                let mut timed = run(true)?;
                for (timed, whole) in timed.iter_mut().zip(run(false)?) {
                    timed.seconds = whole.seconds;
                }
                (name, timed)
            }
        };
        Ok(row(name, threads, step.name, size, counts, &timed))
    })
}

/// A step, the optimiser included.
struct Timed {
    seconds: f64,
    optimiser_seconds: Option<f64>,
    report: StepReport<f32>,
}

/// Steps after one that does not count.
///
/// * `step`: gives what it reports, and the seconds of the optimiser, where it is waited for.
fn after_one(n_steps: usize, mut step: impl FnMut() -> Result<(StepReport<f32>, Option<f64>)>) -> Result<Vec<Timed>> {
    step()?;
    let timed = |_| {
        let start = Instant::now();
        let (report, optimiser_seconds) = step()?;
        Ok(Timed { seconds: start.elapsed().as_secs_f64(), optimiser_seconds, report })
    };
    (0..n_steps).map(timed).collect()
}

fn median_ms(mut seconds: Vec<f64>) -> f64 {
    seconds.sort_by(f64::total_cmp);
    1e3 * seconds[seconds.len() / 2]
}

fn row(device: String, threads: usize, scene: &'static str, size: FrameSize, counts: Counts, timed: &[Timed]) -> Row {
    let median = |of: &dyn Fn(&Timed) -> f64| median_ms(timed.iter().map(of).collect());
    let stage = |of: &dyn Fn(&StageSeconds) -> f64| median(&|timed| of(&timed.report.stages));
    Row {
        device,
        threads,
        scene,
        size: size.to_string(),
        counts,
        context_ms: stage(&|s| s.context + s.context_backward),
        anchors_ms: stage(&|s| s.anchors),
        tiles_ms: stage(&|s| s.tiles),
        rasterise_ms: stage(&|s| s.rasterise),
        loss_ms: stage(&|s| s.loss),
        rasterise_backward_ms: stage(&|s| s.rasterise_backward),
        anchors_backward_ms: stage(&|s| s.anchors_backward),
        optimiser_ms: timed[0].optimiser_seconds.map(|_| median(&|timed| timed.optimiser_seconds.unwrap_or_default())),
        step_ms: median(&|timed| timed.seconds),
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "| device | threads | scene | size | resident | active | pairs | evaluated, M | blended, M | context | anchors | tiles | rasterise \
             | loss | rasterise back | anchors back | optimiser | step, ms |"
        )?;
        writeln!(f, "|{}", "---|".repeat(18))?;
        for row in &self.rows {
            let Row { device, threads, scene, size, counts, .. } = row;
            let Counts { resident, active, pairs, evaluated, blended } = counts;
            write!(f, "| {device} | {threads} | {scene} | {size} | {resident} | {active} | {pairs} |")?;
            for n in [evaluated, blended] {
                write!(f, " {:.1} |", *n as f64 / 1e6)?;
            }
            for ms in [
                row.context_ms,
                row.anchors_ms,
                row.tiles_ms,
                row.rasterise_ms,
                row.loss_ms,
                row.rasterise_backward_ms,
                row.anchors_backward_ms,
            ] {
                write!(f, " {ms:.1} |")?;
            }
            match row.optimiser_ms {
                Some(ms) => write!(f, " {ms:.1} |")?,
                None => write!(f, " |")?,
            }
            writeln!(f, " **{:.1}** |", row.step_ms)?;
        }
        Ok(())
    }
}
