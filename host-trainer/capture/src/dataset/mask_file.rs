//! Masks as people make them: black and white, transparent, of 16 bit, or with a number for each thing.
//!
//! One rule for all: what is black or transparent in a mask does not count. The value of a pixel is its brightest channel times its
//! alpha; where the colours are all the same and alpha is not, alpha alone. Black is up to 15 of 255 (and so of 65535), because a JPEG
//! writes black so; where a lossless mask has no value above the middle, it numbers things, and 0 alone is black.
//! instant-ngp's dynamic masks are the other way round: what is white in them moves and does not count.

use std::path::{Path, PathBuf};

use ::image::DynamicImage;
use pocketsplat_files::FileKind;

use super::Mask;
use super::folder_names::FolderNames;
use super::image::decode;
use super::image_file::stem_of;

/// As bright as black may be, of 255.
const BLACK: u16 = 15;
/// What instant-ngp puts before the name of a photograph, without its ending.
const DYNAMIC: &str = "dynamic_mask_";

/// Whether a file of this name is such a mask.
pub(super) fn is_dynamic_mask(name: &str) -> bool {
    name.rsplit('/').next().is_some_and(|name| name.starts_with(DYNAMIC))
}

/// A mask on disk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct MaskFile {
    pub(super) path: PathBuf,
    /// Whether white is what does not count.
    pub(super) is_inverted: bool,
}

impl MaskFile {
    /// A mask whose black pixels do not count.
    pub(super) fn new(path: PathBuf) -> Self {
        Self { path, is_inverted: false }
    }

    /// instant-ngp's mask beside the photograph `image`, `dynamic_mask_NAME.png`.
    pub(super) fn dynamic(names: &FolderNames, image: &Path) -> Option<Self> {
        let stem = stem_of(image.file_name()?.to_str()?);
        let path = names.named(image.parent()?, &format!("{DYNAMIC}{stem}.png"), Path::is_file)?;
        Some(Self { path, is_inverted: true })
    }

    /// Decodes the mask.
    ///
    /// # Errors
    /// What the decoder or the system said, for people.
    pub(super) fn read(&self) -> Result<Mask, String> {
        let image = decode(&self.path)?;
        let is_lossy = FileKind::of_file(&self.path).is_ok_and(|kind| kind == Some(FileKind::Jpeg));
        let (width_px, height_px) = (image.width(), image.height());
        let mut valid = counted(&image, is_lossy);
        if self.is_inverted {
            valid.iter_mut().for_each(|valid| *valid = !*valid);
        }
        Ok(Mask { width_px, height_px, valid })
    }
}

/// Which pixels of a mask are neither black nor transparent.
fn counted(image: &DynamicImage, is_lossy: bool) -> Vec<bool> {
    let has_alpha = image.color().has_alpha();
    // Values of 8 bit are times 257; dividing by it gives them back.
    let is_wide = image.color().bytes_per_pixel() / image.color().channel_count() > 1;
    let rgba = image.to_rgba16();
    let scaled = |value: u16| if is_wide { value } else { value / 257 };
    let pixels = || rgba.pixels().map(|pixel| pixel.0.map(scaled));
    let colour = |[r, g, b, _]: [u16; 4]| r.max(g).max(b);
    let alpha = |[_, _, _, alpha]: [u16; 4]| alpha;
    let most = |value: fn([u16; 4]) -> u16| pixels().map(value).max().unwrap_or(0);
    let least = |value: fn([u16; 4]) -> u16| pixels().map(value).min().unwrap_or(0);
    // A mask of 16 bit may hold values of 8.
    let full = if is_wide && most(colour).max(if has_alpha { most(alpha) } else { 0 }) > 255 { u16::MAX } else { 255 };
    let black = BLACK * (full / 255);
    let says_something = |most: u16, least: u16| most - least > if is_lossy { black } else { 0 };
    let has_colour = says_something(most(colour), least(colour));
    let has_alpha = has_alpha && most(alpha) != least(alpha);
    let value = |pixel: [u16; 4]| -> u32 {
        let (colour, alpha) = (u32::from(colour(pixel)), u32::from(alpha(pixel)));
        match (has_colour, has_alpha) {
            (_, false) => colour,
            (false, true) => alpha,
            (true, true) => colour * alpha / u32::from(full),
        }
    };
    let brightest = pixels().map(value).max().unwrap_or(0);
    let black = if !is_lossy && brightest <= u32::from(full / 2) { 0 } else { u32::from(black) };
    pixels().map(|pixel| value(pixel) > black).collect()
}

#[cfg(test)]
mod tests {
    use ::image::{ExtendedColorType, save_buffer};

    use super::*;

    /// Which of the pixels of a mask count, as `x` and `.`.
    fn shows(name: &str, bytes: &[u8], colour: ExtendedColorType, is_inverted: bool) -> String {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join(name);
        let n = bytes.len() * 8 / usize::from(colour.bits_per_pixel());
        save_buffer(&path, bytes, n as u32, 1, colour).expect("an image");
        let mask = MaskFile { path, is_inverted }.read().expect("a mask");
        mask.valid.iter().map(|valid| if *valid { 'x' } else { '.' }).collect()
    }

    #[test]
    fn black_and_transparent_pixels_do_not_count_in_any_mask() {
        use ExtendedColorType::{L8, L16, La8, Rgb8, Rgba8};
        let wide = |values: [u16; 4]| values.map(u16::to_ne_bytes).as_flattened().to_vec();
        for (what, bytes, colour, expected) in [
            ("white on black", vec![0, 255, 0, 255], L8, ".x.x"),
            ("nearly black", vec![15, 240, 3, 255], L8, ".x.x"),
            ("labels of 8 bit", vec![0, 1, 1, 0], L8, ".xx."),
            ("several labels", vec![0, 1, 2, 40], L8, ".xxx"),
            ("labels of 16 bit", wide([0, 1, 700, 12]), L16, ".xxx"),
            ("all black", vec![0, 0, 0, 0], L8, "...."),
            ("0 and 1 of 16 bit", wide([0, 1, 1, 0]), L16, ".xx."),
            ("0 and 255 of 16 bit", wide([0, 255, 255, 0]), L16, ".xx."),
            ("white of 16 bit", wide([0, 65535, 3000, 65535]), L16, ".x.x"),
            ("colours of labels", vec![0, 0, 0, 0, 0, 128, 128, 0, 0], Rgb8, ".xx"),
            ("alpha in white", [[255, 255, 255, 0], [255; 4]].concat(), Rgba8, ".x"),
            ("alpha in black", [[0, 0, 0, 0], [0, 0, 0, 255]].concat(), Rgba8, ".x"),
            ("both", [[255, 255, 255, 0], [0, 0, 0, 255], [255; 4]].concat(), Rgba8, "..x"),
            ("alpha that says nothing", [[0, 0, 0, 255], [255; 4]].concat(), Rgba8, ".x"),
            ("alpha of 0 everywhere", [[0, 0, 0, 0], [255, 255, 255, 0]].concat(), Rgba8, ".x"),
            ("alpha of labels", vec![0, 1, 1, 1], La8, ".x"),
            ("labels of alpha", vec![9, 0, 9, 1], La8, ".x"),
            ("nothing but white", vec![255; 4], L8, "xxxx"),
        ] {
            assert_eq!(shows("mask.png", &bytes, colour, false), expected, "{what}");
        }
        assert_eq!(shows("mask.png", &[0, 255, 9, 200], L8, true), "x.x.", "what is white moves");
    }

    #[test]
    fn black_of_a_jpeg_is_black() {
        let stripes: Vec<u8> = (0..64).map(|x| if x / 16 % 2 == 0 { 4 } else { 250 }).collect();
        let found = shows("mask.jpg", &stripes, ExtendedColorType::L8, false);
        assert_eq!(found, [".".repeat(16), "x".repeat(16)].concat().repeat(2));
        assert_eq!(shows("mask.jpg", &[6; 64], ExtendedColorType::L8, false), ".".repeat(64), "nothing is white in it");
    }
}
