//! `pocketsplat report`: a page about a finished run.

pub(super) mod amounts;
mod exposures;
mod pictures;
mod poses;
mod sections;

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use pocketsplat_capture::dataset::{Capture, Split};
use pocketsplat_files::{Output, Outputs, shell_word};
use pocketsplat_viewer::{escaped, page};
use serde::Deserialize;

use super::bundle::BundleFile;
use super::capture::CaptureArgs;
use super::eval::{Evaluation, Measurements, Renderer, measure};
use super::gaussians::GaussiansFile;
use super::output;
use super::outputs::{self, OverwriteArgs, check_name, reading_capture};
use super::train::result::{PoseChange, ViewExposure};
use crate::config::{CaptureOptions, RunConfig};
use crate::plot::{Recording, learning_curve_svg};
use crate::say::say;

const PAGE: &str = include_str!("report/report.html");
/// Of the page that watches a run too.
pub(super) const STYLE: &str = include_str!("report/report.css");
const SCRIPT: &str = include_str!("report/report.js");

/// The page in a run's folder.
const FILE: &str = "report.html";

/// Write a page about a finished run.
///
/// Quality view by view, photograph against picture, bytes, tiers, the viewer.
///
/// It is one file that fetches nothing. `train` writes one into the run folder at its end.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Run folder.
    #[arg(value_name = "OUT.run")]
    run: PathBuf,
    /// Where the capture lies now [default: where the run found it]
    #[arg(value_name = "CAPTURE")]
    dataset: Option<PathBuf>,
    /// The page to write [default: report.html in the run folder]
    #[arg(short, long, value_name = "OUT.html")]
    output: Option<PathBuf>,
    #[command(flatten)]
    overwrite: OverwriteArgs,
}

/// What is read of a run's result.json.
#[derive(Deserialize)]
struct RunResult {
    iterations: u32,
    train_s: f64,
    train_processor_s: f64,
    peak_memory_bytes: Option<u64>,
    exposures: Option<Vec<ViewExposure>>,
    poses: Option<Vec<PoseChange>>,
}

/// A run and its bundle, and the photographs where they are at hand.
struct Run<'a> {
    folder: &'a Path,
    config: &'a RunConfig,
    result: RunResult,
    file: BundleFile,
    photographs: Option<Photographs<'a>>,
}

/// The views that were held out, and how the bundle compares with them.
struct Photographs<'a> {
    capture: &'a Capture,
    evaluation: Evaluation,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let config = RunConfig::of_run(&args.run)?;
    let output = args.output.clone().unwrap_or_else(|| args.run.join(FILE));
    check_name(&output, outputs::PAGE, None)?;
    let mut outputs = args.overwrite.outputs().reading_folder(&args.run).reading(&config.output);
    let source = CaptureArgs {
        dataset: args.dataset.clone().unwrap_or(config.dataset.clone()),
        options: config.capture.clone(),
    };
    outputs = reading_capture(outputs, &source, &output);
    let output = outputs.file(&output, outputs::PAGE)?;
    let has_photographs = args.dataset.is_some() || !GaussiansFile::is_trained_on(&config);
    let capture = has_photographs.then(|| source.load(config.train.seed));
    let capture = capture.and_then(|capture| {
        let warn = |error: &anyhow::Error| {
            say!("warning: the page will lack photographs: {error:#}; give the folder as CAPTURE if it has moved");
        };
        capture.inspect_err(warn).ok()
    });
    let n_bytes = write(&args.run, &config, (capture.as_ref(), args.dataset.as_deref()), &output)?;
    output::print_text(&format!("{}: {:.2} MB; open it in a browser\n", output.path().display(), n_bytes as f64 / 1e6))
}

/// Writes the page of a run that has just ended into its folder, and returns its path; a run is not worse for lacking one.
pub(super) fn write_into(folder: &Path, config: &RunConfig, capture: &Capture) -> Option<PathBuf> {
    let path = folder.join(FILE);
    // The folder is the run's own.
    let written = Outputs::new(true).file(&path, outputs::PAGE).map_err(anyhow::Error::from);
    let written = written.and_then(|page| write(folder, config, (Some(capture), None), &page));
    match written {
        Ok(_) => say!("its report:   {}", path.display()),
        Err(error) => say!("warning: there is no report: {error:#}"),
    }
    path.is_file().then_some(path)
}

/// Returns the length of the page.
///
/// * `given`: where the capture lies, if somebody says so. It is refused then if it is another one, and else left out with a word.
fn write(
    folder: &Path,
    config: &RunConfig,
    (capture, given): (Option<&Capture>, Option<&Path>),
    output: &Output,
) -> Result<usize> {
    let result = folder.join("result.json");
    let text = std::fs::read_to_string(&result).map_err(|error| match error.kind() {
        ErrorKind::NotFound => {
            let how = if GaussiansFile::is_trained_on(config) {
                "give the command of `pocketsplat import` again, and it goes on".to_owned()
            } else {
                format!("go on with `pocketsplat train --resume {}`", shell_word(folder))
            };
            anyhow!("{} is missing: the run is not finished; {how}", result.display())
        }
        _ => anyhow::Error::from(error).context(format!("could not read {}", result.display())),
    })?;
    let result = serde_json::from_str(&text).with_context(|| format!("{} is no result of a run", result.display()))?;
    let file = BundleFile::of_run(folder, config)?;
    let protocol = file.protocol(&file.parse()?);
    let another = protocol.zip(capture).and_then(|(protocol, capture)| protocol.contradiction(capture));
    if let Some(why) = &another {
        let dataset = given.unwrap_or(&config.dataset).display();
        let why = format!("{dataset}: {why}; give the folder of the run's own photographs as CAPTURE");
        if given.is_some() {
            bail!(why);
        }
        say!("warning: the page will lack photographs: {why}");
    }
    let photographs = capture
        .filter(|capture| another.is_none() && !capture.test.is_empty())
        .map(|capture| photographs(&file, capture, &config.capture))
        .transpose()?;
    let run = Run { folder, config, result, file, photographs };
    let text = html(&run)?;
    output.write(text.as_bytes())?;
    Ok(text.len())
}

fn photographs<'a>(file: &BundleFile, capture: &'a Capture, options: &CaptureOptions) -> Result<Photographs<'a>> {
    let evaluation = measure(file, capture, options, Split::Test, Renderer::Core, &Measurements::default())?;
    Ok(Photographs { capture, evaluation })
}

fn html(run: &Run<'_>) -> Result<String> {
    let bundle = run.file.parse()?;
    let name = run.config.output.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let viewer = page(&name, &[run.file.scene(&name, &bundle)]);
    let mut parts = vec![
        ("STYLE", STYLE.trim_end().to_owned()),
        ("SCRIPT", SCRIPT.trim_end().to_owned()),
        ("TITLE", escaped(&name)),
        ("NAME", escaped(&name)),
        ("FACTS", sections::facts(run, &bundle)),
        ("VIEWER", escaped(&viewer)),
        ("PICTURES", pictures::section(run, &bundle)?),
        ("CURVES", curves(run.folder, run.result.iterations)?),
        ("BYTES", sections::bytes(&bundle)?),
        ("TIERS", sections::tiers(&bundle)?),
        ("EFFECTS", sections::effects(run.folder)? + &exposures::section(run.result.exposures.as_deref())?),
        ("POSES", poses::section(run.result.poses.as_deref())),
        ("VIEWS", sections::views(run)),
        ("PROTOCOL", sections::protocol(run)?),
    ];
    // Each mark stands once, and what takes its place is not searched for marks again.
    let mut text = String::new();
    let mut rest = PAGE;
    while let Some((before, after)) = rest.split_once("{{") {
        let Some((mark, after)) = after.split_once("}}") else { bail!("report.html has a mark without an end") };
        let place = parts.iter().position(|(name, _)| *name == mark);
        let part = parts.swap_remove(place.with_context(|| format!("report.html asks for {mark}"))?).1;
        text.extend([before, &part]);
        rest = after;
    }
    Ok(text + rest)
}

/// How the run went, as a figure.
fn curves(folder: &Path, iterations: u32) -> Result<String> {
    match Recording::read(&folder.join("progress.csv"))? {
        Recording::Learning(rows) => learning_curve_svg(rows, iterations),
        _ => bail!("{} has a progress.csv that is no learning curve", folder.display()),
    }
}
