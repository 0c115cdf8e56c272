//! Peak signal-to-noise ratio.

use super::assert_same_size;
use crate::dataset::Image;

/// PSNR of two 8-bit images: `10·log10(255² / MSE)` with one mean over all pixels and channels, dB.
///
/// Infinite for equal images. The sum of squares is in whole numbers, so the result does not depend on any order.
///
/// # Panics
/// When the sizes differ.
pub fn psnr_db(a: &Image, b: &Image) -> f64 {
    assert_same_size(a, b);
    let squares: u64 = a.rgb.iter().zip(&b.rgb).map(|(&x, &y)| u64::from(x.abs_diff(y)).pow(2)).sum();
    let mse = squares as f64 / a.rgb.len() as f64;
    10.0 * (255.0 * 255.0 / mse).log10()
}

/// PSNR of two images of values in [0, 1], clamped to it: `−10·log10(MSE)`, dB.
///
/// The figure before rounding to 8 bit; it exceeds [`psnr_db`] a little where the images are close.
///
/// * `a`, `b`: any layout, the same for both.
///
/// # Panics
/// When the lengths differ.
pub fn psnr_of_floats_db(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len(), "images to compare must have one size");
    let squares: f64 =
        a.iter().zip(b).map(|(&x, &y)| (f64::from(x.clamp(0.0, 1.0)) - f64::from(y.clamp(0.0, 1.0))).powi(2)).sum();
    -10.0 * (squares / a.len() as f64).log10()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(value: u8) -> Image {
        Image { width_px: 5, height_px: 4, rgb: vec![value; 60] }
    }

    #[test]
    fn a_constant_error_gives_its_closed_form() {
        let db = psnr_db(&flat(100), &flat(110));
        assert!((db - 20.0 * (255.0_f64 / 10.0).log10()).abs() < 1e-12, "{db}");
        let floats = psnr_of_floats_db(&[0.5; 9], &[0.25; 9]);
        assert!((floats - 20.0 * 4.0_f64.log10()).abs() < 1e-12, "{floats}");
    }

    #[test]
    fn equal_images_are_infinitely_close_and_order_does_not_matter() {
        assert_eq!(psnr_db(&flat(3), &flat(3)), f64::INFINITY);
        assert_eq!(psnr_db(&flat(3), &flat(9)), psnr_db(&flat(9), &flat(3)));
    }

    #[test]
    fn floats_are_clamped_before_they_are_compared() {
        assert_eq!(psnr_of_floats_db(&[1.5, -1.0], &[1.0, 0.0]), f64::INFINITY);
    }
}
