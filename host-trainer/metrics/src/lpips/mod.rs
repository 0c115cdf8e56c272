//! Learned perceptual image patch similarity.

mod conv;
mod error;
mod feature_map;
mod weights;

#[cfg(test)]
mod test_network;
#[cfg(test)]
mod tests;

use std::fmt;
use std::path::Path;

use rayon::prelude::*;

use conv::Conv3x3;
pub use error::LpipsError;
use feature_map::FeatureMap;

use super::{assert_same_size, with_truth_where_masked};
use pocketsplat_capture::dataset::{Image, Mask};

/// Mean and standard deviation of the images that VGG16 was trained on, of channels in [−1, 1]: (x − shift)/scale.
const SHIFT: [f32; 3] = [-0.030, -0.088, -0.188];
const SCALE: [f32; 3] = [0.458, 0.448, 0.450];

/// Keeps the direction of features finite where all are 0.
const NORM_FLOOR: f32 = 1e-10;

/// Which numbers black and white become before the network sees them.
///
/// LPIPS was trained on [−1, 1]; published figures of Gaussian splatting, from 3DGS on, are of images handed over in
/// [0, 1]. The two differ by several hundredths, so a figure means nothing without its range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InputRange {
    /// Black 0, white 1: as this field publishes.
    #[default]
    ZeroToOne,
    /// Black −1, white 1: as LPIPS was trained.
    MinusOneToOne,
}

impl fmt::Display for InputRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ZeroToOne => "[0, 1]",
            Self::MinusOneToOne => "[-1, 1]",
        })
    }
}

/// Layers between two poolings, and how much each of their channels counts.
#[derive(Clone, Debug)]
struct Stage {
    convolutions: Vec<Conv3x3>,
    /// `[channels]`, none negative.
    head: Vec<f32>,
}

/// LPIPS v0.1 on VGG16 (Zhang et al. 2018, "The unreasonable effectiveness of deep features as a perceptual metric").
///
/// With `f_l(x)` the features after relu1_2, relu2_2, relu3_3, relu4_3 and relu5_3, divided at every pixel by their norm
/// over the channels, and `w_l ≥ 0` learned (eq. 1): `d(a, b) = Σ_l mean over pixels of Σ_c w_lc (f_lc(a) − f_lc(b))²`.
/// 0 for equal images; less is better.
#[derive(Clone, Debug)]
pub struct Lpips {
    stages: Vec<Stage>,
    range: InputRange,
}

impl Lpips {
    /// Reads the weights from a safetensors file, f16 or f32: torchvision's VGG16 (`features.{0, 2, 5, 7, 10, 12, 14, 17,
    /// 19, 21, 24, 26, 28}.{weight, bias}`) and LPIPS's heads `lin{0 … 4}.weight` `[1, channels, 1, 1]`.
    ///
    /// Memory: 59 MB.
    ///
    /// # Errors
    /// [`LpipsError`] when the file cannot be read or is not that of LPIPS-VGG.
    pub fn read(path: &Path, range: InputRange) -> Result<Self, LpipsError> {
        let bytes = std::fs::read(path).map_err(|source| LpipsError::Read { path: path.to_owned(), source })?;
        Ok(Self { stages: weights::stages(&bytes, path)?, range })
    }

    /// What the input's numbers are.
    pub fn range(&self) -> InputRange {
        self.range
    }

    /// The distance of `drawn` from `truth`.
    ///
    /// Where a pixel does not count `drawn` is taken as `truth`, as for SSIM: such pixels neither add nor hide a
    /// difference, but they are part of the mean, so a figure is one of the whole frame. Where no pixel counts the
    /// result is NaN.
    ///
    /// Work: 0.6 million multiplications a pixel; memory: 768 bytes a pixel. Runs on all threads; the bits do not depend
    /// on their number.
    ///
    /// # Errors
    /// [`LpipsError::TooSmall`] below 16×16 pixels.
    ///
    /// # Panics
    /// When the sizes differ.
    pub fn distance(&self, drawn: &Image, truth: &Image, mask: Option<&Mask>) -> Result<f64, LpipsError> {
        assert_same_size(drawn, truth);
        let (width_px, height_px) = (truth.width_px, truth.height_px);
        if width_px.min(height_px) < 16 {
            return Err(LpipsError::TooSmall { width_px, height_px });
        }
        if mask.is_some_and(|mask| mask.n_valid() == 0) {
            return Ok(f64::NAN);
        }
        let drawn = with_truth_where_masked(drawn, truth, mask);
        let (mut a, mut b) = (self.input(&drawn), self.input(truth));
        let mut sum = 0.0;
        for (i, stage) in self.stages.iter().enumerate() {
            if i > 0 {
                (a, b) = (a.max_pooled(), b.max_pooled());
            }
            for convolution in &stage.convolutions {
                a = convolution.relu(&a);
                b = convolution.relu(&b);
            }
            sum += stage.mean_difference(&a, &b);
        }
        Ok(sum)
    }

    /// The image as the first convolution takes it.
    fn input(&self, image: &Image) -> FeatureMap {
        let (factor, offset) = match self.range {
            InputRange::ZeroToOne => (1.0, 0.0),
            InputRange::MinusOneToOne => (2.0, -1.0),
        };
        let normalised = |(i, &value): (usize, &u8)| {
            let value = f32::from(value) / 255.0 * factor + offset;
            (value - SHIFT[i % 3]) / SCALE[i % 3]
        };
        let (width, height) = (image.width_px as usize, image.height_px as usize);
        FeatureMap { width, height, n_channels: 3, values: image.rgb.iter().enumerate().map(normalised).collect() }
    }
}

impl Stage {
    /// Mean over pixels of `Σ_c w_c (a_c/‖a‖ − b_c/‖b‖)²`.
    fn mean_difference(&self, a: &FeatureMap, b: &FeatureMap) -> f64 {
        let n = a.n_channels;
        let row_len = a.width * n;
        let rows = a.values.par_chunks_exact(row_len).zip(b.values.par_chunks_exact(row_len));
        let sum_of_row = |(a, b): (&[f32], &[f32])| {
            let pixels = a.chunks_exact(n).zip(b.chunks_exact(n));
            pixels.map(|(a, b)| f64::from(self.difference(a, b))).sum::<f64>()
        };
        // Collected first: the order of the sum is that of the rows.
        let sums: Vec<f64> = rows.map(sum_of_row).collect();
        sums.iter().sum::<f64>() / (a.width * a.height) as f64
    }

    fn difference(&self, a: &[f32], b: &[f32]) -> f32 {
        let inverse_norm = |x: &[f32]| 1.0 / (x.iter().map(|x| x * x).sum::<f32>().sqrt() + NORM_FLOOR);
        let (scale_a, scale_b) = (inverse_norm(a), inverse_norm(b));
        let terms = self.head.iter().zip(a.iter().zip(b));
        terms.map(|(weight, (a, b))| weight * (a * scale_a - b * scale_b).powi(2)).sum()
    }
}
