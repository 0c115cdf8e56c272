//! Pictures of several runs as one.

use std::fs;
use std::path::Path;

use anyhow::Result;
use image::codecs::jpeg::JpegEncoder;
use image::imageops::replace;
use image::{Rgb, RgbImage};

const GAP_PX: u32 = 6;
const JPEG_QUALITY: u8 = 85;

/// Writes pictures side by side into a JPEG.
pub(super) fn side_by_side(images: &[RgbImage], path: &Path) -> Result<()> {
    let width = images.iter().map(|image| image.width() + GAP_PX).sum::<u32>().saturating_sub(GAP_PX);
    let height = images.iter().map(RgbImage::height).max().unwrap_or(0);
    let (mut all, mut left_px) = (RgbImage::from_pixel(width, height, Rgb([255; 3])), 0);
    for image in images {
        replace(&mut all, image, left_px, 0);
        left_px += i64::from(image.width() + GAP_PX);
    }
    Ok(JpegEncoder::new_with_quality(fs::File::create(path)?, JPEG_QUALITY).encode_image(&all)?)
}
