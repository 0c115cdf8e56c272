//! A sink that keeps the books.

use std::convert::Infallible;

use pocketsplat_core::{Tile, TileSink};

/// A frame, and how often each of its pixels arrived.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Width, pixels.
    pub width_px: usize,
    /// `[height, width, 3]`.
    pub rgb: Vec<u8>,
    /// `[height, width]`.
    pub deliveries: Vec<u32>,
}

impl Frame {
    /// A frame to which nothing was delivered.
    pub fn new(width_px: u16, height_px: u16) -> Self {
        let n_pixels = usize::from(width_px) * usize::from(height_px);
        Self { width_px: width_px.into(), rgb: vec![0; 3 * n_pixels], deliveries: vec![0; n_pixels] }
    }
}

impl TileSink for Frame {
    type Error = Infallible;

    fn tile(&mut self, Tile { x_px, y_px, width, height, rgb, .. }: Tile<'_>) -> Result<(), Infallible> {
        let [x, y, width, height] = [x_px, y_px, width, height].map(usize::from);
        assert_eq!(rgb.len(), width * height, "pixels of the tile at ({x}, {y})");
        assert!(
            x + width <= self.width_px,
            "the tile at ({x}, {y}) ends at {}, the frame at {}",
            x + width,
            self.width_px
        );
        for (row, pixels) in rgb.chunks_exact(width).enumerate() {
            let start = (y + row) * self.width_px + x;
            self.rgb[3 * start..][..3 * width].copy_from_slice(pixels.as_flattened());
            self.deliveries[start..][..width].iter_mut().for_each(|n| *n += 1);
        }
        Ok(())
    }
}
