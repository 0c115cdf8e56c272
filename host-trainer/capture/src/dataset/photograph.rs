//! The pixels of a view.

use super::{Image, Mask};

/// A decoded photograph, and which of its pixels count.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Photograph {
    /// Composited on the capture's background and undistorted.
    pub image: Image,
    /// Which pixels count; all where there is none.
    pub mask: Option<Mask>,
}

impl Photograph {
    /// CRC-32 of the pixels, then of the mask with a byte a pixel: 1 where it counts, else 0.
    pub fn crc32(&self) -> u32 {
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(&self.image.rgb);
        for valid in self.mask.iter().flat_map(|mask| mask.valid.chunks(4096)) {
            hasher.update(&valid.iter().map(|valid| u8::from(*valid)).collect::<Vec<_>>());
        }
        hasher.finalize()
    }

    /// Image and mask reduced by area to `width_px × height_px`.
    pub(super) fn area_resized(&self, width_px: u32, height_px: u32) -> Self {
        Self {
            image: self.image.area_resized(width_px, height_px),
            mask: self.mask.as_ref().map(|mask| mask.area_resized(width_px, height_px)),
        }
    }
}
