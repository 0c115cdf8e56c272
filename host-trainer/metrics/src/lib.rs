//! How close an image is to the truth.
//!
//! All figures are of one image; those of a scene are means over its views. The truth is 8-bit, so the figures to
//! report are of 8-bit images, as they are published for this family.

mod baseline;
mod bjontegaard;
mod colour;
mod lpips;
mod pchip;
mod psnr;
mod seeds;
mod ssim;

pub use baseline::half_size_enlarged;
pub use bjontegaard::{BjontegaardError, RatePoint, bd_psnr_db, bd_rate_percent};
pub use colour::colour_corrected;
pub use lpips::{InputRange, Lpips, LpipsError};
pub use psnr::{psnr_db, psnr_db_masked};
pub use seeds::{SeededDifference, bd_rate_over_seeds};
pub use ssim::{ssim, ssim_masked};

use std::borrow::Cow;

use pocketsplat_capture::dataset::{Image, Mask};

/// Stops where two images do not have the same size: there is no figure to give.
#[track_caller]
fn assert_same_size(a: &Image, b: &Image) {
    let (size_a, size_b) = ((a.width_px, a.height_px), (b.width_px, b.height_px));
    assert_eq!(size_a, size_b, "images to compare must have one size (width, height)");
}

/// Stops where a mask is not of the image's size: it is another image's.
#[track_caller]
fn assert_mask_fits(image: &Image, mask: &Mask) {
    let (image_px, mask_px) = ((image.width_px, image.height_px), (mask.width_px, mask.height_px));
    assert_eq!(image_px, mask_px, "a mask must have the image's size (width, height)");
}

/// `drawn` with `truth` where a pixel does not count, so that a window over such pixels sees no difference there.
#[track_caller]
fn with_truth_where_masked<'a>(drawn: &'a Image, truth: &Image, mask: Option<&Mask>) -> Cow<'a, Image> {
    let Some(mask) = mask else { return Cow::Borrowed(drawn) };
    assert_same_size(drawn, truth);
    assert_mask_fits(drawn, mask);
    let mut filled = drawn.clone();
    for ((pixel, truth), &valid) in filled.rgb.chunks_exact_mut(3).zip(truth.rgb.chunks_exact(3)).zip(&mask.valid) {
        if !valid {
            pixel.copy_from_slice(truth);
        }
    }
    Cow::Owned(filled)
}
