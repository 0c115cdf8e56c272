//! Whether photographs are taken for exposed alike.

use serde::{Deserialize, Serialize};

/// Whether the exposure and white balance of each training photograph are found, so that the scene shows the mean photograph.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ExposureChoice {
    /// Where the photographs turn out to differ.
    #[default]
    Auto,
    /// Yes.
    On,
    /// No.
    Off,
}
