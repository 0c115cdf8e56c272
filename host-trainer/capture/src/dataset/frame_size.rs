//! The size of a frame, as people write it.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Width and height of a frame, pixels; written `160x120`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct FrameSize {
    /// Pixels of a row, at least 1.
    pub width_px: u32,
    /// Rows, at least 1.
    pub height_px: u32,
}

impl From<[u16; 2]> for FrameSize {
    /// Of width and height.
    fn from([width_px, height_px]: [u16; 2]) -> Self {
        Self { width_px: width_px.into(), height_px: height_px.into() }
    }
}

impl fmt::Display for FrameSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width_px, self.height_px)
    }
}

impl From<FrameSize> for String {
    fn from(size: FrameSize) -> Self {
        size.to_string()
    }
}

impl TryFrom<String> for FrameSize {
    type Error = NoFrameSize;

    fn try_from(text: String) -> Result<Self, NoFrameSize> {
        text.parse()
    }
}

/// Text that is no frame's size.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no frame size: give width and height in pixels, as 160x120")]
pub struct NoFrameSize(pub String);

impl FromStr for FrameSize {
    type Err = NoFrameSize;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let side = |text: &str| text.parse().ok().filter(|&px| px > 0);
        let sides = text.split_once(['x', '×']).and_then(|(width, height)| Some((side(width)?, side(height)?)));
        sides.map(|(width_px, height_px)| Self { width_px, height_px }).ok_or_else(|| NoFrameSize(text.to_owned()))
    }
}
