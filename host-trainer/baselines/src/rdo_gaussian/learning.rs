//! The steps on the photographs: Gaussians, masks, codes and their distributions learn together, by one loss.
//!
//! L = D + λ·R/N₀, with the published loss D of the picture that the codes draw, R = Σᵢ Mᵢ·(fixed + Σₐ Mᵢₐ·(−log₂ pₐ(kᵢₐ))) bits, and the N₀
//! Gaussians of the start; distributions by R alone, which the steps of Adam do not tell from λ·R/N₀. Gradients go through a code to what it stands for as if it were that (Bengio et al. 2013, straight-through).

use pocketsplat_kernels::real::Real;
use pocketsplat_trainer::explicit::Cloud;
use pocketsplat_trainer::explicit::optimiser::CloudOptimiser;
use pocketsplat_trainer::explicit::step::CloudGradients;
use pocketsplat_trainer::train::TrainError;

use super::attributes::{ALWAYS, Coded, n_attributes, of_cloud, of_gradients, put};
use super::codebook::bits;
use crate::masks::{Masks, of_gaussians, of_values};
use crate::rotations::upright;
use crate::tuning::{Tuning, picked};

/// Steps, beside a run of 30,000.
const STEPS: u32 = 13_000;

/// Steps from one choice of codes to the next.
const CHOICE_EVERY: u32 = 20;

/// Rate of masks and distributions.
const RATE: f64 = 0.01;

/// λ of the choice of codes in units of λ, as if a squared distance of 1 for each Gaussian of the start added a quarter.
const PRICE: f64 = 4.0;

/// Bits of what has no codebook: a centre in halves, an opacity in a byte.
const FIXED_BITS: f64 = 56.0;

/// N Gaussians, and the codes that stand for their attributes.
pub(super) struct Learned {
    pub(super) cloud: Cloud<f32>,
    pub(super) coded: Vec<Coded>,
}

impl Learned {
    pub(super) fn new(cloud: Cloud<f32>, price: f32, tuning: &mut Tuning<'_>) -> Self {
        let mut rng = tuning.random();
        let coded = (0..n_attributes(cloud.degree)).map(|attribute| Coded::new(attribute, &cloud, price, &mut rng));
        Self { coded: coded.collect(), cloud }
    }

    /// What the codes draw.
    pub(super) fn drawn(&self) -> Cloud<f32> {
        let mut drawn = self.cloud.clone();
        for Coded { attribute, book, chosen } in &self.coded {
            put(*attribute, &book.codes, chosen, &mut drawn);
        }
        drawn
    }

    /// Bits of each attribute `[attributes][N]`, 0 where it is off.
    fn bits(&self) -> Vec<Vec<f32>> {
        let of = |coded: &Coded| {
            let bits = bits(&coded.book.logits);
            coded.chosen.iter().map(|code| code.map_or(0.0, |code| bits[usize::from(code)])).collect()
        };
        self.coded.iter().map(of).collect()
    }

    /// Leaves some Gaussians, in the order in which they are named.
    pub(super) fn pick(&mut self, rows: &[usize]) {
        self.cloud = picked(&self.cloud, rows.iter().copied());
        for coded in &mut self.coded {
            coded.chosen = rows.iter().map(|row| coded.chosen[*row]).collect();
        }
    }
}

/// dR/dMᵢ `[N]` of Gaussians that are on: all of their bits. dR/dMᵢₐ are `bits` themselves.
///
/// * `bits`: `[attributes][N]`, 0 where it is off.
fn bits_of_gaussians<R: Real>(bits: &[Vec<R>]) -> Vec<R> {
    let n = bits.first().map_or(0, Vec::len);
    (0..n).map(|i| bits.iter().fold(R::real(FIXED_BITS), |sum, bits| sum + bits[i])).collect()
}

/// Masks of N Gaussians, and of each of their degrees but 0.
struct Pruning {
    gaussians: Masks,
    /// `[degrees][N]`.
    degrees: Vec<Masks>,
    rate: f64,
    /// λ/N₀: what a bit costs.
    per_bit: f32,
}

impl Pruning {
    /// Moves all masks, and turns degrees off.
    ///
    /// * `drawn`: as it was drawn. * returns which Gaussians stay.
    fn step(&mut self, learned: &mut Learned, drawn: &Cloud<f32>, gradients: &CloudGradients<f32>) -> Vec<bool> {
        let bits = learned.bits();
        let mut d_masks = of_gaussians(&drawn.opacity_logits, gradients);
        d_masks.iter_mut().zip(bits_of_gaussians(&bits)).for_each(|(d, bits)| *d += self.per_bit * bits);
        self.gaussians.step(self.rate, &d_masks);
        for ((masks, coded), bits) in self.degrees.iter_mut().zip(&mut learned.coded[ALWAYS..]).zip(&bits[ALWAYS..]) {
            let mut d_masks: Vec<f32> = bits.iter().map(|bits| self.per_bit * bits).collect();
            for (row, index) in gradients.drawn.iter().enumerate() {
                let index = *index as usize;
                let values = of_cloud(drawn, index, coded.attribute);
                d_masks[index] += of_values(values, of_gradients(gradients, row, coded.attribute));
            }
            masks.step(self.rate, &d_masks);
            coded.chosen.iter_mut().zip(masks.are_on()).filter(|(_, on)| !on).for_each(|(code, _)| *code = None);
        }
        self.gaussians.are_on()
    }

    fn retain(&mut self, on: &[bool]) {
        self.gaussians.retain(on);
        self.degrees.iter_mut().for_each(|masks| masks.retain(on));
    }
}

/// Gaussians, masks, codes and distributions after their steps.
///
/// * `rate_weight`: λ.
#[expect(clippy::cast_possible_truncation, reason = "single precision")]
pub(super) fn learned(tuning: &mut Tuning<'_>, rate_weight: f64) -> Result<Learned, TrainError> {
    let mut cloud = tuning.cloud();
    cloud.rotations.iter_mut().for_each(|rotation| *rotation = upright(rotation));
    let n = cloud.len();
    let price = (PRICE * rate_weight) as f32;
    let mut learned = Learned::new(cloud, price, tuning);
    let mut pruning = Pruning {
        gaussians: Masks::new(n),
        degrees: learned.coded[ALWAYS..].iter().map(|_| Masks::new(n)).collect(),
        rate: tuning.hurried(RATE),
        per_bit: (rate_weight / n.max(1) as f64) as f32,
    };
    let mut optimiser = CloudOptimiser::new(n);
    let mut until_choice = CHOICE_EVERY;
    tuning.stage(STEPS, |turn, _| {
        if until_choice == 0 {
            let Learned { cloud, coded } = &mut learned;
            coded.iter_mut().for_each(|coded| coded.choose(cloud, price));
            until_choice = CHOICE_EVERY;
        }
        until_choice -= 1;
        let Learned { cloud, coded } = &mut learned;
        coded.iter_mut().for_each(|coded| coded.centre(cloud));
        let drawn = learned.drawn();
        let gradients = turn.gradients(&drawn)?;
        let cause = turn.apply(&mut optimiser, &mut learned.cloud, &gradients);
        if cause.is_none() {
            for Coded { book, chosen, .. } in &mut learned.coded {
                book.learn_distribution(pruning.rate, chosen.iter().flatten().copied());
            }
            let on = pruning.step(&mut learned, &drawn, &gradients);
            if on.contains(&false) {
                learned.pick(&(0..on.len()).filter(|i| on[*i]).collect::<Vec<_>>());
                pruning.retain(&on);
                optimiser.retain(&on);
            }
        }
        Ok(cause)
    })?;
    let Learned { cloud, coded } = &mut learned;
    for coded in coded {
        coded.choose(cloud, price);
        coded.centre(cloud);
    }
    Ok(learned)
}

#[cfg(test)]
mod tests {
    use pocketsplat_kernels::finite_difference::{assert_gradient, random};

    use super::*;
    use crate::baseline::TrainedScene;
    use crate::test_scenes::{capture_of, gaussians, short_config, with_hidden};

    #[test]
    fn the_gradients_of_the_rate_by_masks_agree_with_finite_differences() {
        let (n, n_attributes) = (4, 3);
        let bits: Vec<Vec<f64>> = random(1, n * n_attributes).chunks(n).map(<[f64]>::to_vec).collect();
        // The masks of the Gaussians, then those of their attributes.
        let rate = |masks: &[f64]| {
            let (gaussians, attributes) = masks.split_at(n);
            let coded =
                attributes.chunks(n).zip(&bits).map(|(on, bits)| (0..n).map(|i| gaussians[i] * on[i] * bits[i]));
            gaussians.iter().sum::<f64>() * FIXED_BITS + coded.flatten().sum::<f64>()
        };
        let found = [bits_of_gaussians(&bits), bits.concat()].concat();
        assert_gradient("masks", &vec![1.0; found.len()], &found, rate);
    }

    #[test]
    fn in_a_short_run_what_does_not_show_goes_and_so_do_degrees_without_a_use() {
        let mut before = gaussians(60);
        // Nothing depends on the direction.
        before.harmonics.chunks_mut(16).for_each(|harmonics| harmonics[1..].fill([0.0; 3]));
        let capture = capture_of(&before, 4);
        let before = with_hidden(&before);
        let mut config = short_config();
        config.iterations = 200;
        let scene = TrainedScene { gaussians: &before, capture: &capture, config: &config };
        let found = learned(&mut Tuning::new(&scene).unwrap(), 1e-4).unwrap();
        assert!((20..=60).contains(&found.cloud.len()), "{} are left", found.cloud.len());
        assert!(found.cloud.opacity_logits.iter().all(|logit| *logit > -6.0));
        let n_degrees = found.coded[ALWAYS..].iter().flat_map(|coded| &coded.chosen).flatten().count();
        assert!(n_degrees < 3 * found.cloud.len(), "{n_degrees} of {}", 3 * found.cloud.len());
        assert!(found.coded[..ALWAYS].iter().all(|coded| coded.chosen.iter().all(Option::is_some)));
    }
}
