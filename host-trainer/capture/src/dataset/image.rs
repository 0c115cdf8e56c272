//! Pixels of captures: decoding, compositing on a background, reducing by area.

use std::path::Path;

use ::image::{ImageDecoder, ImageEncoder};

use super::{Background, Image};

mod jpeg_end;

/// Of 100: compression that the eye does not see.
const JPEG_QUALITY: u8 = 95;
/// Bytes that a decoded photograph may take, 1,400 megapixels; a file that asks for more is damaged.
const MOST_DECODED_BYTES: u64 = 4 << 30;

/// The profiles of sRGB that programs write differ by less than this in XYZ, and Display P3 differs by 0.08.
const SAME_PRIMARIES: f64 = 0.02;

/// What an image file says about itself before its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ImageHeader {
    /// Width and height as stored, pixels.
    pub(super) size_px: (u32, u32),
    /// Whether there is an alpha channel.
    pub(super) has_alpha: bool,
    /// Whether it has one channel of colour.
    pub(super) is_grey: bool,
    /// Whether that channel is of 16 bit: depth maps are written so, photographs are not.
    pub(super) is_depth_like: bool,
    /// The EXIF orientation, 1 to 8; 1 means upright, and so does its absence.
    pub(super) exif_orientation: u8,
    /// Whether it brings a colour profile whose primaries are not those of sRGB.
    pub(super) has_other_primaries: bool,
}

/// Reads the header of the image file `path`.
///
/// # Errors
/// What the decoder or the system said, for people.
pub(super) fn read_header(path: &Path) -> Result<ImageHeader, String> {
    let reader = ::image::ImageReader::open(path).and_then(|reader| reader.with_guessed_format());
    let mut decoder = reader.map_err(in_words)?.into_decoder().map_err(in_words)?;
    let exif_orientation = decoder.orientation().map_or(1, |orientation| orientation.to_exif());
    let has_other_primaries = decoder.icc_profile().is_ok_and(|icc| icc.is_some_and(|icc| has_other_primaries(&icc)));
    let colour = decoder.color_type();
    let is_grey = !colour.has_color();
    Ok(ImageHeader {
        size_px: decoder.dimensions(),
        has_alpha: colour.has_alpha(),
        is_grey,
        is_depth_like: is_grey && colour.bytes_per_pixel() > 1 + u8::from(colour.has_alpha()),
        exif_orientation,
        has_other_primaries,
    })
}

/// Whether a colour profile says that red, green and blue are not those of sRGB; one that cannot be read says nothing.
fn has_other_primaries(icc: &[u8]) -> bool {
    let Ok(profile) = moxcms::ColorProfile::new_from_slice(icc) else { return false };
    let primaries = |of: &moxcms::ColorProfile| {
        [of.red_colorant, of.green_colorant, of.blue_colorant].map(|colorant| [colorant.x, colorant.y, colorant.z])
    };
    let pairs = primaries(&profile)
        .into_iter()
        .flatten()
        .zip(primaries(&moxcms::ColorProfile::new_srgb()).into_iter().flatten());
    profile.color_space == moxcms::DataColorSpace::Rgb
        && pairs.map(|(own, srgb)| (own - srgb).abs()).fold(0.0, f64::max) > SAME_PRIMARIES
}

/// Decodes an image as it is stored: an EXIF orientation is not applied, because poses and intrinsics are for the
/// pixels as stored.
pub(super) fn decode(path: &Path) -> Result<::image::DynamicImage, String> {
    let bytes = std::fs::read(path).map_err(in_words)?;
    if bytes.starts_with(&jpeg_end::START) && !jpeg_end::is_whole(&bytes) {
        return Err(format!(
            "the JPEG ends after {} bytes without its end marker (FF D9), so the file was cut",
            bytes.len()
        ));
    }
    let mut reader = ::image::ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format().map_err(in_words)?;
    let mut limits = ::image::Limits::default();
    limits.max_alloc = Some(MOST_DECODED_BYTES);
    reader.limits(limits);
    reader.decode().map_err(in_words)
}

/// What a decoder or the system said, on one line.
fn in_words(error: impl std::fmt::Display) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Decodes the image file `path` and composites it on `background`; also returns the share of its pixels that are not wholly
/// transparent.
///
/// # Errors
/// What the decoder or the system said, for people.
pub(super) fn read_composited(path: &Path, background: Background) -> Result<(Image, f64), String> {
    let rgba = decode(path)?.into_rgba8();
    let (width_px, height_px) = rgba.dimensions();
    let n_shown = rgba.pixels().filter(|pixel| pixel.0[3] > 0).count();
    let shown = n_shown as f64 / f64::from(width_px * height_px).max(1.0);
    Ok((Image { width_px, height_px, rgb: composite(rgba.as_raw(), background) }, shown))
}

/// Composites straight-alpha pixels on a background: `⌊(c·a + b·(255 − a)) / 255⌋` per channel.
///
/// Truncates rather than rounds, as the loaders of the anchor-based family do, so that figures compare; in whole
/// numbers, because their floating-point products fall one short where the exact value is whole.
///
/// * `rgba`: `[n_pixels, 4]`.
/// * returns: `[n_pixels, 3]`.
fn composite(rgba: &[u8], background: Background) -> Vec<u8> {
    let behind = background.rgb8();
    let mut rgb = Vec::with_capacity(rgba.len() / 4 * 3);
    for pixel in rgba.chunks_exact(4) {
        let alpha = u32::from(pixel[3]);
        for (&channel, behind) in pixel.iter().zip(behind) {
            let blended = (u32::from(channel) * alpha + u32::from(behind) * (255 - alpha)) / 255;
            #[expect(clippy::cast_possible_truncation, reason = "a weighted mean of two bytes is a byte")]
            rgb.push(blended as u8);
        }
    }
    rgb
}

impl Image {
    /// Averages the image over the area of each pixel of a `width_px × height_px` image, rounding to 8 bit.
    ///
    /// Exact: with widths W → w, source pixel i covers `[i·w, (i+1)·w)` and target pixel j `[j·W, (j+1)·W)` of a line of
    /// `W·w` units, so all coverages are whole numbers and the mean is rounded once. Enlarging repeats pixels.
    ///
    /// Work: one multiplication per source channel and overlapped target pixel, per axis.
    ///
    /// # Panics
    /// When a side of either size is 0.
    pub fn area_resized(&self, width_px: u32, height_px: u32) -> Self {
        assert!(width_px > 0 && height_px > 0, "an image needs pixels, not {width_px}×{height_px}");
        if (width_px, height_px) == (self.width_px, self.height_px) {
            return self.clone();
        }
        let columns = coverages(self.width_px, width_px);
        let rows = coverages(self.height_px, height_px);
        let row_len = width_px as usize * 3;
        // Sums of value × coverage; the divisor is the number of units one target pixel covers.
        let mut sums = vec![0_u64; row_len * height_px as usize];
        let mut row_sums = vec![0_u64; row_len];
        for (y, source_row) in self.rgb.chunks_exact(self.width_px as usize * 3).enumerate() {
            row_sums.fill(0);
            for (pixel, covered) in source_row.chunks_exact(3).zip(&columns) {
                for &(x, weight) in covered {
                    for (sum, &value) in row_sums[x * 3..].iter_mut().zip(pixel) {
                        *sum += weight * u64::from(value);
                    }
                }
            }
            for &(target_y, weight) in &rows[y] {
                for (sum, &row_sum) in sums[target_y * row_len..].iter_mut().zip(&row_sums) {
                    *sum += weight * row_sum;
                }
            }
        }
        let divisor = u64::from(self.width_px) * u64::from(self.height_px);
        #[expect(clippy::cast_possible_truncation, reason = "a mean of bytes is a byte")]
        let rgb = sums.iter().map(|&sum| ((2 * sum + divisor) / (2 * divisor)) as u8).collect();
        Self { width_px, height_px, rgb }
    }

    /// The image as a JPEG of quality 95 of 100.
    ///
    /// # Errors
    /// What the encoder said.
    pub fn to_jpeg(&self) -> Result<Vec<u8>, ::image::ImageError> {
        let mut bytes = Vec::new();
        let encoder = ::image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY);
        encoder.write_image(&self.rgb, self.width_px, self.height_px, ::image::ExtendedColorType::Rgb8)?;
        Ok(bytes)
    }

    /// The image as an 8-bit RGB PNG.
    ///
    /// # Errors
    /// What the encoder said.
    pub fn to_png(&self) -> Result<Vec<u8>, ::image::ImageError> {
        let mut bytes = Vec::new();
        let encoder = ::image::codecs::png::PngEncoder::new(&mut bytes);
        encoder.write_image(&self.rgb, self.width_px, self.height_px, ::image::ExtendedColorType::Rgb8)?;
        Ok(bytes)
    }
}

/// For each of `n_source` pixels of a line, the pixels of a line of `n_target` it overlaps and by how many units, a
/// source pixel being `n_target` units long and a target pixel `n_source`.
fn coverages(n_source: u32, n_target: u32) -> Vec<Vec<(usize, u64)>> {
    let (source_len, target_len) = (u64::from(n_target), u64::from(n_source));
    (0..u64::from(n_source))
        .map(|i| {
            let (start, end) = (i * source_len, (i + 1) * source_len);
            (start / target_len..=(end - 1) / target_len)
                .map(|j| {
                    let overlap = end.min((j + 1) * target_len) - start.max(j * target_len);
                    #[expect(clippy::cast_possible_truncation, reason = "j < n_target, a u32")]
                    let target = j as usize;
                    (target, overlap)
                })
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient(width_px: u32, height_px: u32) -> Image {
        let rgb = (0..width_px * height_px * 3).map(|i| (i * 7919 % 251) as u8).collect();
        Image { width_px, height_px, rgb }
    }

    fn mean(image: &Image) -> f64 {
        image.rgb.iter().map(|&v| f64::from(v)).sum::<f64>() / image.rgb.len() as f64
    }

    #[test]
    fn the_same_size_is_the_same_image() {
        assert_eq!(gradient(7, 5).area_resized(7, 5), gradient(7, 5));
    }

    #[test]
    fn reducing_keeps_the_mean() {
        let image = gradient(30, 20);
        for (w, h) in [(15, 10), (7, 3), (29, 19), (1, 1)] {
            // Rounding moves each value by at most half a step.
            assert!((mean(&image.area_resized(w, h)) - mean(&image)).abs() <= 0.5, "{w}×{h}");
        }
    }

    #[test]
    fn fractional_coverage_weighs_by_overlap() {
        let line = Image { width_px: 3, height_px: 1, rgb: [0_u8, 90, 240].iter().flat_map(|&v| [v; 3]).collect() };
        // Each half covers one pixel and a half: (0·1 + 90·½)/1.5 and (90·½ + 240·1)/1.5.
        assert_eq!(line.area_resized(2, 1).rgb, [30, 30, 30, 190, 190, 190]);
        let pair = Image { width_px: 2, height_px: 1, rgb: vec![0, 0, 0, 1, 1, 255] };
        assert_eq!(pair.area_resized(1, 1).rgb, [1, 1, 128], "halves round up");
    }

    #[test]
    fn a_flat_image_stays_flat_at_any_size() {
        let flat = Image { width_px: 13, height_px: 11, rgb: vec![201; 13 * 11 * 3] };
        for (w, h) in [(1, 1), (5, 11), (12, 10), (26, 33)] {
            assert!(flat.area_resized(w, h).rgb.iter().all(|&v| v == 201), "{w}×{h}");
        }
    }

    #[test]
    fn a_written_jpeg_reads_back_nearly_the_same() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("picture.jpg");
        let smooth =
            Image { width_px: 32, height_px: 24, rgb: (0..32 * 24).flat_map(|i| [(i / 4) as u8; 3]).collect() };
        let bytes = smooth.to_jpeg().expect("a JPEG");
        assert!(jpeg_end::is_whole(&bytes));
        std::fs::write(&path, bytes).expect("it is written");
        let (read, _) = read_composited(&path, Background::Black).expect("a JPEG");
        assert!(read.rgb.iter().zip(&smooth.rgb).all(|(a, b)| a.abs_diff(*b) <= 8));
    }

    #[test]
    fn compositing_truncates_and_keeps_opaque_pixels() {
        let rgba = [200, 100, 0, 255, 200, 100, 0, 0, 255, 100, 1, 127];
        assert_eq!(composite(&rgba, Background::Black), [200, 100, 0, 0, 0, 0, 127, 49, 0]);
        assert_eq!(composite(&rgba, Background::White), [200, 100, 0, 255, 255, 255, 255, 177, 128]);
    }
}
