//! What the bundle of a scene takes of its limits, asked while it is trained.

use std::error::Error;
use std::fmt;

use super::{Finished, LimitShares};
use crate::train::error::TrainError;

/// Shares of the limits that the bundle of a scene takes, or what keeps the scene from being coded or drawn.
pub type MeasuredShares = Result<LimitShares, Box<dyn Error + Send + Sync>>;

/// How bundles are measured while a scene is trained; training itself knows nothing of them.
#[derive(Clone, Copy)]
pub struct LimitProbe<'a> {
    /// Codes a scene to find out.
    pub measure: &'a (dyn Fn(&Finished) -> MeasuredShares + Sync),
    /// Whether the length of the bundle is limited.
    pub limits_bytes: bool,
}

impl fmt::Debug for LimitProbe<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LimitProbe").field("limits_bytes", &self.limits_bytes).finish_non_exhaustive()
    }
}

impl LimitProbe<'_> {
    /// What the bundle of a scene takes.
    ///
    /// # Errors
    /// [`TrainError::LimitProbe`] for a scene that has no bundle.
    pub fn shares(&self, finished: &Finished) -> Result<LimitShares, TrainError> {
        (self.measure)(finished).map_err(TrainError::LimitProbe)
    }
}
