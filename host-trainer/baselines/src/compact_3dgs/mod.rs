//! Compact3DGS (Lee et al. 2024, Compact 3D Gaussian Representation for Radiance Field, arXiv 2311.13681), from the paper's mathematics
//! alone, with its post-processing (the paper's "+PP").
//!
//! Masks decide who stays (`masks`), and a field gives the colours: a hash `grid` and a `network` (`field`). Scales and rotations become
//! sums of codes (`residual_codes`), everything else numbers of few bits (`quantised`). `layout` has the bytes. Files are decoded to
//! harmonics (`projection`), and that is what is scored.
//!
//! As published: ε = 0.01, 16 resolutions of 2 channels from 16 to 4096 nodes, two hidden layers of 64, colours as coefficients of degree 0,
//! a rate of 0.01 for masks and field that falls to 0.33 of itself three times, 6 stages of 64 codes in the last 1,000 steps, centres in
//! halves, opacities and grid in 8 bits between the least and the greatest, of the grid nothing below 0.1. λ_m = 5·10⁻⁴ and 2¹⁹ rows are
//! those of real scenes, [`Compact3dgs::SYNTHETIC`] has the others. What is open, and how it is read here:
//!
//! * **From a trained scene.** The paper trains from the first iteration on. Here the field alone learns for 2,000 steps, then everything for
//!   13,000: as many as a run has after its last densification. Rates of Gaussians go on where training ended.
//! * **Masks** begin at σ(m) = ½. What is off has no gradient but that of its cost, so it goes at once. In shorter runs their rate is larger
//!   (`tuning`). The field's is not: it learns less by a larger one.
//! * **Synthetic scenes** have the rates of real ones too.
//! * **The field's places** are contracted outside of the ball of cameras. Places learn nothing by way of their colours.
//! * **Directions** go into the network as three numbers, and 1 stands in for all biases. Harmonics hold no more than degree 3 of its answer.
//! * **Scales** are coded as logarithms, rotations as quaternions of length 1 with w ≥ 0. k-means makes the codes; then they learn from the
//!   photographs, a tenth as fast as what they stand for. So does the network, once the grid is rounded.
//! * **Opacities** are rounded as logits.
//! * **Deflate** codes all of it, of which Huffman's code is the second half. Along Morton's curve alike bytes lie together.

mod field;
mod grid;
mod layout;
mod learning;
mod network;
mod projection;
mod quantised;
mod residual_codes;

pub use quantised::Quantised;

use pocketsplat_gaussians::Gaussians;
use pocketsplat_trainer::train::TrainError;

use crate::baseline::{Baseline, TrainedScene, Unreadable};
use crate::tuning::Tuning;

/// The method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compact3dgs {
    /// λ_m: what all masks on add to the loss.
    pub mask_weight: f64,
    /// log₂ of the rows of a resolution of the grid at most, up to 24.
    pub log2_rows: u8,
}

impl Compact3dgs {
    /// As published for rendered objects.
    pub const SYNTHETIC: Self = Self { mask_weight: 4e-3, log2_rows: 16 };
}

impl Default for Compact3dgs {
    /// As published for photographs.
    fn default() -> Self {
        Self { mask_weight: 5e-4, log2_rows: 19 }
    }
}

impl Baseline for Compact3dgs {
    const NAME: &'static str = "Compact3DGS";

    type Compressed = Quantised;

    fn compress(&self, scene: &TrainedScene<'_>) -> Result<Quantised, TrainError> {
        let mut tuning = Tuning::new(scene)?;
        let learned = learning::learned(&mut tuning, self.log2_rows, self.mask_weight)?;
        quantised::quantised(&mut tuning, learned, self.log2_rows)
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

    #[test]
    fn the_file_draws_what_was_compressed_bit_for_bit_with_any_number_of_threads() {
        let method = Compact3dgs { log2_rows: 8, ..Compact3dgs::default() };
        // More than one task of the field.
        let decoded = gaussians_of_file(&method, 600, Quantised::gaussians, layout::read);
        assert_eq!((decoded.len(), decoded.degree), (600, Degree::Three));
    }
}
