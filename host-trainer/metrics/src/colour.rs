//! Colours brought to a photograph's before both are compared.

use std::array::from_fn;

use super::{assert_mask_fits, assert_same_size};
use pocketsplat_capture::dataset::{Image, Mask};

/// Red, green, blue and 1.
const N: usize = 4;
/// Weight of a map that changes nothing, levels² a pixel: decides where an image has too few colours to say.
const STEADINESS: f64 = 1e-3;

/// `image` under the affine map of colours, 3 × 4, that brings it closest to `truth` in the least squares of the pixels that count.
///
/// The PSNR of it is the field's "cc": exposure and white balance of the one photograph do not count, everything else does.
///
/// # Panics
/// When the sizes differ.
pub fn colour_corrected(image: &Image, truth: &Image, mask: Option<&Mask>) -> Image {
    assert_same_size(image, truth);
    if let Some(mask) = mask {
        assert_mask_fits(image, mask);
    }
    let counts = |i: usize| mask.is_none_or(|mask| mask.valid[i]);
    // Whole numbers, so that no order matters.
    let (mut products, mut differences) = ([[0_i64; N]; N], [[0_i64; 3]; N]);
    let pixels = image.rgb.chunks_exact(3).zip(truth.rgb.chunks_exact(3)).enumerate();
    for (_, (drawn, truth)) in pixels.filter(|(i, _)| counts(*i)) {
        let x: [i64; N] = from_fn(|c| drawn.get(c).map_or(1, |value| i64::from(*value)));
        for (row, (products, differences)) in products.iter_mut().zip(&mut differences).enumerate() {
            products.iter_mut().zip(x).for_each(|(sum, value)| *sum += x[row] * value);
            differences.iter_mut().enumerate().for_each(|(c, sum)| *sum += x[row] * (i64::from(truth[c]) - x[c]));
        }
    }
    let n = products[N - 1][N - 1] as f64;
    let normal = from_fn(|i| from_fn(|j| products[i][j] as f64 + if i == j { STEADINESS * n + 1e-9 } else { 0.0 }));
    let change = solved(normal, differences.map(|row| row.map(|sum| sum as f64)));
    let corrected = |drawn: &[u8]| -> [u8; 3] {
        let x: [f64; N] = from_fn(|c| drawn.get(c).map_or(1.0, |value| f64::from(*value)));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0..=255")]
        from_fn(|c| (x[c] + (0..N).map(|i| x[i] * change[i][c]).sum::<f64>()).round().clamp(0.0, 255.0) as u8)
    };
    Image { rgb: image.rgb.chunks_exact(3).flat_map(corrected).collect(), ..*image }
}

/// X of A·X = B, A symmetric and positive definite: elimination without exchanges.
fn solved(mut a: [[f64; N]; N], mut b: [[f64; 3]; N]) -> [[f64; 3]; N] {
    for pivot in 0..N {
        for row in (0..N).filter(|row| *row != pivot) {
            let factor = a[row][pivot] / a[pivot][pivot];
            let (of_a, of_b) = (a[pivot], b[pivot]);
            a[row].iter_mut().zip(of_a).for_each(|(value, above)| *value -= factor * above);
            b[row].iter_mut().zip(of_b).for_each(|(value, above)| *value -= factor * above);
        }
    }
    from_fn(|i| b[i].map(|value| value / a[i][i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::psnr_db_masked;

    fn coloured(of: impl Fn(u32) -> [f64; 3]) -> Image {
        let byte = |value: f64| value.round().clamp(0.0, 255.0) as u8;
        Image { width_px: 40, height_px: 30, rgb: (0..1200).flat_map(|i| of(i).map(byte)).collect() }
    }

    fn drawn(i: u32) -> [f64; 3] {
        [i % 97, (7 * i) % 120, (13 * i) % 89].map(f64::from)
    }

    #[test]
    fn an_affine_change_of_colours_does_not_count_and_another_does() {
        let image = coloured(drawn);
        let truth = coloured(|i| {
            let [r, g, b] = drawn(i);
            [1.3 * r + 0.2 * g + 10.0, 0.8 * g + 0.1 * b + 25.0, 1.1 * b + 5.0]
        });
        let before = psnr_db_masked(&image, &truth, None);
        let after = psnr_db_masked(&colour_corrected(&image, &truth, None), &truth, None);
        assert!(before < 21.0 && after > 55.0, "{before} → {after} dB, rounding alone is left");
        // A gradient from left to right is no change of colours.
        let shaded = coloured(|i| drawn(i).map(|value| value + f64::from(i % 40)));
        assert!(psnr_db_masked(&colour_corrected(&image, &shaded, None), &shaded, None) < 33.0);
    }

    #[test]
    fn never_worse_than_it_was_and_pixels_that_do_not_count_have_no_say() {
        let image = coloured(drawn);
        let mut truth = coloured(|i| drawn(i).map(|value| 2.0 * value));
        let mut mask = Mask { width_px: 40, height_px: 30, valid: vec![true; 1200] };
        truth.rgb[..300].fill(0);
        mask.valid[..100].fill(false);
        let corrected = colour_corrected(&image, &truth, Some(&mask));
        assert!(psnr_db_masked(&corrected, &truth, Some(&mask)) > 55.0);
        let flat = coloured(|_| [50.0; 3]);
        assert_eq!(colour_corrected(&flat, &flat, None), flat);
        assert_eq!(colour_corrected(&flat, &coloured(|_| [80.0, 50.0, 10.0]), None).rgb[..3], [80, 50, 10]);
        mask.valid.fill(false);
        assert_eq!(colour_corrected(&image, &truth, Some(&mask)), image, "nothing to say");
    }
}
