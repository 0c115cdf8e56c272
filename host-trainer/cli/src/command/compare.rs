//! `pocketsplat compare`: what finished runs came to, and what they took.

use std::path::{Path, PathBuf};

use crate::plot::{CostPanel, CostPoint, cost_svg};
use anyhow::{Context, Result};
use pocketsplat_files::Outputs;
use pocketsplat_trainer::cost::on_front;
use serde::{Deserialize, Serialize};

use super::bundle::BundleFile;
use super::eval::Evaluation;
use super::outputs::{self, FIGURE, OverwriteArgs};
use super::{output, point};
use crate::config::{Difference, RunConfig};
use crate::program;

/// Compare finished runs.
///
/// Quality, bytes and the minutes that they took, by the settings in which they differ from the first.
///
/// Writes runs.csv and runs.svg. Bundles are measured on the views that are held out of training, once: the figures are kept beside
/// them. Minutes are of one processor core, so that they do not depend on what else the machine did.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Run folders, of which all but the first are named by their differences from the first.
    #[arg(value_name = "RUN", required = true)]
    runs: Vec<PathBuf>,
    /// Folder for the results.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    overwrite: OverwriteArgs,
}

/// One line of runs.csv.
#[derive(Debug, Serialize)]
struct RunLine {
    /// The key that varies, for colours; empty for the first run.
    #[serde(skip)]
    parameter: String,
    run: String,
    setting: String,
    processor_minutes: f64,
    #[serde(rename = "PSNR")]
    psnr_db: f64,
    #[serde(rename = "SSIM")]
    ssim: f64,
    #[serde(rename = "Size [Bytes]")]
    size_bytes: usize,
    n_anchors: u32,
    #[serde(rename = "#Gaussians")]
    n_gaussians: u64,
    program: String,
}

/// What is read of a run's result.json.
#[derive(Deserialize)]
struct RunResult {
    train_processor_s: f64,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    Outputs::folder(&args.output)?;
    let mut outputs = args.runs.iter().fold(args.overwrite.outputs(), |outputs, run| outputs.reading_folder(run));
    let csv = outputs.file(&args.output.join("runs.csv"), outputs::table(&["run,"]))?;
    let svg = outputs.file(&args.output.join("runs.svg"), FIGURE)?;
    let config = |run: &PathBuf| {
        let config = RunConfig::of_run(run)?;
        Ok(RunConfig { output: BundleFile::of_run(run, &config)?.path, ..config })
    };
    let configs = args.runs.iter().map(config).collect::<Result<Vec<_>>>()?;
    let measured = |(run, config): (&PathBuf, &RunConfig)| {
        point::measured(config, None).with_context(|| {
            let config = run.join("config.toml");
            format!(
                "{} cannot be measured; if its capture has moved, name it as `dataset` in {}",
                run.display(),
                config.display()
            )
        })
    };
    let evaluations = args.runs.iter().zip(&configs).map(measured).collect::<Result<Vec<_>>>()?;
    let runs = args.runs.iter().zip(configs.iter().zip(&evaluations));
    let lines = runs.map(|(run, compared)| line(run, compared, (&configs[0], &evaluations[0])));
    let lines = lines.collect::<Result<Vec<_>>>()?;
    program::warn_of_several(lines.iter().map(|line| line.program.as_str()));
    let table = output::csv(&lines)?;
    csv.write(&table)?;
    let panels = [
        panel("Quality over time", "minutes of a processor core", &lines, |line| line.processor_minutes),
        panel("Quality over bytes", "bundle, kB", &lines, |line| line.size_bytes as f64 / 1e3),
    ];
    svg.write(cost_svg(&panels)?.as_bytes())?;
    output::print_text(&String::from_utf8(table)?)
}

fn line(
    run: &Path,
    (config, evaluation): (&RunConfig, &Evaluation),
    (first, first_evaluation): (&RunConfig, &Evaluation),
) -> Result<RunLine> {
    let path = run.join("result.json");
    let result =
        std::fs::read(&path).with_context(|| format!("could not read {}: is the run finished?", path.display()))?;
    let result: RunResult = serde_json::from_slice(&result)
        .with_context(|| format!("{} does not say what the run took; train it anew", path.display()))?;
    let mut differences = first.differences_of_bundles(config)?;
    if let (Some(first), Some(protocol)) = (&first_evaluation.protocol, &evaluation.protocol) {
        differences.extend(first.differences(protocol));
    }
    let (parameter, setting) = named(&differences);
    Ok(RunLine {
        parameter,
        run: run.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        setting,
        processor_minutes: result.train_processor_s / 60.0,
        psnr_db: evaluation.psnr_db,
        ssim: evaluation.ssim,
        size_bytes: evaluation.bundle_bytes,
        n_anchors: evaluation.n_anchors,
        n_gaussians: evaluation.n_gaussians,
        program: evaluation.program.clone(),
    })
}

/// A short name of the first key that differs, and all of them with their values; tables by their names alone.
fn named(differences: &[Difference]) -> (String, String) {
    let short = |key: &str| key.rsplit('.').next().unwrap_or(key).to_owned();
    // Voxels follow the resolution, and the widths of heads the modules.
    let chosen: Vec<&Difference> = differences.iter().filter(|difference| !is_derived(&difference.key)).collect();
    let said = chosen.iter().map(|Difference { key, other, .. }| match other.as_str() {
        table if table.starts_with('{') => short(key),
        "nothing" => format!("without {}", short(key)),
        value => format!("{} {value}", short(key)),
    });
    let said: Vec<String> = said.collect();
    let parameter =
        chosen.first().map_or_else(|| "as the first".to_owned(), |difference| parameter_of(&difference.key));
    (parameter, if said.is_empty() { "as the first".to_owned() } else { said.join(", ") })
}

fn is_derived(key: &str) -> bool {
    ["train.voxel_size", "train.shape.detail_hidden", "train.densification.coarsest_cells"].contains(&key)
}

/// The key, or the table of all modules.
fn parameter_of(key: &str) -> String {
    if key.starts_with("train.modules") {
        "modules".to_owned()
    } else {
        key.rsplit('.').next().unwrap_or(key).to_owned()
    }
}

fn panel(title: &str, unit: &str, lines: &[RunLine], cost: fn(&RunLine) -> f64) -> CostPanel {
    let front = on_front(&lines.iter().map(|line| (cost(line), line.psnr_db)).collect::<Vec<_>>());
    let points = lines.iter().zip(front).map(|(line, on_front)| CostPoint {
        parameter: line.parameter.clone(),
        setting: line.setting.clone(),
        cost: cost(line),
        psnr_db: line.psnr_db,
        on_front,
    });
    CostPanel { title: title.to_owned(), unit: unit.to_owned(), points: points.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_named_by_what_it_has_otherwise() {
        let first = RunConfig::default();
        let name = |keys: &[&str]| {
            let keys: Vec<String> = keys.iter().map(|key| (*key).to_owned()).collect();
            named(&first.differences_of_bundles(&first.with_keys(&keys).unwrap()).unwrap())
        };
        let pair = |parameter: &str, setting: &str| (parameter.to_owned(), setting.to_owned());
        assert_eq!(name(&[]), pair("as the first", "as the first"));
        assert_eq!(name(&["train.iterations=500"]), pair("iterations", "iterations 500"));
        assert_eq!(name(&["train.shape.n_offsets=3", "train.voxel_size=0.5"]), pair("n_offsets", "n_offsets 3"));
        assert_eq!(
            name(&["encoding.coder=static", "capture.test_every=5"]),
            pair("test_every", "test_every 5, coder \"static\"")
        );
        let mut with_detail = first.clone();
        with_detail.train.modules.detail = Some(Default::default());
        assert_eq!(named(&first.differences_of_bundles(&with_detail).unwrap()), pair("modules", "detail"));
        assert_eq!(named(&with_detail.differences_of_bundles(&first).unwrap()), pair("modules", "without detail"));
    }
}
