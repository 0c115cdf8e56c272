//! A method at one rate: its files in the folder, and its figures.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, ensure};
use pocketsplat_capture::dataset::Image;
use pocketsplat_trainer::revision_of;
use pocketsplat_trainer::train::run::RunFolder;
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::command::eval::Evaluation;
use crate::command::output;
use crate::command::outputs::{keep, marked_png};
use crate::program;

/// A method at one rate that is trained and measured.
pub(super) struct Point {
    pub(super) method: &'static str,
    pub(super) rate: &'static str,
    pub(super) figures: Figures,
}

/// What was measured of it.
#[derive(Serialize, Deserialize)]
pub(super) struct Figures {
    /// Seconds of training, with those of the scene that it starts from.
    pub(super) train_s: f64,
    pub(super) evaluation: Evaluation,
}

/// What a finished run says.
#[derive(Deserialize)]
pub(super) struct RunResult {
    program: String,
    pub(super) train_s: f64,
}

impl RunResult {
    /// * `output`: of the run.
    pub(super) fn of(output: &Path) -> Result<Self> {
        read(&result_of(output))
    }
}

fn result_of(output: &Path) -> PathBuf {
    RunFolder::beside(output).join("result.json")
}

/// Whether a program, as tables name it, trains as this one does.
pub(super) fn is_alike(program: &str) -> bool {
    revision_of(program) == program::training()
}

/// Stops where a program that trains otherwise has finished a run: a table of both would compare programs.
///
/// * `output`: of the run, if there is one.
pub(super) fn refuse_other_program(output: &Path) -> Result<()> {
    if result_of(output).is_file() {
        let RunResult { program, .. } = RunResult::of(output)?;
        ensure!(
            is_alike(&program),
            "{} was trained by pocketsplat {}, and this is {}; choose another --output, or go on with that program",
            output.display(),
            revision_of(&program),
            program::training()
        );
    }
    Ok(())
}

/// The folder of pictures.
pub(super) const PICTURES: &str = "pictures";

/// The path of a point's files, without ending.
pub(super) fn path_of(folder: &Path, method: &str, rate: &str) -> PathBuf {
    folder.join(plain(&format!("{method}-{rate}")))
}

/// A name that is one part of a path everywhere.
fn plain(name: &str) -> String {
    let kept = |c: char| if c.is_ascii_alphanumeric() || "._+-=".contains(c) { c } else { '-' };
    name.to_lowercase().chars().map(kept).collect()
}

/// With an ending; names have dots of their own.
pub(super) fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(ending);
    path.with_file_name(name)
}

/// What JSON says that a run of ours kept.
pub(super) fn read<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let bytes = std::fs::read(path).with_context(|| format!("could not read {}", path.display()))?;
    let read = serde_json::from_slice(&bytes);
    read.with_context(|| format!("{} has no figures of a run; remove it, and give the command again", path.display()))
}

/// Keeps figures as JSON.
pub(super) fn keep_figures(path: &Path, figures: &impl Serialize) -> Result<()> {
    keep(path, output::json(figures)?.as_bytes())
}

/// Keeps a picture of the first test view, once.
///
/// * `name`: what made it. * `draw`: makes it.
pub(super) fn keep_picture(folder: &Path, name: &str, draw: impl FnOnce() -> Result<Image>) -> Result<()> {
    let path = folder.join(PICTURES).join(format!("{}.png", plain(name)));
    if path.is_file() {
        return Ok(());
    }
    let png = draw()?.to_png().with_context(|| format!("could not write {}", path.display()))?;
    keep(&path, &marked_png(&png))
}
