//! LightGaussian (Fan et al. 2023, arXiv 2311.17245), from the paper's mathematics alone.
//!
//! Of trained Gaussians the least significant go, and the others recover (`significance`). Harmonics of degree 2 learn the pictures of
//! degree 3 (`distillation`). Then places become voxels, shapes halves, and the colours of those that matter least codes
//! (`quantisation`). `layout` has the bytes.
//!
//! As published: 66 % pruned, β = 0.1, 5,000 steps of recovery, 10,000 of distillation, 8,192 codes for 60 % of the Gaussians, 5,000
//! steps of theirs. What is open, and how it is read here:
//!
//! * **A hit** counts by α·T, as the Gaussian shows in the pixel: opacity and transmittance are what the paper multiplies it by.
//! * **Rates** go on where training ended. Nothing is densified or reset, but the moments of Adam start from 0 in each stage.
//! * **Pseudo views** look as their training view does, from a place that deviates by 0.02 of the capture's extent: 0.1 where cameras
//!   stand 4.5 units from the middle. Every step has a new one. All parameters learn from them.
//! * **Who has a code** is decided by the significance of the Gaussians that are left, which k-means weighs by. Codes hold all 27
//!   coefficients. Nothing else moves in their steps: places and shapes are rounded before.
//! * **Shapes and colours** are halves, as the paper's sizes suggest; a codebook takes two bytes a number too.
//! * **The share that goes** is the one setting of the method, so that published sizes can be met.
//! * **Voxels** are 2⁻²⁰ of the smallest cube around all centres: a thousandth of a unit where the farthest lie 500 units away. Gaussians
//!   that share one all stay. Deflate codes the octree, in place of the arithmetic coder of G-PCC.

mod distillation;
mod layout;
mod quantisation;
mod significance;

pub use quantisation::Quantised;

use pocketsplat_gaussians::Gaussians;
use pocketsplat_trainer::explicit::Cloud;
use pocketsplat_trainer::explicit::optimiser::CloudOptimiser;
use pocketsplat_trainer::train::TrainError;

use crate::baseline::{Baseline, TrainedScene, Unreadable};
use crate::tuning::{Tuning, picked};
use significance::{least_significant, significance};

/// Steps of recovery, beside a run of 30,000.
const RECOVERY_STEPS: u32 = 5_000;

/// The method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightGaussian {
    /// Share of the Gaussians that go, 0 to 1.
    pub pruned_share: f64,
}

impl Default for LightGaussian {
    /// As published.
    fn default() -> Self {
        Self { pruned_share: 0.66 }
    }
}

impl Baseline for LightGaussian {
    const NAME: &'static str = "LightGaussian";

    type Compressed = Quantised;

    fn compress(&self, scene: &TrainedScene<'_>) -> Result<Quantised, TrainError> {
        let mut tuning = Tuning::new(scene)?;
        let mut cloud = self.pruned(&tuning);
        let mut optimiser = CloudOptimiser::new(cloud.len());
        tuning.stage(RECOVERY_STEPS, |turn, _| {
            let gradients = turn.gradients(&cloud)?;
            Ok(turn.apply(&mut optimiser, &mut cloud, &gradients))
        })?;
        distillation::distil(&mut tuning, &mut cloud)?;
        quantisation::quantised(&mut tuning, &cloud)
    }

    fn encode(compressed: &Quantised) -> Vec<u8> {
        layout::written(compressed)
    }

    fn decode(bytes: &[u8]) -> Result<Gaussians, Unreadable> {
        layout::read(bytes).map(|quantised| quantised.gaussians())
    }
}

impl LightGaussian {
    /// Without the least significant.
    fn pruned(&self, tuning: &Tuning<'_>) -> Cloud<f32> {
        let cloud = tuning.cloud();
        let goes = least_significant(&significance(tuning.level, &cloud, &tuning.cameras), self.pruned_share);
        picked(&cloud, (0..cloud.len()).filter(|i| !goes[*i]))
    }
}

#[cfg(test)]
mod tests {
    use pocketsplat_gaussians::Degree;
    use pocketsplat_kernels::finite_difference::random;

    use super::*;
    use crate::test_files::gaussians_of_file;
    use crate::test_scenes::{capture_of, gaussians, short_config};

    #[test]
    fn the_file_draws_what_was_compressed_bit_for_bit_with_any_number_of_threads() {
        let decoded = gaussians_of_file(&LightGaussian::default(), 90, Quantised::gaussians, layout::read);
        assert_eq!((decoded.len(), decoded.degree), (31, Degree::Two));
    }

    #[test]
    fn those_that_show_stay() {
        let mut gaussians = gaussians(60);
        // Two of three are hardly there, in any order.
        let faint: Vec<bool> = random(9, 60).iter().map(|x| *x > -0.4).collect();
        for (logit, _) in gaussians.opacity_logits.iter_mut().zip(&faint).filter(|(_, faint)| **faint) {
            *logit = -6.0;
        }
        let share = faint.iter().filter(|faint| **faint).count() as f64 / 60.0;
        let (capture, config) = (capture_of(&gaussians, 4), short_config());
        let scene = TrainedScene { gaussians: &gaussians, capture: &capture, config: &config };
        let pruned = LightGaussian { pruned_share: share }.pruned(&Tuning::new(&scene).unwrap());
        let kept: Vec<_> = (0..60).filter(|i| !faint[*i]).map(|i| gaussians.centres[i]).collect();
        assert_eq!(pruned.centres, kept);
        assert_eq!(pruned.degree, Degree::Three);
    }
}
