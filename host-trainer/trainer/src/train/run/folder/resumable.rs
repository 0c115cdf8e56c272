//! What a run folder asks of a run.

use std::io::{self, Write};

use super::RunError;
use crate::train::run::{Method, Run};

/// A run that is kept in checkpoints and goes on from them to the same bits.
pub trait Resumable {
    /// Iterations done.
    fn iteration(&self) -> u32;
    /// Iterations in all.
    fn iterations(&self) -> u32;
    /// Wall-clock seconds spent in iterations.
    fn seconds(&self) -> f64;
    /// Steps that were not applied so far.
    fn n_dropped(&self) -> u32;
    /// Of the scene: its anchors, and the Gaussians that it may draw.
    fn size(&self) -> [usize; 2];
    /// Width and height of the photograph of most pixels that it trains on.
    fn largest_px(&self) -> [u32; 2];
    /// Has everything at hand that [`Self::size`] and [`Self::save`] tell of, where it is on a device.
    ///
    /// # Errors
    /// What keeps it there.
    fn fetch(&mut self) -> Result<(), RunError> {
        Ok(())
    }
    /// Writes everything that the next iteration depends on.
    ///
    /// # Errors
    /// What `out` reports.
    fn save(&self, out: &mut dyn Write) -> io::Result<()>;
}

impl<M: Method> Resumable for Run<'_, M> {
    fn iteration(&self) -> u32 {
        self.iteration()
    }

    fn iterations(&self) -> u32 {
        self.iterations()
    }

    fn seconds(&self) -> f64 {
        self.seconds()
    }

    fn n_dropped(&self) -> u32 {
        self.n_dropped()
    }

    fn size(&self) -> [usize; 2] {
        M::size(&self.state.learned)
    }

    fn largest_px(&self) -> [u32; 2] {
        self.capture().largest_px()
    }

    fn fetch(&mut self) -> Result<(), RunError> {
        Ok(M::fetch(self)?)
    }

    fn save(&self, out: &mut dyn Write) -> io::Result<()> {
        self.save(out)
    }
}
