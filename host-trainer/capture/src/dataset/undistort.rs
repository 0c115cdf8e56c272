//! Resampling a photograph as a pinhole camera would have taken it.

use super::lens::Lens;
use super::{Image, Mask};

/// The photograph as a pinhole camera with the lens's focal lengths and principal point shows it, at the same size.
///
/// Each pixel's centre goes through the lens and the photograph is read there, bilinearly between pixel centres with
/// border values held. Pixels whose source lies outside the photograph, beyond the fold of the distortion, or on a
/// pixel that does not count in `counted` do not count in the mask; it is `None` where all count.
///
/// Work: about 60 operations per pixel.
///
/// # Panics
/// When the image is not of the lens's size.
pub(super) fn undistorted(image: &Image, counted: Option<&Mask>, lens: &Lens) -> (Image, Option<Mask>) {
    assert_eq!((image.width_px, image.height_px), lens.size_px, "the lens must be that of the image");
    let (width_px, height_px) = lens.size_px;
    let (width, height) = (f64::from(width_px), f64::from(height_px));
    let fold_squared = lens.fold_squared(lens.corner_squared());
    let n = width_px as usize * height_px as usize;
    let (mut rgb, mut valid) = (Vec::with_capacity(n * 3), Vec::with_capacity(n));
    for y in 0..height_px {
        for x in 0..width_px {
            let direction = lens.direction([f64::from(x) + 0.5, f64::from(y) + 0.5]);
            let [u, v] = lens.pixel(lens.distorted(direction));
            let inside = (0.0..=width).contains(&u) && (0.0..=height).contains(&v);
            let unfolded = direction[0] * direction[0] + direction[1] * direction[1] < fold_squared;
            let taps = Taps::around(u, v, width_px, height_px);
            let shown = counted.is_none_or(|mask| taps.0.iter().all(|&(i, w)| w == 0.0 || mask.valid[i]));
            valid.push(inside && unfolded && shown);
            rgb.extend((0..3).map(|c| {
                let value: f64 = taps.0.iter().map(|&(i, weight)| weight * f64::from(image.rgb[i * 3 + c])).sum();
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a weighted mean of bytes is a byte"
                )]
                let byte = (value + 0.5) as u8;
                byte
            }));
        }
    }
    let mask = valid.contains(&false).then_some(Mask { width_px, height_px, valid });
    (Image { width_px, height_px, rgb }, mask)
}

/// Index and weight of the four pixels around a position; weights sum to 1.
struct Taps([(usize, f64); 4]);

impl Taps {
    fn around(u_px: f64, v_px: f64, width_px: u32, height_px: u32) -> Self {
        let (x0, x1, fx) = between(u_px, width_px);
        let (y0, y1, fy) = between(v_px, height_px);
        let width = width_px as usize;
        Self([
            (y0 * width + x0, (1.0 - fx) * (1.0 - fy)),
            (y0 * width + x1, fx * (1.0 - fy)),
            (y1 * width + x0, (1.0 - fx) * fy),
            (y1 * width + x1, fx * fy),
        ])
    }
}

/// The two of `n` pixels whose centres enclose a position, and how far it is from the first to the second.
fn between(position_px: f64, n: u32) -> (usize, usize, f64) {
    let last = f64::from(n - 1);
    let held = (position_px - 0.5).clamp(0.0, last);
    let floor = held.floor();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0..n")]
    let (first, second) = (floor as usize, (floor + 1.0).min(last) as usize);
    (first, second, held - floor)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::lens::Projection;

    /// A smooth picture over directions, 0 to 255.
    fn picture([x, y]: [f64; 2]) -> [f64; 3] {
        [127.0 + 100.0 * (7.0 * x).sin(), 127.0 + 100.0 * (6.0 * y + x).cos(), 127.0 + 100.0 * (5.0 * x * y).sin()]
    }

    fn image(lens: &Lens, mut direction_at: impl FnMut([f64; 2]) -> [f64; 2]) -> Image {
        let (width_px, height_px) = lens.size_px;
        let pixels = (0..height_px).flat_map(|y| (0..width_px).map(move |x| [f64::from(x) + 0.5, f64::from(y) + 0.5]));
        let rgb = pixels.flat_map(|at| picture(direction_at(at)).map(|v| (v + 0.5) as u8)).collect();
        Image { width_px, height_px, rgb }
    }

    /// The direction the lens sends to a pixel position, by fixed-point iteration.
    fn seen_at(lens: &Lens, at: [f64; 2]) -> [f64; 2] {
        let target = lens.direction(at);
        (0..200).fold(target, |guess, _| {
            let [x, y] = lens.distorted(guess);
            [guess[0] + target[0] - x, guess[1] + target[1] - y]
        })
    }

    fn lens(k1: f64) -> Lens {
        Lens {
            size_px: (120, 90),
            focal_px: [100.0, 104.0],
            principal_px: [57.0, 46.5],
            radial: [k1, 0.05, 0.0, 0.0],
            tangential: [0.003, -0.002],
            ..Lens::central((120, 90), [100.0; 2])
        }
    }

    #[test]
    fn a_photograph_through_the_lens_becomes_the_pinhole_picture() {
        for k1 in [-0.25, 0.2] {
            let lens = lens(k1);
            let taken = image(&lens, |at| seen_at(&lens, at));
            let expected = image(&lens, |at| lens.direction(at));
            let (found, mask) = undistorted(&taken, None, &lens);
            let valid = mask.as_ref().map_or_else(|| vec![true; 120 * 90], |mask| mask.valid.clone());
            // Only pincushion distortion (k1 > 0) needs more than the photograph shows.
            assert_eq!(mask.is_some(), k1 > 0.0, "k1 = {k1}");
            assert!(valid.iter().filter(|&&valid| valid).count() > 120 * 90 * 8 / 10, "k1 = {k1}");
            for (i, _) in valid.iter().enumerate().filter(|(_, valid)| **valid) {
                for c in 0..3 {
                    // Bilinear reading of a 100·sin(7x) at 0.01 per pixel errs by 0.06; rounding twice by 1; held
                    // borders by up to half a pixel's 3.5.
                    let miss = found.rgb[i * 3 + c].abs_diff(expected.rgb[i * 3 + c]);
                    assert!(miss <= 5, "k1 = {k1}, pixel {i}: {miss}");
                }
            }
            let mean: f64 = found
                .rgb
                .iter()
                .zip(&expected.rgb)
                .zip(valid.iter().flat_map(|v| [*v; 3]))
                .filter(|(_, valid)| *valid)
                .map(|((a, b), _)| f64::from(a.abs_diff(*b)))
                .sum::<f64>()
                / 32_400.0;
            assert!(mean < 0.5, "k1 = {k1}: mean error {mean}");
        }
    }

    #[test]
    fn a_fisheye_and_a_rational_lens_become_the_pinhole_picture() {
        let fisheye = Lens {
            focal_px: [50.0, 52.0],
            projection: Projection::Fisheye,
            radial: [0.02, -0.01, 0.002, 0.0],
            tangential: [0.0; 2],
            ..lens(0.0)
        };
        let rational = Lens { radial: [0.4, 0.1, 0.02, 0.0], divisor: [0.55, 0.06, 0.01], ..lens(0.0) };
        for (lens, most_mean) in [(fisheye, 2.0), (rational, 0.5)] {
            let taken = image(&lens, |at| seen_at(&lens, at));
            let expected = image(&lens, |at| lens.direction(at));
            let (found, mask) = undistorted(&taken, None, &lens);
            assert_eq!(mask, None, "both show more than the pinhole needs");
            let (sum, most) =
                found.rgb.iter().zip(&expected.rgb).fold((0_u64, 0), |(sum, most), (a, b)| {
                    (sum + u64::from(a.abs_diff(*b)), most.max(a.abs_diff(*b)))
                });
            // The corners of the fisheye's picture are enlarged four times: bilinear reading errs more there.
            let mean = sum as f64 / found.rgb.len() as f64;
            assert!(mean < most_mean && most < 40, "{:?}: mean {mean}, most {most}", lens.projection);
        }
    }

    #[test]
    fn without_distortion_nothing_changes() {
        let lens = Lens { radial: [0.0; 4], tangential: [0.0; 2], ..lens(0.0) };
        let taken = image(&lens, |at| lens.direction(at));
        let (found, mask) = undistorted(&taken, None, &lens);
        assert_eq!(mask, None);
        assert!(found.rgb.iter().zip(&taken.rgb).all(|(a, b)| a.abs_diff(*b) <= 1), "rounding of the positions");
    }

    #[test]
    fn pixels_that_do_not_count_are_not_read() {
        let lens = lens(-0.25);
        let taken = image(&lens, |at| seen_at(&lens, at));
        let mut counted = Mask { width_px: 120, height_px: 90, valid: vec![true; 120 * 90] };
        counted.valid[46 * 120 + 57] = false;
        let mask = undistorted(&taken, Some(&counted), &lens).1.expect("one pixel does not count");
        let n_lost = mask.valid.len() - mask.n_valid();
        assert!((1..=9).contains(&n_lost) && !mask.valid[46 * 120 + 57], "{n_lost}");
    }

    #[test]
    fn what_the_fold_shows_twice_does_not_count() {
        let lens = Lens { radial: [-1.2, 0.0, 0.0, 0.0], tangential: [0.0; 2], ..lens(0.0) };
        let taken = image(&lens, |at| lens.direction(at));
        let mask = undistorted(&taken, None, &lens).1.expect("corners lie beyond the fold");
        // 1 − 3.6·r² = 0 at r = 0.527, the corner at (0.57, 0.447) and the middle of the lower border at 0.418.
        assert!(!mask.valid[0] && mask.valid[89 * 120 + 57]);
    }
}
