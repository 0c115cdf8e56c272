//! `pocketsplat poses`: photographs or a film in, a capture out. It drives COLMAP and `ffmpeg`; no pose is found here.

mod child;
mod choice;
mod colmap;
mod film;
mod heard;
mod inputs;
mod kinds;
mod log;
mod mapping;
mod model;
mod photographs;
mod place;
mod programs;
mod progress;
mod report;
mod search;
mod state;
mod taking;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use pocketsplat_capture::dataset::{LoadOptions, Severity, diagnose, layout_of};
use pocketsplat_files::{beside, shell_word};

use self::child::Work;
use self::colmap::Colmap;
use self::film::Film;
use self::inputs::Given;
use self::place::Place;
use self::report::Report;
use self::search::Search;
use self::state::{Cameras, GivenFile, Matching, Settings, Stage};
use super::{output, stop};
use crate::config::named::one_of;
use crate::say::say;

const CAMERAS: &[&str] = &["one", "each"];
const MATCHINGS: &[&str] = &["exhaustive", "sequential"];

/// Find where photographs were taken: photographs or a film become a capture.
///
/// Drives COLMAP, and ffmpeg for films, which have to be installed. What was interrupted goes on when the same command is given again.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of photographs, or a film; several photographs or films of one camera.
    #[arg(required = true, value_name = "PHOTOS|FILM")]
    inputs: Vec<PathBuf>,
    /// Folder of the capture to write: a new one, or the one whose images/ holds the photographs.
    #[arg(short, long, value_name = "CAPTURE")]
    output: PathBuf,
    #[command(flatten)]
    options: Options,
    /// Begin anew where an earlier search with other options lies.
    #[arg(short = 'w', long)]
    overwrite: bool,
    /// Print the result as JSON [default: as text]
    #[arg(long)]
    json: bool,
}

/// How poses are found.
#[derive(clap::Args, Clone, Copy, Debug, Default)]
struct Options {
    /// Frames to take of a film, fewer where the camera hardly moves [default: 3 a second, 30 to 150]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(taking::FEWEST as i64..=5000))]
    frames: Option<u32>,
    /// Whether one lens took all photographs of a size, or each has its own.
    #[arg(long, value_name = "WHOSE", value_parser = one_of::<Cameras>(CAMERAS), default_value = CAMERAS[0])]
    cameras: Cameras,
    /// Which photographs are compared: each with each other, or with the next ones by name
    /// [default: sequential for films and more than 200 photographs, else exhaustive]
    #[arg(long, value_name = "HOW", value_parser = one_of::<Matching>(MATCHINGS))]
    matching: Option<Matching>,
    /// Let COLMAP work on the CPU, as it does without a display.
    #[arg(long)]
    cpu: bool,
}

pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    let Some(mut report) = found(&args.inputs, &args.output, args.options, args.overwrite)? else {
        return Ok(ExitCode::from(stop::INTERRUPTED));
    };
    let diagnosis = diagnose(&args.output, &LoadOptions::default());
    let n_errors = diagnosis.count(Severity::Error);
    report.diagnosis = Some(diagnosis);
    output::print_or(&report, args.json, &report)?;
    if n_errors == 0 {
        let (capture, bundle) = (shell_word(&args.output), shell_word(&beside(&args.output, ".psb")));
        say!("next:  pocketsplat train {capture} -o {bundle}");
        return Ok(ExitCode::SUCCESS);
    }
    if !args.json {
        bail!("{} cannot be trained on: {n_errors} errors", args.output.display());
    }
    // The diagnosis has said it.
    Ok(ExitCode::FAILURE)
}

/// The capture to train on: the folder itself where it has poses, else one beside the bundle that gets them now; `None` where that was
/// stopped.
pub(super) fn capture_to_train(photographs: &Path, bundle: &Path) -> Result<Option<PathBuf>> {
    if layout_of(photographs).is_some() {
        say!("{} has poses already", photographs.display());
        return Ok(Some(photographs.to_owned()));
    }
    let capture = bundle.with_extension("capture");
    let Some(report) = found(&[photographs.to_owned()], &capture, Options::default(), false)? else { return Ok(None) };
    crate::say::text(&report.to_string());
    Ok(Some(capture))
}

/// Finds poses, or what is left to be found; `None` where it was stopped.
fn found(inputs: &[PathBuf], capture: &Path, options: Options, overwrite: bool) -> Result<Option<Report>> {
    let given = Given::at(inputs)?;
    let settings = settings_of(&given, options)?;
    // Before anything is written.
    let colmap = Colmap::find()?;
    given.check_programs()?;
    if let Given::Photographs(photographs) = &given {
        photographs::check(photographs, given.lies_in(capture), capture)?;
    }
    let mut place = Place::open(capture, &given, settings, overwrite)?;
    let (log, stop) = (place.log.clone(), stop::flag()?);
    let work = Work { log: &log, stop: &stop };
    let stopped = || {
        say!("stopped; the same command goes on");
        Ok(None)
    };
    let of_film = matches!(given, Given::Films(_));
    say!("1 of 4  {} into {}", if of_film { "frames" } else { "photographs" }, place.images().display());
    if !place.state.is_done(Stage::Photographs) {
        let images = place.images();
        std::fs::create_dir_all(&images).with_context(|| format!("could not make {}", images.display()))?;
        let taken = match &given {
            Given::Films(films) => {
                let films = films.iter().map(|path| Film::read(path)).collect::<Result<Vec<_>>>()?;
                taking::frames(&films, place.state.settings.frames, &images, work)?
            }
            Given::Photographs(given) => photographs::prepared(given, &images, place.state.in_place, work)?,
        };
        let Some(taken) = taken else { return stopped() };
        place.state.photographs = taken;
        place.finish(Stage::Photographs)?;
    }
    let on_gpu = !options.cpu && colmap.finds_gpu();
    let n = place.state.photographs.len();
    say!("2 of 4  features of {n} photographs, by {} on the {}", colmap.version, if on_gpu { "GPU" } else { "CPU" });
    let mut search = Search { colmap: &colmap, place: &mut place, work, on_gpu };
    if !search.features()? {
        return stopped();
    }
    say!("3 of 4  matches between them");
    if !search.matches()? {
        return stopped();
    }
    say!("4 of 4  poses and points");
    let Some(models) = search.models()? else { return stopped() };
    // Whoever goes on with the capture has to hear of it.
    if work.is_stopped() {
        return stopped();
    }
    let report = Report::new(capture, &place.state.photographs, &models);
    if let Some(warning) = report.warning() {
        say!("{warning}");
    }
    Ok(Some(report))
}

/// What decides the poses, so that nothing of two searches is mixed.
fn settings_of(given: &Given, options: Options) -> Result<Settings> {
    let of_film = matches!(given, Given::Films(_));
    if options.frames.is_some() && !of_film {
        bail!(
            "--frames says how many are taken of a film, and these are photographs, which are all taken; leave it out"
        );
    }
    let file = |path: &Path| -> Result<GivenFile> {
        let found = std::fs::metadata(path).with_context(|| format!("could not read {}", path.display()))?;
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        Ok(GivenFile { name, bytes: found.len() })
    };
    let files = given.files().into_iter().map(file).collect::<Result<_>>()?;
    Ok(Settings {
        files,
        frames: options.frames.map(|n| n as usize),
        cameras: options.cameras,
        matching: options.matching,
    })
}
