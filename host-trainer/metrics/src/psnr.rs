//! Peak signal-to-noise ratio.

use super::{assert_mask_fits, assert_same_size};
use pocketsplat_capture::dataset::{Image, Mask};

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

/// [`psnr_db`] of a view, over the pixels that count: the mean squared error of these alone, dB.
///
/// Without a mask all count. Where no pixel counts the result is NaN: there is nothing to compare. A view without any error counts as
/// one in which a single value is off by one level, so that a mean over views is a number: 111 dB at 800×800 pixels.
///
/// # Panics
/// When the sizes differ.
pub fn psnr_db_masked(a: &Image, b: &Image, mask: Option<&Mask>) -> f64 {
    let of = |squares: u64, n: usize| 10.0 * (255.0 * 255.0 * n as f64 / squares.max(1) as f64).log10();
    let Some(mask) = mask else { return psnr_db(a, b).min(of(1, a.rgb.len())) };
    assert_same_size(a, b);
    assert_mask_fits(a, mask);
    let pixels = a.rgb.chunks_exact(3).zip(b.rgb.chunks_exact(3)).zip(&mask.valid);
    let counted = pixels.filter(|(_, valid)| **valid).flat_map(|((a, b), _)| a.iter().zip(b));
    let squares: u64 = counted.map(|(&x, &y)| u64::from(x.abs_diff(y)).pow(2)).sum();
    if mask.n_valid() == 0 { f64::NAN } else { of(squares, 3 * mask.n_valid()) }
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
    }

    #[test]
    fn equal_images_are_infinitely_close_and_order_does_not_matter() {
        assert_eq!(psnr_db(&flat(3), &flat(3)), f64::INFINITY);
        assert_eq!(psnr_db(&flat(3), &flat(9)), psnr_db(&flat(9), &flat(3)));
    }

    #[test]
    fn only_pixels_that_count_enter_the_mean() {
        let (a, mut b) = (flat(100), flat(110));
        let mut mask = Mask { width_px: 5, height_px: 4, valid: vec![true; 20] };
        b.rgb[..3].fill(255);
        mask.valid[0] = false;
        assert!((psnr_db_masked(&a, &b, Some(&mask)) - psnr_db(&flat(100), &flat(110))).abs() < 1e-12);
        assert_eq!(psnr_db_masked(&a, &b, None), psnr_db(&a, &b));
        let no_error = |mask| psnr_db_masked(&a, &a, mask);
        assert!((no_error(None) - 10.0 * (255.0_f64 * 255.0 * 60.0).log10()).abs() < 1e-12, "{}", no_error(None));
        assert!(no_error(Some(&mask)) < no_error(None), "fewer values");
        mask.valid.fill(false);
        assert!(psnr_db_masked(&a, &b, Some(&mask)).is_nan());
    }
}
