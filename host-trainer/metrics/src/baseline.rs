//! The image a model must beat to have learnt any fine detail.

use pocketsplat_capture::dataset::Image;

/// The image at half its size and enlarged again: what remains of it without its fine detail.
///
/// Reduced by area to ⌈w/2⌉ × ⌈h/2⌉, rounded to 8 bit, then enlarged bilinearly between pixel centres, border values
/// held. A model whose PSNR is below this image's has learnt less than a copy of the truth at half the resolution holds.
pub fn half_size_enlarged(image: &Image) -> Image {
    let (width_px, height_px) = (image.width_px, image.height_px);
    let half = image.area_resized(width_px.div_ceil(2), height_px.div_ceil(2));
    let columns = neighbours(half.width_px, width_px);
    let rows = neighbours(half.height_px, height_px);
    let at = |x: usize, y: usize, c: usize| f64::from(half.rgb[(y * half.width_px as usize + x) * 3 + c]);
    let mut rgb = Vec::with_capacity(image.rgb.len());
    for &(y0, y1, fy) in &rows {
        for &(x0, x1, fx) in &columns {
            for c in 0..3 {
                let upper = at(x0, y0, c) * (1.0 - fx) + at(x1, y0, c) * fx;
                let lower = at(x0, y1, c) * (1.0 - fx) + at(x1, y1, c) * fx;
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a mean of bytes is a byte"
                )]
                rgb.push((upper * (1.0 - fy) + lower * fy + 0.5) as u8);
            }
        }
    }
    Image { width_px, height_px, rgb }
}

/// For each of `n_target` pixels of a line the two pixels of a line of `n_source` around its centre, and the second
/// one's weight.
fn neighbours(n_source: u32, n_target: u32) -> Vec<(usize, usize, f64)> {
    let last = f64::from(n_source - 1);
    (0..n_target)
        .map(|i| {
            let centre = (f64::from(i) + 0.5) * f64::from(n_source) / f64::from(n_target) - 0.5;
            let held = centre.clamp(0.0, last);
            let floor = held.floor();
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0..n_source")]
            let (first, second) = (floor as usize, (floor + 1.0).min(last) as usize);
            (first, second, held - floor)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use pocketsplat_capture::dataset::{Background, LoadOptions, View, load};
    use pocketsplat_capture::synth::{SynthOptions, write_capture};

    use super::*;
    use crate::{psnr_db, ssim};

    #[test]
    fn flat_images_pass_unchanged_at_odd_and_even_sizes() {
        for (w, h) in [(1, 1), (6, 4), (7, 5)] {
            let flat = Image { width_px: w, height_px: h, rgb: vec![77; (w * h * 3) as usize] };
            assert_eq!(half_size_enlarged(&flat), flat);
        }
    }

    #[test]
    fn stripes_of_one_pixel_vanish() {
        let rgb = (0..64).flat_map(|i| [if i % 2 == 0 { 0 } else { 200 }; 3]).collect();
        let stripes = Image { width_px: 8, height_px: 8, rgb };
        assert!(half_size_enlarged(&stripes).rgb.iter().all(|&v| v == 100));
    }

    #[test]
    fn an_edge_turns_into_a_ramp_centred_on_it() {
        let rgb = [0_u8, 0, 200, 200].iter().flat_map(|&v| [v; 3]).collect();
        let edge = Image { width_px: 4, height_px: 1, rgb };
        let row: Vec<u8> = half_size_enlarged(&edge).rgb.iter().step_by(3).copied().collect();
        assert_eq!(row, [0, 50, 150, 200]);
    }

    #[test]
    fn half_the_resolution_loses_the_fine_detail_of_the_procedural_capture() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        write_capture(dir.path(), &SynthOptions { n_train: 3, ..SynthOptions::default() }).expect("a capture");
        let load_options = LoadOptions { background: Background::Black, ..LoadOptions::default() };
        let (capture, _) = load(dir.path(), &load_options).expect("it loads");
        let n_test = capture.test.len() as f64;
        let figure = |of: fn(&Image, &Image) -> f64| {
            let of_view = |view: &View| {
                let image = &view.photograph().expect("in memory").image;
                of(image, &half_size_enlarged(image))
            };
            capture.test.iter().map(of_view).sum::<f64>() / n_test
        };
        let (psnr, similarity) = (figure(psnr_db), figure(ssim));
        eprintln!("half-size copies: PSNR {psnr:.2} dB, SSIM {similarity:.4}");
        // A model that has learnt the fine detail reaches 30 dB; one that has not must not come near.
        assert!((25.5..27.0).contains(&psnr), "half-size copies score {psnr:.2} dB");
    }
}
