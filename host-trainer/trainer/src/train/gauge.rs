//! What the bundle of a scene takes of its limits, asked while it is trained.

use std::error::Error;
use std::fmt::Debug;

use super::finish::Finished;
use super::load::Load;
use super::{TrainError, Trainer};

/// Measures what bundles take; [`crate::encode::Scale`] codes them for it, which training itself knows nothing of.
pub trait Gauge: Debug + Sync {
    /// What the bundle of a scene takes.
    ///
    /// # Errors
    /// What keeps the scene from being coded or drawn.
    fn load(&self, finished: &Finished) -> Result<Load, Box<dyn Error + Send + Sync>>;

    /// Whether the length of the bundle is limited.
    fn limits_bytes(&self) -> bool;
}

impl<'a> Trainer<'a> {
    /// The same; rate–distortion pruning then leaves as much as `gauge` says fits, and weighs bits accordingly.
    #[must_use]
    pub fn fitting(self, gauge: Option<&'a dyn Gauge>) -> Self {
        Self { gauge, ..self }
    }

    /// Whether the bundle's length is limited.
    pub(super) fn limits_bytes(&self) -> bool {
        self.gauge.is_some_and(Gauge::limits_bytes)
    }

    /// What the scene takes without these offsets, counted through all anchors'; nothing where it has no limits.
    ///
    /// Cost: a forward pass over the views, and a coding.
    pub(super) fn load_without(&self, offsets: &[usize]) -> Result<Load, TrainError> {
        let Some(gauge) = self.gauge else { return Ok(Load::default()) };
        let mut scene = self.scene.clone();
        scene.anchors.mask(offsets);
        gauge.load(&self.finished(scene)?).map_err(TrainError::Gauge)
    }
}
