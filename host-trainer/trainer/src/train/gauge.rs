//! What the bundle of a scene takes of its limits, asked while it is trained.

use std::error::Error;
use std::fmt::Debug;

use super::finish::Finished;
use super::{TrainError, Trainer};

/// Measures what bundles take; [`crate::encode::Scale`] codes them for it, which training itself knows nothing of.
pub trait Gauge: Debug + Sync {
    /// What the bundle of a scene takes.
    ///
    /// # Errors
    /// What keeps the scene from being coded or drawn.
    fn load(&self, finished: &Finished) -> Result<Load, Box<dyn Error + Send + Sync>>;
}

/// Shares of the limits that a bundle takes: above 1 it does not fit; 0 where there is no limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Scratch memory of a decoder that draws the whole scene.
    pub ram: f64,
    /// Instructions of the dearest frame that was tried.
    pub instructions: f64,
    /// Bytes of the bundle.
    pub bytes: f64,
}

impl Load {
    /// The larger share of what a decoder needs, whatever the bundle's length.
    pub fn drawing(&self) -> f64 {
        self.ram.max(self.instructions)
    }
}

impl<'a> Trainer<'a> {
    /// The same; pruning by worth then leaves as much as `gauge` says fits, and weighs bits accordingly.
    #[must_use]
    pub fn fitting(self, gauge: Option<&'a dyn Gauge>) -> Self {
        Self { gauge, ..self }
    }

    /// What the scene takes without these offsets, counted through all anchors'; `None` where nobody asks.
    ///
    /// Cost: a forward pass over the views, and a coding.
    pub(super) fn load_without(&self, offsets: &[usize]) -> Result<Option<Load>, TrainError> {
        let Some(gauge) = self.gauge else { return Ok(None) };
        let mut scene = self.scene.clone();
        scene.anchors.mask(offsets);
        gauge.load(&self.finished(scene)?).map(Some).map_err(TrainError::Gauge)
    }
}
