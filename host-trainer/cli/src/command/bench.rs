//! `pocketsplat bench`: what a training step takes on this machine.

use std::fmt;
use std::sync::PoisonError;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use pocketsplat_capture::dataset::FrameSize;
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::coding::Coding;
use pocketsplat_kernels::step::{Loss, LossWeights, SharedDevice, StageSeconds, StepReport, TargetView, Workspace};
use pocketsplat_trainer::train::bench_scene;
use pocketsplat_trainer::train::config::Backbone;
use pocketsplat_trainer::train::density::Statistics;
use pocketsplat_trainer::train::optimiser::Optimiser;
use pocketsplat_trainer::train::run::device_sync::trained;
use serde::Serialize;

use super::devices::{DeviceChoice, usable};
use super::output;
use crate::say::say;

/// Time the stages of a training step.
///
/// On every device of this machine, and on the CPU with 1, 2, 4, … threads.
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
    size: String,
    splats: usize,
    pairs: usize,
    /// Prefilter, heads, Gaussians, projection.
    anchors_ms: f64,
    tiles_ms: f64,
    rasterise_ms: f64,
    loss_ms: f64,
    rasterise_backward_ms: f64,
    anchors_backward_ms: f64,
    /// Of a step as training has it.
    step_ms: f64,
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
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of anchors")]
        let n_anchors = (*n_splats as f64 / bench_scene::SPLATS_PER_ANCHOR).ceil() as usize;
        let scene = bench_scene::scene(Backbone::Scaffold, n_anchors);
        for size in &args.sizes {
            for threads in &threads {
                say!("{n_splats} splats, {size}, cpu, {threads} threads");
                rows.push(measure(&scene, *size, args.steps, *threads, None)?);
            }
            for index in &gpus {
                say!("{n_splats} splats, {size}, gpu:{index}");
                let measured = DeviceChoice::Gpu(Some(*index))
                    .open_silently()
                    .and_then(|device| measure(&scene, *size, args.steps, most, device));
                // What one device has no room for, another may have.
                match measured {
                    Ok(row) => rows.push(row),
                    Err(error) => say!("left out: {error:#}"),
                }
            }
        }
    }
    let table = Table { rows };
    output::print_or(&table, args.json, &table)
}

fn measure(
    scene: &Scene<f32>,
    size: FrameSize,
    n_steps: usize,
    threads: usize,
    device: Option<SharedDevice<f32>>,
) -> Result<Row> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.with_context(|| format!("could not start {threads} threads"))?;
    let camera = Pinhole::new(&bench_scene::camera([size.width_px, size.height_px]));
    let n_values = 3 * camera.size_px[0] * camera.size_px[1];
    // Bytes without a pattern.
    let truth = (0..n_values as u32).map(|i| f32::from((i.wrapping_mul(2_654_435_761) >> 24) as u8) / 255.0).collect();
    let target = TargetView::new(&camera, truth, None, [0.0; 3]).numbered(0);
    let loss = Loss::plain(LossWeights::default());
    let mut name = "cpu".to_owned();
    let (steps, reports) = pool.install(|| -> Result<(Vec<f64>, Vec<StepReport<f32>>)> {
        match device {
            None => {
                let mut workspace = Workspace::new(&scene.shape);
                let timed = after_one(n_steps, || Ok(workspace.try_step(scene, &target, &loss, &Coding::Raw)?))?;
                Ok(timed.into_iter().unzip())
            }
            // As training has it: the scene is there, and stays.
            Some(device) => {
                let mut device = device.lock().unwrap_or_else(PoisonError::into_inner);
                name = device.name();
                let statistics = Statistics::new(scene.anchors.len(), scene.shape.n_offsets);
                let device = device.resident();
                device.load(&trained(scene, &Optimiser::new(scene), &statistics))?;
                let mut run = |times_stages| {
                    device.time_stages(times_stages);
                    after_one(n_steps, || Ok(device.step(&target, &loss, &Coding::Raw, f32::MAX)?.report))
                };
                // Stages that are waited for make the step longer.
                let reports = run(true)?.into_iter().map(|(_, report)| report).collect();
                let steps = run(false)?.into_iter().map(|(seconds, _)| seconds).collect();
                Ok((steps, reports))
            }
        }
    })?;
    Ok(row(name, threads, size, steps, &reports))
}

/// The seconds of steps and what they report, after one that does not count.
fn after_one(n_steps: usize, mut step: impl FnMut() -> Result<StepReport<f32>>) -> Result<Vec<(f64, StepReport<f32>)>> {
    step()?;
    let timed = |_| {
        let start = Instant::now();
        let report = step()?;
        Ok((start.elapsed().as_secs_f64(), report))
    };
    (0..n_steps).map(timed).collect()
}

fn median_ms(mut seconds: Vec<f64>) -> f64 {
    seconds.sort_by(f64::total_cmp);
    1e3 * seconds[seconds.len() / 2]
}

fn row(device: String, threads: usize, size: FrameSize, steps: Vec<f64>, reports: &[StepReport<f32>]) -> Row {
    let median =
        |stage: &dyn Fn(&StageSeconds) -> f64| median_ms(reports.iter().map(|report| stage(&report.stages)).collect());
    let StepReport { n_splats, n_pairs, .. } = reports[0];
    Row {
        device,
        threads,
        size: size.to_string(),
        splats: n_splats,
        pairs: n_pairs,
        anchors_ms: median(&|s| s.context + s.anchors),
        tiles_ms: median(&|s| s.tiles),
        rasterise_ms: median(&|s| s.rasterise),
        loss_ms: median(&|s| s.loss),
        rasterise_backward_ms: median(&|s| s.rasterise_backward),
        anchors_backward_ms: median(&|s| s.anchors_backward + s.context_backward),
        step_ms: median_ms(steps),
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "| device | threads | size | splats | pairs | anchors | tiles | rasterise | loss | rasterise back | anchors back | step, ms |"
        )?;
        writeln!(f, "|---|---|---|---|---|---|---|---|---|---|---|---|")?;
        for row in &self.rows {
            let Row { device, threads, size, splats, pairs, .. } = row;
            write!(f, "| {device} | {threads} | {size} | {splats} | {pairs} |")?;
            for ms in [
                row.anchors_ms,
                row.tiles_ms,
                row.rasterise_ms,
                row.loss_ms,
                row.rasterise_backward_ms,
                row.anchors_backward_ms,
            ] {
                write!(f, " {ms:.1} |")?;
            }
            writeln!(f, " **{:.1}** |", row.step_ms)?;
        }
        Ok(())
    }
}
