//! Where a photograph can be told apart: its corners, spread evenly.

use super::picture::Level;

/// About so many cells a photograph is divided into, each of which gives its best corner.
const CELLS: f64 = 1500.0;
/// The smaller eigenvalue of the structure tensor, mean over its window, that a corner has at least: a gradient of 2 of 255 a pixel.
const LEAST_EIGENVALUE: f32 = 4.0;
/// The structure tensor is summed over so many pixels on either side.
const WINDOW: usize = 2;

/// The best corner of each cell (Shi and Tomasi 1994: the smaller eigenvalue of the structure tensor), the position of its pixel's centre.
pub(super) fn corners(level: &Level) -> Vec<[f64; 2]> {
    let (width, height) = (level.width_px, level.height_px);
    let border = WINDOW + 1;
    if width <= 2 * border || height <= 2 * border {
        return Vec::new();
    }
    let strength = strengths(level);
    let side = ((width * height) as f64 / CELLS).sqrt().max(1.0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part of an image's side")]
    let columns = (width as f64 / side).ceil() as usize;
    let cell = |x: usize, y: usize| (y as f64 / side).floor() as usize * columns + (x as f64 / side).floor() as usize;
    let mut best = vec![(LEAST_EIGENVALUE, None); cell(width - 1, height - 1) + 1];
    for y in border..height - border {
        for x in border..width - border {
            let best = &mut best[cell(x, y)];
            let own = strength[y * width + x];
            if own > best.0 {
                *best = (own, Some([x as f64 + 0.5, y as f64 + 0.5]));
            }
        }
    }
    best.into_iter().filter_map(|(_, corner)| corner).collect()
}

/// The smaller eigenvalue of the structure tensor at every pixel; 0 at the border and beside pixels that do not count.
fn strengths(level: &Level) -> Vec<f32> {
    let (width, height) = (level.width_px, level.height_px);
    let mut products = vec![[0.0_f32; 3]; width * height];
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let i = y * width + x;
            let four = [i - 1, i + 1, i - width, i + width].map(|i| level.grey[i]);
            if !four.contains(&0) {
                let [left, right, above, below] = four.map(f32::from);
                let (dx, dy) = (0.5 * (right - left), 0.5 * (below - above));
                products[i] = [dx * dx, dx * dy, dy * dy];
            }
        }
    }
    // Sums along rows, then along columns.
    let summed = |values: &[[f32; 3]], stride: usize| {
        let mut sums = vec![[0.0_f32; 3]; values.len()];
        for i in WINDOW * stride..values.len().saturating_sub(WINDOW * stride) {
            let window = (0..=2 * WINDOW).map(|k| values[i + k * stride - WINDOW * stride]);
            sums[i] = window.fold([0.0; 3], |[a, b, c], [x, y, z]| [a + x, b + y, c + z]);
        }
        sums
    };
    let n = ((2 * WINDOW + 1) * (2 * WINDOW + 1)) as f32;
    let tensors = summed(&summed(&products, 1), width);
    let smaller = |[xx, xy, yy]: [f32; 3]| (0.5 * (xx + yy) - (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt()) / n;
    tensors.into_iter().map(smaller).collect()
}
