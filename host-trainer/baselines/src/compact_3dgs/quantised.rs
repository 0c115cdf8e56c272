//! Numbers of few bits: halves, bytes between the least and the greatest, sums of codes; and the codes' own steps.

use half::f16;
use pocketsplat_gaussians::{Degree, Gaussians};
use pocketsplat_kernels::ops::adam::Step;
use pocketsplat_trainer::explicit::train::fault;
use pocketsplat_trainer::train::TrainError;

use super::field::{Field, FieldOptimiser};
use super::grid::{self, CHANNELS};
use super::learning::{Learned, gradients};
use super::projection::harmonics;
use super::residual_codes::ResidualCodes;
use crate::packed::halved;
use crate::tuning::{Tuning, picked};
use crate::voxels::Lattice;

/// Steps in which codes and network make up for the rounding, beside a run of 30,000.
const STEPS: u32 = 1_000;

/// Of the codes' rates, those of what they stand for: codes add up, and each has many Gaussians.
const RATE_SHARE: f64 = 0.1;

/// Rate of the network, where that of the steps before ended.
const NETWORK_RATE: f64 = 3e-4;

/// Numbers of the grid that are smaller become 0.
const PRUNED: f32 = 0.1;

/// Numbers as bytes b: least + b·step.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bytes {
    pub(super) least: f32,
    pub(super) step: f32,
    pub(super) bytes: Vec<u8>,
}

impl Bytes {
    /// The nearest of 256 numbers from the least to the greatest, moved by less than a step so that 0 is one of them where it lies between.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    pub(super) fn of(values: &[f32]) -> Self {
        let least = values.iter().copied().fold(f32::INFINITY, f32::min);
        let greatest = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        if values.is_empty() {
            return Self { least: 0.0, step: 1.0, bytes: Vec::new() };
        }
        let step = ((greatest - least) / 255.0).max(f32::MIN_POSITIVE);
        let least = if least < 0.0 && greatest > 0.0 { (least / step).round() * step } else { least };
        let bytes = values.iter().map(|value| ((value - least) / step).round() as u8).collect();
        Self { least, step, bytes }
    }

    pub(super) fn value(&self, index: usize) -> f32 {
        self.least + f32::from(self.bytes[index]) * self.step
    }

    fn values(&self) -> Vec<f32> {
        (0..self.bytes.len()).map(|i| self.value(i)).collect()
    }
}

/// N Gaussians as their file has them, along Morton's curve, and the field of their colours.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantised {
    /// `[N]`.
    pub(super) centres: Vec<[f16; 3]>,
    /// `[N]`.
    pub(super) opacity_logits: Bytes,
    /// `[N]`.
    pub(super) log_scales: ResidualCodes<3>,
    /// `[N]`.
    pub(super) rotations: ResidualCodes<4>,
    pub(super) log2_rows: u8,
    /// Of all levels.
    pub(super) rows: Bytes,
    pub(super) weights: Vec<f16>,
}

impl Quantised {
    /// The Gaussians.
    pub fn gaussians(&self) -> Gaussians {
        let centres: Vec<_> = self.centres.iter().map(|centre| centre.map(f16::to_f32)).collect();
        Gaussians {
            degree: Degree::Three,
            log_scales: (0..centres.len()).map(|i| self.log_scales.vector(i)).collect(),
            rotations: (0..centres.len()).map(|i| self.rotations.vector(i)).collect(),
            opacity_logits: self.opacity_logits.values(),
            harmonics: harmonics(&self.field(), &centres),
            centres,
        }
    }

    fn field(&self) -> Field<f32> {
        let weights = self.weights.iter().map(|weight| weight.to_f32()).collect();
        let rows = self.rows.values().as_chunks::<CHANNELS>().0.to_vec();
        Field { levels: grid::levels(self.log2_rows), rows, weights }
    }
}

/// Rounds everything; then codes and network learn, with all else as it was rounded.
pub(super) fn quantised(tuning: &mut Tuning<'_>, learned: Learned, log2_rows: u8) -> Result<Quantised, TrainError> {
    let Learned { cloud, mut field } = learned;
    let lattice = Lattice::around(&cloud.centres);
    let mut order: Vec<usize> = (0..cloud.len()).collect();
    order.sort_by_cached_key(|i| lattice.voxel_of(cloud.centres[*i]));
    let mut cloud = picked(&cloud, order);
    let centres: Vec<_> = cloud.centres.iter().map(|centre| centre.map(halved)).collect();
    cloud.centres = centres.iter().map(|centre| centre.map(f16::to_f32)).collect();
    let opacity_logits = Bytes::of(&cloud.opacity_logits);
    cloud.opacity_logits = opacity_logits.values();
    let kept = |value: &f32| if value.abs() < PRUNED { 0.0 } else { *value };
    let rows = Bytes::of(&field.rows.as_flattened().iter().map(kept).collect::<Vec<_>>());
    field.rows = rows.values().as_chunks().0.to_vec();
    let mut rng = tuning.random();
    let mut log_scales = ResidualCodes::of(&cloud.log_scales, &mut rng);
    let mut rotations = ResidualCodes::of(&cloud.rotations.iter().map(upright).collect::<Vec<_>>(), &mut rng);

    let (mut of_scales, mut of_rotations) = (log_scales.moments(), rotations.moments());
    let mut of_field = FieldOptimiser::new(&field);
    let mut learned = Learned { cloud, field };
    let mut t = 0;
    tuning.stage(STEPS, |turn, _| {
        for i in 0..learned.cloud.len() {
            learned.cloud.log_scales[i] = log_scales.vector(i);
            learned.cloud.rotations[i] = rotations.vector(i);
        }
        let (gradients, d_field) = gradients(turn, &mut learned)?;
        let cause = fault(&gradients);
        if cause.is_none() {
            t += 1;
            let rates = turn.scene.config.rates;
            let step = |rate: f64| Step::new(RATE_SHARE * rate, t);
            let d = || gradients.drawn.iter().map(|index| *index as usize).zip(&gradients.stored);
            log_scales.learn(step(rates.log_scale.end), &mut of_scales, d().map(|(i, d)| (i, d.log_scale)));
            rotations.learn(step(rates.rotation.end), &mut of_rotations, d().map(|(i, d)| (i, d.rotation)));
            of_field.apply_to_weights(&mut learned.field, &d_field, NETWORK_RATE);
        }
        Ok(cause)
    })?;
    let weights = learned.field.weights.iter().map(|weight| halved(*weight)).collect();
    let (log_scales, rotations) = (log_scales.rounded(), rotations.rounded());
    Ok(Quantised { centres, opacity_logits, log_scales, rotations, log2_rows, rows, weights })
}

/// The quaternion of length 1 and with w ≥ 0 that turns the same way.
fn upright(rotation: &[f32; 4]) -> [f32; 4] {
    let length = rotation.iter().map(|q| q * q).sum::<f32>().sqrt();
    let factor = if rotation[0] < 0.0 { -1.0 } else { 1.0 } / length.max(f32::MIN_POSITIVE);
    if length > 0.0 { rotation.map(|q| q * factor) } else { *rotation }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_have_zero_and_are_half_a_step_off_at_most_between_the_ends() {
        let values = [-0.37, 0.0, 0.2, 1.0, 0.51];
        let found = Bytes::of(&values);
        assert!(found.value(1).abs() < 1e-7, "{}", found.value(1));
        for (i, value) in values.iter().enumerate() {
            assert!((found.value(i) - value).abs() < 1.01 * found.step, "{i}");
        }
        assert_eq!(Bytes::of(&[3.0, 3.0]).values(), [3.0, 3.0]);
        assert_eq!(Bytes::of(&[]).values(), [0.0; 0]);
    }

    #[test]
    fn rotations_of_either_sign_are_one() {
        assert_eq!(upright(&[-2.0, 0.0, 0.0, 0.0]), [1.0, -0.0, -0.0, -0.0]);
        assert_eq!(upright(&[0.0; 4]), [0.0; 4]);
    }
}
