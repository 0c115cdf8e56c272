//! A 3×3 convolution with a ReLU, as a matrix product.

use rayon::prelude::*;

use super::feature_map::FeatureMap;
use pocketsplat_kernels::ops::heads::matmul::{Matrix, multiply};

/// Pixels of a tile: their patches fit the caches, and the product is large enough to be worth packing the weights.
const TILE_PX: usize = 256;

/// Weights and biases of a 3×3 convolution, stride 1, zeros beyond the border.
#[derive(Clone, Debug)]
pub(super) struct Conv3x3 {
    n_in: usize,
    n_out: usize,
    /// `[3 (row), 3 (column), n_in, n_out]`, as patches and [`FeatureMap`] lie in memory.
    weight: Vec<f32>,
    /// `[n_out]`.
    bias: Vec<f32>,
}

impl Conv3x3 {
    /// * `weight`: `[n_out, n_in, 3 (row), 3 (column)]`, as PyTorch stores it.
    /// * `bias`: `[n_out]`.
    ///
    /// # Panics
    /// When the weights are not of that number.
    pub(super) fn new(n_in: usize, weight: &[f32], bias: Vec<f32>) -> Self {
        let n_out = bias.len();
        assert_eq!(weight.len(), n_out * n_in * 9, "3×3 weights of {n_in} channels to {n_out}");
        let mut moved = vec![0.0; weight.len()];
        for (out, filter) in weight.chunks_exact(n_in * 9).enumerate() {
            for (channel, kernel) in filter.chunks_exact(9).enumerate() {
                for (tap, &value) in kernel.iter().enumerate() {
                    moved[(tap * n_in + channel) * n_out + out] = value;
                }
            }
        }
        Self { n_in, n_out, weight: moved, bias }
    }

    /// `max(0, weight ∗ input + bias)` at every pixel, of the input's size.
    ///
    /// Tiles of pixels are laid out as rows of patches `[pixels, 9·n_in]` and multiplied by the weights; tiles are
    /// divided over threads, so the bits do not depend on their number. Work: 9·n_in·n_out multiplications a pixel;
    /// memory besides the result: 9·n_in·[`TILE_PX`] values a thread.
    ///
    /// # Panics
    /// When the input has another number of channels.
    pub(super) fn relu(&self, input: &FeatureMap) -> FeatureMap {
        assert_eq!(input.n_channels, self.n_in, "channels of the input");
        let patch_len = 9 * self.n_in;
        let mut values = vec![0.0; input.width * input.height * self.n_out];
        let tiles = values.par_chunks_mut(TILE_PX * self.n_out).enumerate();
        tiles.for_each_init(
            || vec![0.0; TILE_PX * patch_len],
            |patches, (tile, out)| {
                let n_px = out.len() / self.n_out;
                for (i, patch) in patches.chunks_exact_mut(patch_len).take(n_px).enumerate() {
                    copy_patch(input, tile * TILE_PX + i, patch);
                }
                out.chunks_exact_mut(self.n_out).for_each(|pixel| pixel.copy_from_slice(&self.bias));
                let patches = Matrix::new(&patches[..n_px * patch_len], n_px, patch_len);
                multiply(patches, Matrix::new(&self.weight, patch_len, self.n_out), true, out);
                out.iter_mut().for_each(|value| *value = value.max(0.0));
            },
        );
        FeatureMap { n_channels: self.n_out, values, ..*input }
    }
}

/// Copies the 3×3 pixels around `pixel` to `patch` `[3 (row), 3 (column), channels]`, zeros beyond the border.
fn copy_patch(input: &FeatureMap, pixel: usize, patch: &mut [f32]) {
    let n = input.n_channels;
    let (x, y) = (pixel % input.width, pixel / input.width);
    let columns = x.saturating_sub(1)..(x + 2).min(input.width);
    // Where in a row of the patch the first column of the image lies.
    let at = (columns.start + 1 - x) * n;
    let run = columns.len() * n;
    for (dy, row) in patch.chunks_exact_mut(3 * n).enumerate() {
        match (y + dy).checked_sub(1).filter(|&source| source < input.height) {
            Some(source) if run == row.len() => {
                row.copy_from_slice(&input.values[(source * input.width + columns.start) * n..][..run]);
            }
            Some(source) => {
                row.fill(0.0);
                row[at..][..run].copy_from_slice(&input.values[(source * input.width + columns.start) * n..][..run]);
            }
            None => row.fill(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lpips::test_network::noise;

    /// The definition, pixel by pixel and tap by tap, in f64.
    fn slow(input: &FeatureMap, weight: &[f32], bias: &[f32]) -> Vec<f64> {
        let (w, h, n_in) = (input.width, input.height, input.n_channels);
        let mut out = Vec::new();
        for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
            for (o, &bias) in bias.iter().enumerate() {
                let mut sum = f64::from(bias);
                for (c, dy, dx) in (0..n_in).flat_map(|c| (0..9).map(move |tap| (c, tap / 3, tap % 3))) {
                    let (source_x, source_y) = ((x + dx).wrapping_sub(1), (y + dy).wrapping_sub(1));
                    if source_x < w && source_y < h {
                        let value = input.values[(source_y * w + source_x) * n_in + c];
                        sum += f64::from(value) * f64::from(weight[((o * n_in + c) * 3 + dy) * 3 + dx]);
                    }
                }
                out.push(sum.max(0.0));
            }
        }
        out
    }

    #[test]
    fn tiles_of_patches_agree_with_the_definition() {
        // One pixel, one row, one column, and more than one tile with a rest.
        for (width, height, n_in, n_out) in [(1, 1, 2, 3), (7, 1, 3, 1), (1, 6, 1, 4), (37, 23, 3, 5)] {
            let mut draw = noise(5);
            let mut values = |n: usize| (0..n).map(|_| draw()).collect::<Vec<f32>>();
            let input = FeatureMap { width, height, n_channels: n_in, values: values(width * height * n_in) };
            let (weight, bias) = (values(n_out * n_in * 9), values(n_out));
            let fast = Conv3x3::new(n_in, &weight, bias.clone()).relu(&input);
            assert_eq!((fast.width, fast.height, fast.n_channels), (width, height, n_out));
            for (fast, slow) in fast.values.iter().zip(slow(&input, &weight, &bias)) {
                assert!((f64::from(*fast) - slow).abs() < 1e-5, "{width}×{height}: {fast}, not {slow}");
            }
        }
    }
}
