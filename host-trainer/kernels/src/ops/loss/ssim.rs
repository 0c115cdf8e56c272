//! Structural similarity of two images, and its gradient.
//!
//! Per pixel and channel S = (2μₓμᵧ + C₁)(2σₓᵧ + C₂)/((μₓ² + μᵧ² + C₁)(σₓ² + σᵧ² + C₂)), moments under an 11×11 Gaussian
//! window of σ 1.5 with zero padding, C₁ = 0.01², C₂ = 0.03² (Wang et al. 2004, eq. 13; window and padding as the
//! splatting literature has them). The value is the mean over pixels and channels.

use rayon::prelude::*;

use super::blur::{blur, window};
use crate::ops::simd::Level;
use crate::real::Real;

const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Rows blurred together by one task.
const ROWS: usize = 32;

/// Derivatives of the mean of S by the moments of x, which [`backward`] blurs back.
#[derive(Clone, Debug)]
pub struct Partials<R> {
    /// `[3, height, width, 3]` as rows: ∂/∂μₓ, ∂/∂E\[x² + y²\], ∂/∂E\[xy\], per block of rows and channel.
    blocks: Vec<[Vec<R>; 3]>,
    blocks_per_channel: usize,
}

/// Mean SSIM of `image` and `truth`, planes `[3, height, width]`, and what backward needs.
pub fn forward<R: Real>(level: Level, image: &[R], truth: &[R], size_px: [usize; 2]) -> (R, Partials<R>) {
    let [width, height] = size_px;
    let plane = width * height;
    let blocks_per_channel = height.div_ceil(ROWS);
    let window = window::<R>();
    let norm = R::ONE / R::real((3 * plane) as f64);
    let (sums, blocks): (Vec<R>, Vec<[Vec<R>; 3]>) = (0..3 * blocks_per_channel)
        .into_par_iter()
        .map(|i| {
            let (channel, y0) = (i / blocks_per_channel, i % blocks_per_channel * ROWS);
            let x = &image[channel * plane..(channel + 1) * plane];
            let y = &truth[channel * plane..(channel + 1) * plane];
            level.run(
                #[inline(always)]
                || {
                    let fill = |n: usize, row: usize, line: &mut [R]| {
                        let (x, y) = (&x[row * width..(row + 1) * width], &y[row * width..(row + 1) * width]);
                        for i in 0..width {
                            line[i] = match n {
                                0 => x[i],
                                1 => y[i],
                                2 => x[i] * x[i] + y[i] * y[i],
                                _ => x[i] * y[i],
                            };
                        }
                    };
                    let moments = blur(&window, size_px, y0, ROWS.min(height - y0), fill);
                    similarity(moments, norm)
                },
            )
        })
        .unzip();
    (sums.into_iter().sum::<R>() * norm, Partials { blocks, blocks_per_channel })
}

/// Sum of S over one block, and its scaled derivatives by μₓ, E\[x² + y²\], E\[xy\].
///
/// * `moments`: μₓ, μᵧ, E\[x² + y²\], E\[xy\]: the variances enter as their sum alone.
#[inline(always)]
fn similarity<R: Real>(moments: [Vec<R>; 4], norm: R) -> (R, [Vec<R>; 3]) {
    let [mut mean_x, mean_y, mut squares, mut xy] = moments;
    let two = R::real(2.0);
    let mut sum = R::ZERO;
    let n = mean_x.len();
    let mean_y = &mean_y[..n];
    let mut values = vec![R::ZERO; n];
    for i in 0..n {
        let (mx, my) = (mean_x[i], mean_y[i]);
        let a1 = two * mx * my + R::real(C1);
        let a2 = two * (xy[i] - mx * my) + R::real(C2);
        let b1 = mx * mx + my * my + R::real(C1);
        let b2 = squares[i] - (mx * mx + my * my) + R::real(C2);
        let inverse = R::ONE / (b1 * b2);
        let s = a1 * a2 * inverse;
        values[i] = s;
        let d_squares = -s / b2;
        let d_xy = two * a1 * inverse;
        let d_mx = two * my * a2 * inverse - two * mx * s / b1 - two * mx * d_squares - my * d_xy;
        mean_x[i] = d_mx * norm;
        squares[i] = d_squares * norm;
        xy[i] = d_xy * norm;
    }
    for v in values {
        sum += v;
    }
    (sum, [mean_x, squares, xy])
}

/// Adds `weight · ∂(mean S)/∂image` to `d_image`.
pub fn backward<R: Real>(
    level: Level,
    image: &[R],
    truth: &[R],
    size_px: [usize; 2],
    partials: &Partials<R>,
    weight: R,
    d_image: &mut [R],
) {
    let [width, height] = size_px;
    let plane = width * height;
    let per_channel = partials.blocks_per_channel;
    let window = window::<R>();
    let two = R::real(2.0);
    d_image.par_chunks_mut(plane).enumerate().for_each(|(channel, d_plane)| {
        let x = &image[channel * plane..(channel + 1) * plane];
        let y = &truth[channel * plane..(channel + 1) * plane];
        let blocks = &partials.blocks[channel * per_channel..(channel + 1) * per_channel];
        d_plane.par_chunks_mut(ROWS * width).enumerate().for_each(|(block, d)| {
            level.run(
                #[inline(always)]
                || {
                    let rows = d.len() / width;
                    let fill = |n: usize, row: usize, line: &mut [R]| {
                        let at = row % ROWS * width;
                        line.copy_from_slice(&blocks[row / ROWS][n][at..at + width]);
                    };
                    let [by_mean, by_xx, by_xy] = blur(&window, size_px, block * ROWS, rows, fill);
                    let start = block * ROWS * width;
                    for (i, d) in d.iter_mut().enumerate() {
                        let at = start + i;
                        *d += weight * (by_mean[i] + two * x[at] * by_xx[i] + y[at] * by_xy[i]);
                    }
                },
            );
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_gradient, random};

    fn image(seed: u64, size: [usize; 2]) -> Vec<f64> {
        random(seed, 3 * size[0] * size[1]).iter().map(|v| 0.5 + 0.5 * v).collect()
    }

    /// The sum over the whole 11×11 window in Python's floats, without separating it.
    #[test]
    fn a_pair_of_images_scores_what_another_implementation_gives() {
        let planes = |value: fn(usize, usize, usize) -> f64| -> Vec<f64> {
            (0..3 * 16 * 16).map(|i| value(i / 256, i / 16 % 16, i % 16)).collect()
        };
        let x = planes(|c, y, x| ((c * 5 + y * 3 + x * 7) % 23) as f64 / 22.0);
        let other = planes(|c, y, x| ((c * 3 + y * 5 + x * 2) % 19) as f64 / 18.0);
        let truth: Vec<f64> = x.iter().zip(other).map(|(x, other)| 0.7 * x + 0.3 * other).collect();
        let (found, _) = forward(Level::detect(), &x, &truth, [16, 16]);
        assert!((found - 0.916_256_258_751_104).abs() < 1e-12, "{found}");
    }

    #[test]
    fn equal_images_score_one() {
        let size = [20, 33];
        let x = image(1, size);
        let (s, _) = forward(Level::detect(), &x, &x, size);
        assert!((s - 1.0).abs() < 1e-12, "{s}");
    }

    #[test]
    fn backward_agrees_with_finite_differences() {
        // The last one spans several blocks of rows.
        for (seed, size) in [(1, [13, 7]), (2, [5, 19]), (3, [1, 1]), (4, [3, 2 * ROWS + 6])] {
            let (x, truth) = (image(seed, size), image(seed + 10, size));
            let (_, partials) = forward(Level::detect(), &x, &truth, size);
            let mut d = vec![0.0; x.len()];
            backward(Level::detect(), &x, &truth, size, &partials, 0.2, &mut d);
            assert_gradient("ssim", &x, &d, |x| 0.2 * forward(Level::detect(), x, &truth, size).0);
        }
        // Flat images: every variance is zero, only C2 keeps the quotient finite.
        let size = [9, 9];
        let (x, truth) = (vec![0.25; 243], vec![0.5; 243]);
        let (_, partials) = forward(Level::detect(), &x, &truth, size);
        let mut d = vec![0.0; x.len()];
        backward(Level::detect(), &x, &truth, size, &partials, 1.0, &mut d);
        assert_gradient("ssim, flat", &x, &d, |x| forward(Level::detect(), x, &truth, size).0);
    }
}
