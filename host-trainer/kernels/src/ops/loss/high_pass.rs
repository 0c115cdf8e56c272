//! The difference of two images in what a blur takes away.

use rayon::prelude::*;

use super::blur::{blur, window};
use crate::ops::simd::Level;
use crate::real::Real;

/// Rows that one task blurs.
const ROWS: usize = 32;

/// HP(x) = x − blur(x) of planes `[3, height, width]`, with the window of [`blur`](mod@super::blur).
///
/// The window is symmetric and the border zero, so HP is its own transpose.
fn high_pass<R: Real>(level: Level, planes: &[R], size_px: [usize; 2]) -> Vec<R> {
    let [width, height] = size_px;
    let window = window::<R>();
    let mut out = planes.to_vec();
    let tasks = out.par_chunks_mut(width * height).zip(planes.par_chunks(width * height));
    tasks.for_each(|(out, plane)| {
        out.par_chunks_mut(ROWS * width).enumerate().for_each(|(block, out)| {
            level.run(
                #[inline(always)]
                || {
                    let fill = |_: usize, y: usize, line: &mut [R]| {
                        line.copy_from_slice(&plane[y * width..(y + 1) * width]);
                    };
                    let [blurred] = blur(&window, size_px, block * ROWS, out.len() / width, fill);
                    for (value, low) in out.iter_mut().zip(blurred) {
                        *value -= low;
                    }
                },
            );
        });
    });
    out
}

/// `weight · mean(HP(image − truth)²)`, and its gradient 2·weight/n·HP(HP(image − truth)), added to `d_image`.
///
/// * `image`, `truth`: planes `[3, height, width]`. Cost: two blurs.
pub fn forward_backward<R: Real>(
    level: Level,
    image: &[R],
    truth: &[R],
    size_px: [usize; 2],
    weight: R,
    d_image: &mut [R],
) -> R {
    let difference: Vec<R> = image.iter().zip(truth).map(|(x, y)| *x - *y).collect();
    let high = high_pass(level, &difference, size_px);
    let share = weight / R::real(high.len().max(1) as f64);
    // Rows first: a sum of thousands of small numbers loses bits.
    let sum: R = high.chunks(size_px[0].max(1)).map(|row| row.iter().map(|h| *h * *h).sum::<R>()).sum();
    for (d, h) in d_image.iter_mut().zip(high_pass(level, &high, size_px)) {
        *d += (share + share) * h;
    }
    share * sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_gradient, random};

    #[test]
    fn backward_agrees_with_finite_differences() {
        for (seed, size) in [(1, [13, 7]), (2, [1, 1]), (3, [3, ROWS + 6])] {
            let n = 3 * size[0] * size[1];
            let (x, truth) = (random(seed, n), random(seed + 10, n));
            let mut d = vec![0.0; n];
            forward_backward(Level::detect(), &x, &truth, size, 0.3, &mut d);
            assert_gradient("high pass", &x, &d, |x| {
                forward_backward(Level::detect(), x, &truth, size, 0.3, &mut vec![0.0; n])
            });
        }
    }

    #[test]
    fn a_smooth_difference_weighs_less_than_a_rough_one() {
        let size = [48, 48];
        let n = size[0] * size[1];
        let truth = vec![0.0f64; 3 * n];
        let smooth: Vec<f64> = (0..3 * n).map(|i| ((i % size[0]) as f64 / 10.0).sin()).collect();
        let rough: Vec<f64> = (0..3 * n).map(|i| if i % 2 == 0 { 0.7 } else { -0.7 }).collect();
        let term = |x: &[f64]| forward_backward(Level::detect(), x, &truth, size, 1.0, &mut vec![0.0; 3 * n]);
        assert!(term(&rough) > 10.0 * term(&smooth), "{} and {}", term(&rough), term(&smooth));
    }
}
