//! A run to a checkpoint and back.

use std::io::{self, Write};

use super::checkpoint::envelope::{self, content, needs, part};
use super::checkpoint::{CaptureDifference, CaptureSignature, CheckpointFault, Kernels};
use super::method::{Method, Run};
use crate::train::error::TrainError;
use pocketsplat_capture::dataset::Capture;

/// Why a run cannot go on from a checkpoint.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RestoreError {
    /// The bytes are not sound.
    #[error(transparent)]
    Fault(#[from] CheckpointFault),
    /// The capture is another one.
    #[error("this is not the capture that the run began with: {0}")]
    Capture(CaptureDifference),
    /// A fork asks for another scene than the checkpoint holds.
    #[error(
        "a fork keeps `train.{key}` of its run, which is {kept}, but {asked} was asked for; leave out what sets it"
    )]
    Fork {
        /// The key of the setting that differs.
        key: &'static str,
        /// Its value in the run.
        kept: String,
        /// The value asked for.
        asked: String,
    },
    /// No trainer can be made of capture and configuration.
    #[error(transparent)]
    Train(#[from] TrainError),
}

/// A run ready to go on.
#[derive(Debug)]
pub struct Restored<'a, M: Method> {
    /// As it was.
    pub run: Run<'a, M>,
    /// What wrote the checkpoint; where it differs from [`Run::kernels`], the run will not end in the same bits.
    pub written_by: Kernels,
}

/// Whether the capture at hand is the one that a run began with.
type Comparison = fn(&CaptureSignature, &CaptureSignature) -> Result<(), CaptureDifference>;

impl<'a, M: Method> Run<'a, M> {
    /// Writes everything that the next iteration depends on; see [`crate::train::run::checkpoint`] for the format.
    ///
    /// # Errors
    /// What `out` reports, and that something newer is on a device: [`Method::fetch`] comes first.
    pub fn save(&self, out: impl Write) -> io::Result<()> {
        if !M::is_here(&self.machine.device) {
            return Err(io::Error::other("the scene's parameters are on the device, and were not fetched"));
        }
        let config = toml::to_string(&self.setup.config).map_err(io::Error::other)?;
        envelope::write(out, M::MAGIC, &(config, self.kernels(), &self.setup.signature, &self.state))
    }

    /// Reads what [`Self::save`] wrote.
    ///
    /// # Errors
    /// [`RestoreError`] when the bytes are damaged or `capture` is not the one that the run began with.
    pub fn restore(capture: &'a Capture, bytes: &[u8]) -> Result<Restored<'a, M>, RestoreError> {
        Self::read(capture, bytes, CaptureSignature::matches)
    }

    /// As [`Self::restore`], where `compare` decides whether it is the same capture.
    pub(super) fn read(
        capture: &'a Capture,
        bytes: &[u8],
        compare: Comparison,
    ) -> Result<Restored<'a, M>, RestoreError> {
        let (config, rest): (String, _) = part(content(bytes, M::MAGIC)?)?;
        // Through tables, as the command reads configurations: another way would be compiled for each of its types.
        let config: M::Config = config
            .parse()
            .and_then(toml::Table::try_into)
            .map_err(|e| CheckpointFault::Form { what: "configuration", why: e.message().to_owned() })?;
        let ((written_by, begun_with), rest): ((Kernels, CaptureSignature), _) = part(rest)?;
        let mut run = Self::without_scene(capture, config)?;
        compare(&run.setup.signature, &begun_with).map_err(RestoreError::Capture)?;
        let (state, rest) = part(rest)?;
        needs("bytes after the state", rest.len(), 0)?;
        run.state = state;
        run.check()?;
        Ok(Restored { run, written_by })
    }

    /// That counters and lengths agree with configuration and capture.
    pub(super) fn check(&mut self) -> Result<(), CheckpointFault> {
        let (done, iterations) = (self.iteration(), self.iterations());
        if done > iterations {
            needs("iterations done", done as usize, iterations as usize)?;
        }
        let n_views = self.setup.views.all.len();
        if let Some(view) = self.state.queue.iter().find(|view| **view as usize >= n_views) {
            needs("view in the queue", *view as usize, n_views - 1)?;
        }
        M::restored(self)
    }
}

#[cfg(test)]
mod tests;
