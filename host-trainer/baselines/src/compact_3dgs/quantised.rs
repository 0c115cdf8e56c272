//! Numbers of few bits: halves, bytes, sums of codes; and the codes' own steps.

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
use crate::bytes::Bytes;
use crate::packed::halved;
use crate::rotations::upright;
use crate::tuning::{Tuning, picked};
use crate::voxels::along_the_curve;

/// Steps in which codes and network make up for the rounding, beside a run of 30,000.
const STEPS: u32 = 1_000;

/// Of the codes' rates, those of what they stand for: codes add up, and each has many Gaussians.
const RATE_SHARE: f64 = 0.1;

/// Rate of the network, where that of the steps before ended.
const NETWORK_RATE: f64 = 3e-4;

/// Numbers of the grid that are smaller become 0.
const PRUNED: f32 = 0.1;

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
    let mut cloud = picked(&cloud, along_the_curve(&cloud.centres));
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
