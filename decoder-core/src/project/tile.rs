//! Tiles and the rectangles of tiles that splats touch.

use bytemuck::{Pod, Zeroable};
use pocketsplat_format::rules::TILE_PX;

/// Pixels of a tile.
pub(crate) const TILE_PIXELS: usize = TILE_PX as usize * TILE_PX as usize;

/// Slack for rounding when pixels are counted, pixels; pixels too many are tested again when drawn.
const SLACK_PX: f32 = 0.01;

/// The tiles a splat may touch, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct TileRect {
    pub(crate) first_column: u8,
    pub(crate) last_column: u8,
    pub(crate) first_row: u8,
    pub(crate) last_row: u8,
}

impl TileRect {
    /// The tiles around a splat's box; `None` when the box misses all pixel centres.
    pub(crate) fn covering(mean: [f32; 2], half_extent: [f32; 2], size_px: [f32; 2]) -> Option<Self> {
        let [u, v] = mean;
        let [half_u, half_v] = half_extent;
        let [width, height] = size_px;
        let (first_column, last_column) = tiles(u, half_u, width)?;
        let (first_row, last_row) = tiles(v, half_v, height)?;
        Some(Self { first_column, last_column, first_row, last_row })
    }
}

/// First and last tile along one axis.
fn tiles(mean: f32, half_extent: f32, size_px: f32) -> Option<(u8, u8)> {
    // Pixel i has its centre at i + 0.5.
    let low = mean - half_extent - 0.5 - SLACK_PX;
    let high = mean + half_extent - 0.5 + SLACK_PX;
    // Written so that NaN leaves as well.
    if !(high >= 0.0 && low <= size_px - 1.0) {
        return None;
    }
    let last_px = if high < size_px - 1.0 { high } else { size_px - 1.0 };
    // Float casts saturate at 0; frames have at most 255 tiles a side, so the quotients fit.
    let first = (low as u16) / TILE_PX;
    let last = (last_px as u16) / TILE_PX;
    Some((u8::try_from(first).ok()?, u8::try_from(last).ok()?))
}

#[cfg(test)]
mod tests {
    use super::TileRect;

    #[test]
    fn boxes_clip_to_the_frame() {
        let rect = TileRect::covering([20.0, 20.0], [100.0, 2.0], [48.0, 32.0]);
        let all = TileRect { first_column: 0, last_column: 2, first_row: 1, last_row: 1 };
        assert_eq!(rect, Some(all), "as wide as the frame, one row");
    }

    #[test]
    fn boxes_beside_the_frame_are_dropped() {
        assert_eq!(TileRect::covering([-3.0, 8.0], [3.4, 9.0], [32.0, 32.0]), None, "ends before pixel 0's centre");
        assert!(TileRect::covering([-3.0, 8.0], [3.6, 9.0], [32.0, 32.0]).is_some(), "reaches pixel 0's centre");
        assert_eq!(TileRect::covering([f32::NAN, 8.0], [1.0, 1.0], [32.0, 32.0]), None, "not a number");
    }
}
