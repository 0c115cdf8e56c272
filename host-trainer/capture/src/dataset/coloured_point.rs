//! A point that was made of photographs.

use glam::DVec3;

/// A point and the colour of its pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ColouredPoint {
    pub(super) at: DVec3,
    pub(super) rgb: [u8; 3],
}
