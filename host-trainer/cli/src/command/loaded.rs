//! The capture of the run at hand, loaded once for all runs that share it.

use std::path::PathBuf;

use anyhow::Result;
use pocketsplat_capture::dataset::Capture;

use super::{process, train};
use crate::config::RunConfig;

/// One capture, and the configuration that it was loaded for.
#[derive(Default)]
pub(super) struct LoadedCapture {
    loaded: Option<(RunConfig, Capture)>,
    /// Folder for what is made of the capture.
    run: Option<PathBuf>,
}

impl LoadedCapture {
    /// For runs that are trained, and not only tried out.
    ///
    /// * `run`: folder for what is made of the capture, as that of a run.
    pub(super) fn for_training(run: PathBuf) -> Self {
        Self { loaded: None, run: Some(run) }
    }

    /// The capture of a run; decides what its configuration left to it.
    ///
    /// As `train` alone would load it: where a capture has no points, those drawn at random follow the run's seed.
    pub(super) fn of(&mut self, config: &mut RunConfig) -> Result<&Capture> {
        let is_here = |(loaded, _): &(RunConfig, Capture)| {
            (&loaded.dataset, &loaded.capture, loaded.train.seed)
                == (&config.dataset, &config.capture, config.train.seed)
        };
        if self.loaded.as_ref().is_some_and(is_here) {
            let (_, capture) = self.loaded.as_ref().expect("just seen");
            train::decide(config, capture)?;
        } else {
            // Never two of them in memory.
            self.loaded = None;
            process::forget_peak_memory();
            let capture = train::load(config, self.run.as_deref(), None)?;
            self.loaded = Some((config.clone(), capture));
        }
        Ok(&self.loaded.as_ref().expect("just loaded").1)
    }
}
