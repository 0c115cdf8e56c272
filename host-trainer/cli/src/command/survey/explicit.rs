//! 3D Gaussian Splatting, and the methods that compress its scene.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use anyhow::Result;
use pocketsplat_baselines::TrainedScene;
use pocketsplat_capture::dataset::{Capture, Split};
use pocketsplat_files::Outputs;
use pocketsplat_format::bundle::crc32;
use pocketsplat_gaussians::{Format, Gaussians, Notes};
use pocketsplat_trainer::explicit::frame;
use serde::{Deserialize, Serialize};

use super::families::{Compressor, compressors};
use super::point::{Figures, Point, RunResult, is_alike, keep_figures, keep_picture, path_of, read, with_ending};
use crate::command::capture::{CaptureArgs, views_of};
use crate::command::eval::explicit::measure;
use crate::command::eval::{Evaluation, Measurements, lpips_of, timed};
use crate::command::gaussians::GaussiansFile;
use crate::command::outputs::keep;
use crate::command::train;
use crate::config::{ExplicitRunConfig, Protocol};
use crate::say::say;

/// The one rate of a method that has no choice.
const ONE_RATE: &str = "default";
const METHOD: &str = "3DGS";

/// Figures, and what they are of: another file, another scene, another LPIPS or another program has figures of its own.
#[derive(Serialize, Deserialize)]
struct Kept {
    scene_crc: u32,
    file_crc: u32,
    #[serde(flatten)]
    figures: Figures,
}

/// The scene that compressors start from, and what they share.
struct Start<'a> {
    config: &'a ExplicitRunConfig,
    capture: &'a Capture,
    what: &'a Measurements<'a>,
    gaussians: Gaussians,
    /// Of its file.
    crc: u32,
    train_s: f64,
}

/// Trains the scene and gives it to every compressor, what is not done yet; false when it was stopped before the end.
///
/// * `outputs`: what may be replaced. * `done`: told of each point that is there.
pub(super) fn points(
    config: &ExplicitRunConfig,
    folder: &Path,
    what: &Measurements<'_>,
    (outputs, stop): (Outputs, &AtomicBool),
    mut done: impl FnMut(Point) -> Result<()>,
) -> Result<bool> {
    say!("{METHOD}");
    let source = CaptureArgs { dataset: config.dataset.clone(), options: config.capture.clone() };
    let capture = &source.load_to_train(config.gaussians.seed, Some(folder), &[folder])?;
    // The methods of anchors have the same ones.
    train::keep_points(capture, folder);
    let photograph = views_of(capture, Split::Test)?[0].photograph()?;
    keep_picture(folder, "photograph", || Ok(photograph.image.clone()))?;
    if !train::explicit::trained(config, capture, outputs, stop)? {
        return Ok(false);
    }
    let bytes = std::fs::read(&config.output)?;
    let ((gaussians, notes), read_s) = timed(|| Ok(Format::Ply.read(&bytes, None)?))?;
    let file = GaussiansFile { n_bytes: bytes.len(), gaussians, notes, read_s };
    let crc = crc32(&bytes);
    let RunResult { train_s, .. } = RunResult::of(&config.output)?;
    let mut gaussians = file.gaussians.clone();
    frame::to_normalised(&mut gaussians, &frame::of_file(&file.notes.frame, &capture.normalisation));
    let start = Start { config, capture, what, gaussians, crc, train_s };
    let path = with_ending(&path_of(folder, METHOD, ONE_RATE), ".json");
    let figures = match start.kept(&path, crc)? {
        Some(figures) => figures,
        None => start.measured(METHOD, folder, &file, (train_s, crc, &path))?,
    };
    done(Point { method: METHOD, rate: ONE_RATE, figures })?;
    for compressor in compressors() {
        if stop.load(Ordering::Relaxed) {
            return Ok(false);
        }
        let (method, rate) = (compressor.method, compressor.rate);
        say!("{method}, {rate}");
        done(Point { method, rate, figures: start.compressed(&compressor, folder)? })?;
    }
    Ok(true)
}

impl Start<'_> {
    /// The figures of a compressor; its file is made where it is not there.
    fn compressed(&self, compressor: &Compressor, folder: &Path) -> Result<Figures> {
        let path = path_of(folder, compressor.method, compressor.rate);
        let (file, json) = (with_ending(&path, ".bin"), with_ending(&path, ".json"));
        if file.is_file()
            && json.is_file()
            && let Some(figures) = self.kept(&json, crc32(&std::fs::read(&file)?))?
        {
            say!("compressed before");
            return Ok(figures);
        }
        let started = Instant::now();
        let Self { config, capture, gaussians, .. } = self;
        let scene = TrainedScene { gaussians, capture, config: &config.gaussians };
        let bytes = compressor.file_of(&scene)?;
        let train_s = self.train_s + started.elapsed().as_secs_f64();
        keep(&file, &bytes)?;
        let (gaussians, read_s) = timed(|| compressor.gaussians_of(&bytes))?;
        let protocol = Protocol::of(capture, &config.capture);
        let notes = GaussiansFile::notes_of(Some(&protocol), capture.train.iter().map(|view| &view.camera))?;
        let notes = Notes { frame: frame::of_normalised(&capture.normalisation), ..notes };
        let decoded = GaussiansFile { n_bytes: bytes.len(), gaussians, notes, read_s };
        self.measured(compressor.method, folder, &decoded, (train_s, crc32(&bytes), &json))
    }

    /// Measures a file and keeps its figures and picture.
    fn measured(
        &self,
        method: &str,
        folder: &Path,
        file: &GaussiansFile,
        (train_s, file_crc, path): (f64, u32, &Path),
    ) -> Result<Figures> {
        let Self { config, capture, what, crc, .. } = self;
        let evaluation = measure(file, capture, &config.capture, Split::Test, what)?;
        keep_picture(folder, method, || {
            Ok(file.renderer(&capture.normalisation).image(&capture.test[0].camera, capture.background))
        })?;
        let kept = Kept { scene_crc: *crc, file_crc, figures: Figures { train_s, evaluation } };
        keep_figures(path, &kept)?;
        Ok(kept.figures)
    }

    /// The figures of a file, where they were kept and are of what is asked for.
    fn kept(&self, path: &Path, crc: u32) -> Result<Option<Figures>> {
        if !path.is_file() {
            return Ok(None);
        }
        let Kept { scene_crc, file_crc, figures } = read(path)?;
        let Evaluation { lpips_of: measured, program, .. } = &figures.evaluation;
        if !is_alike(program) {
            say!("the figures are of pocketsplat {program}; this one takes its own");
            return Ok(None);
        }
        let has_lpips = self.what.lpips.is_none_or(|lpips| *measured == Some(lpips_of(lpips)));
        Ok((scene_crc == self.crc && file_crc == crc && has_lpips).then_some(figures))
    }
}
