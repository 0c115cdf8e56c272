//! Compares the instructions that boards took, as `firmware-example/measure.sh` prints them, with those predicted for the same
//! frames, which this machine draws again; with `--write` it fits the costs to them first.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail, ensure};
use clap::Parser;
use pocketsplat_codec::bundle;
use pocketsplat_codec::render::decoder::image_of;
use pocketsplat_core::{Budget, Bundle, Decoder, Overflow, Plan, Stage};
use pocketsplat_instructions::{Costs, InstructionSet, N_TERMS, Term, terms};

/// Most that a frame may differ from its prediction.
const TOLERANCE: f64 = 0.1;

/// Compares measured instructions with predicted ones.
#[derive(Parser)]
struct Args {
    /// Tables of `measure.sh`.
    #[arg(required = true)]
    tables: Vec<PathBuf>,
    /// Folders with the tables' bundles, as `NAME.psb`.
    #[arg(long, required = true)]
    bundles: Vec<PathBuf>,
    /// Fits the costs and writes them to this file.
    #[arg(long)]
    write: Option<PathBuf>,
}

/// One frame of a board.
struct Frame {
    name: String,
    target: InstructionSet,
    terms: [Term; N_TERMS],
    /// Instructions, as [`Stage::ALL`] orders them.
    measured: [f64; Stage::ALL.len()],
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let mut frames = Vec::new();
    for path in &args.tables {
        frames.extend(read(path, &args.bundles).with_context(|| format!("in {}", path.display()))?);
    }
    let mut costs = Costs::measured();
    if let Some(path) = &args.write {
        // Sets without a frame keep their costs.
        for target in InstructionSet::ALL {
            let of_target: Vec<&Frame> = frames.iter().filter(|frame| frame.target == target).collect();
            for stage in Stage::ALL {
                fit(&of_target, stage, costs.of(target));
            }
        }
        let Some(first) = frames.first() else { bail!("no frames") };
        fs::write(path, costs.to_csv(&first.terms)).with_context(|| format!("cannot write {}", path.display()))?;
    }
    let mut worst = 0.0_f64;
    println!("frame: M instructions, predicted/measured: all, {}", Stage::ALL.map(Stage::name).join(", "));
    for frame in &frames {
        let predicted = costs.predict(frame.target, &frame.terms);
        let (all, all_predicted) = (frame.measured.iter().sum::<f64>(), predicted.iter().sum::<f64>());
        let ratios: Vec<String> = predicted
            .iter()
            .zip(frame.measured)
            .map(|(p, m)| format!("{:.2}", if m > 0.0 { p / m } else { 1.0 }))
            .collect();
        println!("{}: {:.1} M, {:.3}: {}", frame.name, all / 1e6, all_predicted / all, ratios.join(" "));
        worst = worst.max((all_predicted / all - 1.0).abs());
    }
    println!("the worst of {} frames is {:.1} % off", frames.len(), 100.0 * worst);
    ensure!(worst <= TOLERANCE, "more than {:.0} %", 100.0 * TOLERANCE);
    Ok(())
}

/// The frames of a table.
fn read(path: &Path, folders: &[PathBuf]) -> anyhow::Result<Vec<Frame>> {
    let text = fs::read_to_string(path)?;
    // Board and everything that decides about its frames, then the instructions of each frame.
    let mut runs = BTreeMap::<Vec<&str>, BTreeMap<u8, [f64; Stage::ALL.len()]>>::new();
    for row in text.lines().skip(1) {
        let fields: Vec<&str> = row.split(',').collect();
        let [run @ .., frame, stage, instructions] = fields.as_slice() else { bail!("a short row: {row}") };
        let Some(stage) = Stage::ALL.into_iter().find(|known| known.name() == *stage) else { continue };
        let frames = runs.entry(run.to_vec()).or_default();
        frames.entry(frame.parse()?).or_default()[stage as usize] = instructions.parse()?;
    }
    let mut all = Vec::new();
    for (run, frames) in runs {
        let [board, _, scratch, width, height, name, n_frames] = run.as_slice() else { bail!("a short row: {run:?}") };
        let target = InstructionSet::of_board(board).with_context(|| format!("unknown board {board}"))?;
        let path = folders.iter().map(|folder| folder.join(format!("{name}.psb"))).find(|path| path.exists());
        let bytes = bundle::load(&path.with_context(|| format!("no {name}.psb in the folders of bundles"))?)?;
        let bundle = Bundle::parse(&bytes)?;
        let size_px: [u16; 2] = [width.parse()?, height.parse()?];
        let n_frames: u8 = n_frames.parse()?;
        let budget = Budget::for_frame(size_px[0], size_px[1]).in_bytes(scratch.parse()?);
        // As the firmware.
        let plan =
            Plan::new(&bundle, &budget).or_else(|_| Plan::new(&bundle, &budget.with_overflow(Overflow::Slabs)))?;
        let mut memory = vec![0; plan.scratch_len()];
        let mut decoder = Decoder::bind(&bundle, plan, &mut memory)?;
        let preview = bundle.header().preview.resized(size_px[0], size_px[1]);
        for (frame, measured) in frames {
            let camera = preview.orbited(std::f32::consts::TAU * f32::from(frame) / f32::from(n_frames));
            let (_, report) = image_of(&mut decoder, &camera)?;
            let terms = terms(&bundle, &plan, &report, size_px);
            all.push(Frame { name: format!("{} {frame}", run.join(" ")), target, terms, measured });
        }
    }
    Ok(all)
}

/// Finds the costs of a stage that are nearest to what was measured: least squares of errors in parts of the whole frame, no
/// cost below zero.
///
/// Coordinate descent: each cost in turn takes its best value given the others. The problem is convex, so this ends at its minimum.
fn fit(frames: &[&Frame], stage: Stage, costs: &mut [f64; N_TERMS]) {
    let Some(first) = frames.first() else { return };
    let of_stage: Vec<usize> = (0..N_TERMS).filter(|&i| first.terms[i].stage == stage).collect();
    // Counts of each frame, and what they should add up to.
    let rows: Vec<([f64; N_TERMS], f64)> = frames
        .iter()
        .map(|frame| {
            let whole: f64 = frame.measured.iter().sum();
            (frame.terms.map(|term| term.count / whole), frame.measured[stage as usize] / whole)
        })
        .collect();
    of_stage.iter().for_each(|&i| costs[i] = 0.0);
    for _ in 0..200_000 {
        for &i in &of_stage {
            let square: f64 = rows.iter().map(|(row, _)| row[i] * row[i]).sum();
            let others =
                |row: &[f64; N_TERMS]| of_stage.iter().filter(|&&j| j != i).map(|&j| row[j] * costs[j]).sum::<f64>();
            let along: f64 = rows.iter().map(|(row, measured)| row[i] * (measured - others(row))).sum();
            costs[i] = if square > 0.0 { (along / square).max(0.0) } else { 0.0 };
        }
    }
}
