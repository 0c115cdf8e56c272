//! The capture of the run at hand, loaded once for all runs that share it.

use anyhow::Result;
use pocketsplat_capture::dataset::Capture;

use super::{process, train};
use crate::config::RunConfig;

/// One capture in memory, and the configuration that it was loaded for.
#[derive(Default)]
pub(super) struct LoadedCapture(Option<(RunConfig, Capture)>);

impl LoadedCapture {
    /// The capture of a run; decides what its configuration left to it.
    ///
    /// As `train` alone would load it: where a capture has no points, those drawn at random follow the run's seed.
    pub(super) fn of(&mut self, config: &mut RunConfig) -> Result<&Capture> {
        let is_here = |(loaded, _): &(RunConfig, Capture)| {
            (&loaded.dataset, &loaded.capture, loaded.train.seed)
                == (&config.dataset, &config.capture, config.train.seed)
        };
        if self.0.as_ref().is_some_and(is_here) {
            let (_, capture) = self.0.as_ref().expect("just seen");
            train::decide(config, capture)?;
        } else {
            // Never two of them in memory.
            self.0 = None;
            process::forget_peak_memory();
            let capture = train::load(config)?;
            self.0 = Some((config.clone(), capture));
        }
        Ok(&self.0.as_ref().expect("just loaded").1)
    }
}
