//! Numbers of few bits: halves, bytes and codes; and the codes' own steps.

use half::f16;
use pocketsplat_gaussians::{Degree, Gaussians};
use pocketsplat_kernels::ops::adam::Step;
use pocketsplat_trainer::explicit::train::fault;
use pocketsplat_trainer::explicit::{Cloud, CloudConfig};
use pocketsplat_trainer::train::TrainError;

use super::attributes::{Coded, put};
use super::codebook::bits;
use super::learning::Learned;
use super::symbols::frequencies_of;
use crate::bytes::Bytes;
use crate::packed::halved;
use crate::tuning::Tuning;
use crate::voxels::along_the_curve;

/// Steps in which the codes alone learn, beside a run of 30,000.
const STEPS: u32 = 2_000;

/// Of the codes' rates, those of what they stand for: each has many Gaussians.
const RATE_SHARE: f64 = 0.1;

/// One attribute as files have it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Codes {
    /// `[K, width]`.
    pub(super) codes: Vec<f16>,
    /// `[K]` the learned distribution, in slots of the entropy coder.
    pub(super) frequencies: Vec<u16>,
    /// `[N]`; those without have the attribute 0.
    pub(super) chosen: Vec<Option<u16>>,
}

/// N Gaussians as their file has them, along Morton's curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantised {
    pub(super) degree: Degree,
    /// `[N]`.
    pub(super) centres: Vec<[f16; 3]>,
    /// `[N]`.
    pub(super) opacity_logits: Bytes,
    /// Scales, rotations, base colours, and each further degree.
    pub(super) attributes: Vec<Codes>,
}

impl Quantised {
    /// The Gaussians.
    pub fn gaussians(&self) -> Gaussians {
        let n = self.centres.len();
        let mut cloud = Cloud::empty(self.degree);
        cloud.centres = self.centres.iter().map(|centre| centre.map(f16::to_f32)).collect();
        cloud.opacity_logits = self.opacity_logits.values();
        cloud.log_scales.resize(n, [0.0; 3]);
        cloud.rotations.resize(n, [0.0; 4]);
        cloud.harmonics.resize(n * cloud.n_coefficients, [0.0; 3]);
        for (attribute, Codes { codes, chosen, .. }) in self.attributes.iter().enumerate() {
            let codes: Vec<f32> = codes.iter().map(|value| value.to_f32()).collect();
            put(attribute, &codes, chosen, &mut cloud);
        }
        cloud.into()
    }
}

/// Rounds everything; then the codes learn, with all else as it was rounded.
pub(super) fn quantised(tuning: &mut Tuning<'_>, mut learned: Learned) -> Result<Quantised, TrainError> {
    learned.pick(&along_the_curve(&learned.cloud.centres));
    let cloud = &mut learned.cloud;
    let centres: Vec<_> = cloud.centres.iter().map(|centre| centre.map(halved)).collect();
    cloud.centres = centres.iter().map(|centre| centre.map(f16::to_f32)).collect();
    let opacity_logits = Bytes::of(&cloud.opacity_logits);
    cloud.opacity_logits = opacity_logits.values();
    let mut t = 0;
    tuning.stage(STEPS, |turn, _| {
        let gradients = turn.gradients(&learned.drawn())?;
        let cause = fault(&gradients);
        if cause.is_none() {
            t += 1;
            for coded in &mut learned.coded {
                let step = Step::new(RATE_SHARE * rate_of(coded.attribute, turn.scene.config), t);
                let d_codes = coded.d_codes(&gradients);
                coded.book.learn_codes(step, &d_codes);
            }
        }
        Ok(cause)
    })?;
    let attributes = learned.coded.iter().map(codes).collect();
    Ok(Quantised { degree: learned.cloud.degree, centres, opacity_logits, attributes })
}

/// The rate at which an attribute ends its training.
fn rate_of(attribute: usize, CloudConfig { rates, .. }: &CloudConfig) -> f64 {
    match attribute {
        0 => rates.log_scale.end,
        1 => rates.rotation.end,
        2 => rates.colour.end,
        _ => rates.colour.end / rates.bands_divisor,
    }
}

/// The codes that a Gaussian has, rounded, and the distribution over them.
fn codes(Coded { book, chosen, .. }: &Coded) -> Codes {
    let counts = book.counts(chosen.iter().flatten().copied());
    let used: Vec<usize> = (0..counts.len()).filter(|code| counts[*code] > 0.0).collect();
    let mut renamed = vec![None; counts.len()];
    (0..).zip(&used).for_each(|(new, old)| renamed[*old] = Some(new));
    let bits = bits(&book.logits);
    let shares: Vec<f32> = used.iter().map(|code| (-bits[*code]).exp2().max(f32::MIN_POSITIVE)).collect();
    let of = |code: &usize| book.codes[code * book.width..][..book.width].iter().copied().map(halved);
    Codes {
        codes: used.iter().flat_map(of).collect(),
        frequencies: frequencies_of(&shares),
        chosen: chosen.iter().map(|code| code.and_then(|code| renamed[usize::from(code)])).collect(),
    }
}

#[cfg(test)]
mod tests {
    use pocketsplat_trainer::explicit::step::step;
    use pocketsplat_trainer::train::views::target;

    use super::*;
    use crate::baseline::TrainedScene;
    use crate::test_scenes::{capture_of, gaussians, short_config};

    #[test]
    fn codes_learn_what_the_rounding_cost() {
        let gaussians = gaussians(60);
        let (capture, mut config) = (capture_of(&gaussians, 4), short_config());
        config.iterations = 9000;
        let scene = TrainedScene { gaussians: &gaussians, capture: &capture, config: &config };
        let mut tuning = Tuning::new(&scene).unwrap();
        let learned = Learned::new(tuning.cloud(), 0.0, &mut tuning);
        let level = tuning.level;
        let loss_of = |cloud: &Cloud<f32>, cameras: &[_]| -> f32 {
            let views = capture.train.iter().zip(cameras);
            let of = |(view, camera): (&pocketsplat_capture::dataset::View, _)| {
                step(level, cloud, &target(&view.photograph().unwrap(), camera, [0.0; 3]), config.dssim).loss
            };
            views.map(of).sum()
        };
        let before = loss_of(&learned.drawn(), &tuning.cameras);
        let n_codes = learned.coded[0].book.logits.len();
        let found = quantised(&mut tuning, learned).unwrap();
        assert_eq!((n_codes, found.attributes[0].frequencies.len()), (2, 2));
        let after = loss_of(&Cloud::from(&found.gaussians()), &tuning.cameras);
        assert!(after < 0.95 * before, "{after}, before {before}");
    }
}
