//! Why a finished run has no bundle.

use pocketsplat_capture::dataset::PhotographError;
use pocketsplat_format::DecodeError;

use pocketsplat_codec::bundle::WriteError;
use pocketsplat_codec::manifest::MeasureError;

/// Why a finished run has no bundle.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum EncodeError {
    /// Even a small part of the scene is too much for the device.
    #[error(
        "the scene does not fit: with {n_anchors} anchors it takes {needed} {limit}, {available} are allowed; allow \
         more or train a narrower model (--feature-dim, --offsets)"
    )]
    TooLarge { limit: &'static str, available: u64, needed: u64, n_anchors: usize },
    /// A value or a count has no place in the format.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The decoder does not draw a training view of the coded scene.
    #[error("training view {view}: the coded scene cannot be drawn; please report it")]
    Draw { view: String, source: DecodeError },
    /// The tiers of the coded scene cannot be measured or planned for.
    #[error("the tiers of the coded scene cannot be measured; please report it")]
    Measure(#[source] DecodeError),
    /// A photograph that does not lie in memory could not be read.
    #[error(transparent)]
    Photograph(#[from] PhotographError),
}

impl From<MeasureError> for EncodeError {
    fn from(error: MeasureError) -> Self {
        match error {
            MeasureError::Decode(error) => Self::Measure(error),
            MeasureError::Photograph(error) => Self::Photograph(error),
        }
    }
}
