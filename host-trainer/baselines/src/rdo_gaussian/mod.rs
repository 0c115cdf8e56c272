//! RDO-Gaussian (Wang et al. 2024, End-to-End Rate-Distortion Optimized 3D Gaussian Representation, arXiv 2406.01597), from the paper's
//! mathematics alone.
//!
//! Masks decide which Gaussians stay, and which degrees of their harmonics (`masks`, `learning`). Scales, rotations, base colours and each
//! degree become codes that are few bits where they are likely (`codebook`, `attributes`), and all of it learns by one loss of distortion and
//! rate. `quantised` rounds the rest, `symbols` codes by the distributions that were learned, `layout` has the bytes.
//!
//! As published: learned masks for Gaussians and for degrees, with what stays in the loss; a codebook of its own for each of six attributes;
//! a code chosen by distance and λ times its bits; codes and their distributions that learn, with gradients straight through the choice;
//! centres in halves; files of several rates by λ. What is open, and how it is read here:
//!
//! * **From a trained scene.** 13,000 steps of everything follow, as many as a run has after its last densification, and 2,000 in which the
//!   codes alone learn, with all choices and roundings made. Rates of Gaussians go on where training ended.
//! * **One λ** weighs all bits, those of masks too: a Gaussian costs its 56 bits of centre and opacity and those of its codes, a degree those
//!   of its code. They are counted for each Gaussian of the start, so that a bit costs the same whoever has gone.
//! * **Distances** are of log-scales, quaternions of length 1 with w ≥ 0, and coefficients as they are. In the choice λ is 4 times that of
//!   the loss, as if a squared distance of 1 for each Gaussian of the start added a quarter: with more, codes of less detail cost more quality than fewer Gaussians do.
//! * **λ** is 10⁻⁴, and 5·10⁻⁴ for a lower rate, in this program's unit. Published files of lower rates have fewer Gaussians too, with as many
//!   bits or more for each.
//! * **Masks** are those of Compact3DGS: ε = 0.01, from σ(m) = ½ at a rate of 0.01, and what is off goes at once. The distributions have
//!   this rate too. A shorter run has a larger one.
//! * **Codes** begin by the generalised Lloyd algorithm. While Gaussians learn they are the means of what they stand for, which moves as the
//!   gradients say; each Gaussian chooses anew every 20 steps. In their own steps they have a tenth of the rates of their attributes.
//! * **Codebooks** have 1,024 codes at most, and one for 32 Gaussians: more would be larger than what they save in a small scene. Codes that
//!   nobody has are left out of the file.
//! * **Opacities** are logits in 8 bits, centres lie along Morton's curve. Frequencies of opacities and of sets of degrees are counted.
//! * **The entropy coder** is the one of bundles. Deflate codes centres and tables.

mod attributes;
mod codebook;
mod layout;
mod learning;
mod quantised;
mod symbols;

pub use quantised::Quantised;

use pocketsplat_gaussians::Gaussians;
use pocketsplat_trainer::train::TrainError;

use crate::baseline::{Baseline, TrainedScene, Unreadable};
use crate::tuning::Tuning;

/// The method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RdoGaussian {
    /// λ: what a bit for each Gaussian of the start adds to the loss.
    pub rate_weight: f64,
}

impl Default for RdoGaussian {
    /// A rate at which pictures are about as good as before.
    fn default() -> Self {
        Self { rate_weight: 1e-4 }
    }
}

impl Baseline for RdoGaussian {
    const NAME: &'static str = "RDO-Gaussian";

    type Compressed = Quantised;

    fn compress(&self, scene: &TrainedScene<'_>) -> Result<Quantised, TrainError> {
        let mut tuning = Tuning::new(scene)?;
        let learned = learning::learned(&mut tuning, self.rate_weight)?;
        quantised::quantised(&mut tuning, learned)
    }

    fn encode(compressed: &Quantised) -> Vec<u8> {
        layout::written(compressed)
    }

    fn decode(bytes: &[u8]) -> Result<Gaussians, Unreadable> {
        layout::read(bytes).map(|quantised| quantised.gaussians())
    }
}

#[cfg(test)]
mod tests {
    use pocketsplat_gaussians::Degree;

    use super::*;
    use crate::test_files::gaussians_of_file;
    use crate::test_scenes::{capture_of, gaussians, short_config};

    #[test]
    fn the_file_draws_what_was_compressed_bit_for_bit_with_any_number_of_threads() {
        // More than one task of the choice of codes.
        let decoded = gaussians_of_file(&RdoGaussian::default(), 600, Quantised::gaussians, layout::read);
        assert_eq!(decoded.degree, Degree::Three);
        assert!((100..=600).contains(&decoded.len()), "{} are left", decoded.len());
    }

    #[test]
    fn a_larger_weight_of_the_rate_gives_a_smaller_file() {
        let gaussians = gaussians(300);
        let (capture, mut config) = (capture_of(&gaussians, 4), short_config());
        config.iterations = 300;
        let scene = TrainedScene { gaussians: &gaussians, capture: &capture, config: &config };
        let of = |rate_weight| {
            let compressed = RdoGaussian { rate_weight }.compress(&scene).unwrap();
            (RdoGaussian::encode(&compressed).len(), compressed.gaussians().len())
        };
        let [low, middle, high] = [1e-5, 1e-4, 1e-3].map(of);
        assert!(low.0 > middle.0 && middle.0 > high.0, "{low:?}, {middle:?}, {high:?}");
        assert!(low.1 > high.1, "{low:?}, {middle:?}, {high:?}");
    }
}
