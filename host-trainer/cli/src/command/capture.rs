//! The capture that a command works on, and the views it chooses.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use pocketsplat_capture::dataset::{self, Background, Capture, LoadOptions, PointsChoice, Split, View};
use pocketsplat_files::{shell_word, unused};
use pocketsplat_trainer::train::run::{photographs_in, points_in};

use crate::config::CaptureOptions;
use crate::say::say;

/// Refuses a file of explicit Gaussians, and names the command that reads it.
pub(crate) fn refuse_gaussians(path: &Path) -> Result<()> {
    if pocketsplat_gaussians::is_one(path) {
        let word = shell_word(path);
        bail!(
            "{} is a file of Gaussians, no bundle and no capture; make a bundle of it with `pocketsplat import {word} -o {}`",
            path.display(),
            shell_word(&unused(Path::new("scene.psb")))
        );
    }
    Ok(())
}

/// What lies behind a scene, by its name where it has one.
pub(crate) fn background_name(rgb8: [u8; 3]) -> String {
    Background::of_rgb8(rgb8).map_or_else(|| format!("{rgb8:?}"), |known| known.to_string())
}

/// The same of a capture, whose border may say it.
pub(crate) fn background_of(capture: &Capture) -> String {
    background_name(capture.background.map(|channel| (255.0 * channel).round() as u8))
}

/// Where photographs come from and how they are prepared.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct CaptureArgs {
    /// Folder of the capture.
    pub(crate) dataset: PathBuf,
    #[command(flatten)]
    pub(crate) options: CaptureOptions,
}

impl CaptureArgs {
    fn load_options(&self, seed: u64, run: Option<&Path>) -> LoadOptions {
        let default = LoadOptions::default();
        LoadOptions {
            max_resolution: self.options.max_resolution,
            frame: self.options.resolution,
            background: self.options.background.unwrap_or(Background::Black),
            scene: self.options.scene,
            points: self.options.points,
            made_points: Vec::new(),
            seed,
            n_random_points: self.options.n_random_points.unwrap_or(default.n_random_points),
            images: self.options.images.clone(),
            model: self.options.model,
            test_every: self.options.test_every.unwrap_or(default.test_every),
            cache: run.map(photographs_in),
            ..default
        }
    }

    /// Loads the capture to look at its photographs once or twice, and says on stderr what was found. No points are made.
    ///
    /// Photographs that are too many for the memory are decoded again when they are needed.
    pub(crate) fn load(&self, seed: u64) -> Result<Capture> {
        let no_points =
            LoadOptions { points: Some(PointsChoice::Random), n_random_points: 0, ..self.load_options(seed, None) };
        self.load_with(&no_points)
    }

    /// The same for training, which needs points, and every photograph again and again.
    ///
    /// * `run`: its folder, which keeps photographs decoded that are too many for the memory.
    /// * `earlier`: folders of runs that may hold points which were made of the same photographs.
    pub(crate) fn load_to_train(&self, seed: u64, run: Option<&Path>, earlier: &[&Path]) -> Result<Capture> {
        let made_points = earlier.iter().map(|run| points_in(run)).collect();
        self.load_with(&LoadOptions { made_points, ..self.load_options(seed, run) })
    }

    /// The files that it is read from, wherever they lie.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        dataset::files_read(&self.dataset, &self.load_options(0, None))
    }

    fn load_with(&self, options: &LoadOptions) -> Result<Capture> {
        refuse_gaussians(&self.dataset)?;
        let (capture, report) = dataset::load(&self.dataset, options)
            .with_context(|| format!("could not load the capture {}", self.dataset.display()))?;
        say!("{report}");
        Ok(capture)
    }
}

/// The views of a split, at least one.
pub(crate) fn views_of(capture: &Capture, split: Split) -> Result<&[View]> {
    let views = match split {
        Split::Test => &capture.test,
        Split::Train => &capture.train,
    };
    if views.is_empty() {
        bail!("the capture has no {split} view; choose the other --split");
    }
    Ok(views)
}
