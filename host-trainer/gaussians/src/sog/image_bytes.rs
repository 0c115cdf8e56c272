//! Images as plain bytes: RGBA pixels, written and read as lossless WebP.

use std::io::Cursor;

use image::codecs::webp::{WebPDecoder, WebPEncoder};
use image::{DynamicImage, ExtendedColorType, ImageDecoder as _};

use crate::Unreadable;

/// Largest edge of a WebP image.
const MAX_EDGE: usize = 16_383;
/// Bytes of pixels that one byte of a file may become, and that any file may become: more is no scene.
const MAX_EXPANSION: usize = 64;
const ANY_EXPANSION: usize = 1 << 26;

pub(super) struct Pixels {
    width: usize,
    rgba: Vec<[u8; 4]>,
}

impl Pixels {
    /// A picture about as wide as high, one pixel for each Gaussian; the rest of the last row is 0.
    pub(super) fn of_gaussians(pixels: impl ExactSizeIterator<Item = [u8; 4]>) -> Self {
        // Multiples of 4, as the programs that read these files have theirs.
        let width = (pixels.len() as f64).sqrt().ceil() as usize;
        Self::of_rows(width.next_multiple_of(4), pixels)
    }

    /// Rows of `width` pixels; the rest of the last one is 0.
    pub(super) fn of_rows(width: usize, pixels: impl Iterator<Item = [u8; 4]>) -> Self {
        let mut rgba: Vec<[u8; 4]> = pixels.collect();
        rgba.resize(rgba.len().next_multiple_of(width), [0, 0, 0, 255]);
        Self { width, rgba }
    }

    pub(super) fn to_webp(&self) -> Result<Vec<u8>, Unreadable> {
        let height = self.rgba.len() / self.width;
        if self.width > MAX_EDGE || height > MAX_EDGE {
            return Err(Unreadable::new(format!(
                "would need an image of {} × {height} pixels, WebP has {MAX_EDGE} × {MAX_EDGE} at most; write a .ply",
                self.width
            )));
        }
        let mut out = Vec::new();
        WebPEncoder::new_lossless(&mut out)
            .encode(self.rgba.as_flattened(), self.width as u32, height as u32, ExtendedColorType::Rgba8)
            .map_err(|error| Unreadable::new(format!("would hold an image that cannot be written: {error}")))?;
        Ok(out)
    }

    /// The pixels of the WebP image `name`, out of a file of `file_bytes`.
    pub(super) fn from_webp(name: &str, bytes: &[u8], file_bytes: usize) -> Result<Self, Unreadable> {
        let broken =
            |error: image::ImageError| Unreadable::new(format!("has an image {name} that cannot be read: {error}"));
        if bytes.get(12..16) == Some(b"VP8 ") {
            return Err(Unreadable::new(format!(
                "has an image {name} whose compression is lossy, so its numbers are lost"
            )));
        }
        let decoder = WebPDecoder::new(Cursor::new(bytes)).map_err(broken)?;
        let (width, height) = decoder.dimensions();
        let needed = width as usize * height as usize * 4;
        let allowed = file_bytes.saturating_mul(MAX_EXPANSION).max(ANY_EXPANSION);
        if needed > allowed {
            return Err(Unreadable::new(format!(
                "has an image {name} of {width} × {height} pixels, {needed} bytes; from a file of {file_bytes} bytes at most {allowed} are \
                 unpacked"
            )));
        }
        let image = DynamicImage::from_decoder(decoder).map_err(broken)?.into_rgba8();
        Ok(Self { width: width as usize, rgba: image.pixels().map(|pixel| pixel.0).collect() })
    }

    /// Refuses an image of fewer pixels.
    pub(super) fn at_least(self, name: &str, n_pixels: usize) -> Result<Self, Unreadable> {
        if self.rgba.len() < n_pixels {
            return Err(Unreadable::new(format!(
                "has an image {name} of {} pixels, {n_pixels} are needed",
                self.rgba.len()
            )));
        }
        Ok(self)
    }

    /// Refuses an image of another width.
    pub(super) fn of_width(self, name: &str, width: usize) -> Result<Self, Unreadable> {
        if self.width != width {
            return Err(Unreadable::new(format!(
                "has an image {name} {} pixels wide, which has to be {width}",
                self.width
            )));
        }
        Ok(self)
    }

    /// How many pixels.
    pub(super) fn len(&self) -> usize {
        self.rgba.len()
    }

    /// Pixel `index`, row after row.
    pub(super) fn rgba(&self, index: usize) -> [u8; 4] {
        self.rgba[index]
    }
}
