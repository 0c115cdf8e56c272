//! High-frequency detail compensation: a small head that adds to colours what the others smooth away.

use serde::{Deserialize, Serialize};

use super::{Module, Moment, Pictures, Terms};
use crate::ops::{Real, high_pass};
use crate::scene::{ModelShape, Scene};
use crate::train::config::within;
use crate::train::step::Block;

/// What teaches the residual besides the image's own loss.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Teaching {
    /// Nothing.
    Off,
    /// Small residuals: the mean over the drawn Gaussians of ‖H − x‖², as the paper's eq. 6 reads.
    Small,
    /// The mean squared difference of image and photograph in high frequencies, what the paper's words ask for.
    #[default]
    HighPass,
    /// The mean over the drawn Gaussians of ‖H − c‖², c being the colour from features that coding has not touched.
    Uncoded,
}

/// Adds a residual to each Gaussian's colour, H = x + F(x ⊕ f) (the plug-and-play paper, eq. 5; see [`crate::ops::detail`]).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Detail {
    /// Hidden width of the head.
    pub hidden: usize,
    /// What teaches it.
    pub teaching: Teaching,
    /// Weight of that. (The paper's is 5e-4, for [`Teaching::Small`].)
    pub weight: f64,
}

impl Default for Detail {
    fn default() -> Self {
        Self { hidden: 32, teaching: Teaching::HighPass, weight: 1.0 }
    }
}

impl Module for Detail {
    fn check(&self) -> Result<(), String> {
        within("train.modules.detail.hidden", self.hidden as f64, 1.0, 256.0)?;
        within("train.modules.detail.weight", self.weight, 0.0, 1e3)
    }

    fn shape(&self, shape: ModelShape) -> ModelShape {
        ModelShape { detail_hidden: self.hidden, ..shape }
    }
}

impl<R: Real> Terms<R> for Detail {
    fn on_image(&self, _at: &Moment, pictures: &Pictures<'_, R>, d_image: &mut [R]) -> R {
        if self.teaching != Teaching::HighPass {
            return R::ZERO;
        }
        let Pictures { image, truth, size_px, level } = *pictures;
        high_pass::forward_backward(level, image, truth, size_px, R::real(self.weight), d_image)
    }

    fn on_gaussians(&self, _at: &Moment, scene: &Scene<R>, blocks: &mut [Block<R>]) -> R {
        let n: usize = blocks.iter().map(|b| b.gaussians.len()).sum();
        let share = R::real(self.weight / n.max(1) as f64);
        let mut sum = R::ZERO;
        for block in blocks {
            match self.teaching {
                Teaching::Small => {
                    let kept = &mut block.detail;
                    for (d, residual) in kept.d_residuals.iter_mut().zip(&kept.residuals) {
                        sum += *residual * *residual;
                        *d += (share + share) * *residual;
                    }
                }
                Teaching::Uncoded => {
                    let targets = block.uncoded_colours(scene);
                    let gaussians = block.gaussians.iter().zip(&mut block.d_gaussians);
                    for ((gaussian, d), target) in gaussians.zip(targets) {
                        for i in 0..3 {
                            let beyond = gaussian.colour[i] - target[i];
                            sum += beyond * beyond;
                            d.colour[i] += (share + share) * beyond;
                        }
                    }
                }
                Teaching::Off | Teaching::HighPass => {}
            }
        }
        share * sum
    }
}
