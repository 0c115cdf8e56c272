//! The steps on the photographs: the field learns the colours, and masks who is worth keeping.

use pocketsplat_gaussians::Degree;
use pocketsplat_kernels::ops::image::spherical_harmonics::MOST;
use pocketsplat_kernels::ops::simd::Level;
use pocketsplat_trainer::explicit::Cloud;
use pocketsplat_trainer::explicit::optimiser::CloudOptimiser;
use pocketsplat_trainer::explicit::step::CloudGradients;
use pocketsplat_trainer::explicit::train::fault;
use pocketsplat_trainer::train::TrainError;
use pocketsplat_trainer::train::error::Cause;

use super::field::{Field, FieldGradients, FieldOptimiser, of_colours};
use crate::masks::{Masks, of_gaussians};
use crate::tuning::{Tuning, Turn, picked};

/// Steps in which the field alone learns, beside a run of 30,000.
const FIELD_STEPS: u32 = 2_000;

/// Steps in which everything does.
const STEPS: u32 = 13_000;

/// Rate of the field, and of the masks in a run of 30,000.
const RATE: f64 = 1e-2;

/// What the field's rate is multiplied by, and the shares of all steps after which it is.
const RATE_FACTOR: f64 = 0.33;
const RATE_FALLS: [f64; 3] = [5.0 / 30.0, 15.0 / 30.0, 25.0 / 30.0];

/// Gaussians whose colours a field has.
pub(super) struct Learned {
    /// Of degree 0, which holds what the last view saw.
    pub(super) cloud: Cloud<f32>,
    pub(super) field: Field<f32>,
}

/// Draws a view with the colours of the field, and takes its loss back to them and to the field.
pub(super) fn gradients(
    turn: &Turn<'_>,
    learned: &mut Learned,
) -> Result<(CloudGradients<f32>, FieldGradients<f32>), TrainError> {
    let Learned { cloud, field } = learned;
    let eye = turn.camera.centre_world;
    for (harmonics, seen) in cloud.harmonics.chunks_exact_mut(MOST).zip(field.seen(turn.level, &cloud.centres, eye)) {
        harmonics[0] = seen;
    }
    let gradients = turn.gradients(cloud)?;
    let of_field = field.backward(turn.level, &cloud.centres, eye, &gradients.drawn, &of_colours(&gradients));
    Ok((gradients, of_field))
}

/// The rate of the field after a share of all steps.
fn rate_at(share: f64) -> f64 {
    RATE * RATE_FACTOR.powf(RATE_FALLS.into_iter().filter(|fall| share >= *fall).count() as f64)
}

/// The field learns the colours; then masks learn too, and what they turn off goes at once.
pub(super) fn learned(tuning: &mut Tuning<'_>, log2_rows: u8, mask_weight: f64) -> Result<Learned, TrainError> {
    let mask_rate = tuning.hurried(RATE);
    let n_all = f64::from(tuning.length(FIELD_STEPS) + tuning.length(STEPS)).max(1.0);
    let cloud = Cloud { degree: Degree::Zero, ..tuning.cloud() };
    let field = Field::new(log2_rows, &mut tuning.random());
    let mut of_field = FieldOptimiser::new(&field);
    let mut learned = Learned { cloud, field };
    let mut n_done = 0.0;
    let mut move_field = |level: Level, field: &mut Field<f32>, d: &FieldGradients<f32>| {
        of_field.apply(level, field, d, rate_at(n_done / n_all));
        n_done += 1.0;
    };
    tuning.stage(FIELD_STEPS, |turn, _| {
        let (gradients, d_field) = gradients(turn, &mut learned)?;
        let cause = fault(&gradients);
        if cause.is_none() {
            move_field(turn.level, &mut learned.field, &d_field);
        }
        Ok(cause)
    })?;
    let mut masks = Masks::new(learned.cloud.len());
    let mut optimiser = CloudOptimiser::new(learned.cloud.len());
    tuning.stage(STEPS, |turn, _| {
        let (gradients, d_field) = gradients(turn, &mut learned)?;
        let mut d_masks = of_gaussians(&learned.cloud.opacity_logits, &gradients);
        let cause: Option<Cause> = turn.apply(&mut optimiser, &mut learned.cloud, &gradients);
        if cause.is_none() {
            move_field(turn.level, &mut learned.field, &d_field);
            // λ_m·(1/N)·Σ σ(m).
            #[expect(clippy::cast_possible_truncation, reason = "single precision")]
            let d_cost = (mask_weight / masks.len() as f64) as f32;
            d_masks.iter_mut().for_each(|d| *d += d_cost);
            masks.step(mask_rate, &d_masks);
            let on = masks.are_on();
            if on.contains(&false) {
                learned.cloud = picked(&learned.cloud, (0..on.len()).filter(|i| on[*i]));
                optimiser.retain(&on);
                masks.retain(&on);
            }
        }
        Ok(cause)
    })?;
    Ok(learned)
}

#[cfg(test)]
mod tests {
    use pocketsplat_trainer::explicit::CloudConfig;

    use super::*;
    use crate::baseline::TrainedScene;
    use crate::test_scenes::{capture_of, gaussians, short_config, with_hidden};

    #[test]
    fn the_field_learns_the_colours_and_what_does_not_show_goes() {
        let before = gaussians(60);
        let capture = capture_of(&before, 4);
        let before = with_hidden(&before);
        let mut config = short_config();
        config.iterations = 6000;
        let scene = TrainedScene { gaussians: &before, capture: &capture, config: &config };
        let mut tuning = Tuning::new(&scene).unwrap();
        let found = learned(&mut tuning, 8, 4e-3).unwrap();
        assert!((20..=60).contains(&found.cloud.len()), "{} are left", found.cloud.len());
        assert!(found.cloud.opacity_logits.iter().all(|logit| *logit > -6.0));
        let field = Field::new(8, &mut tuning.random());
        let mut start = Learned { cloud: Cloud { degree: Degree::Zero, ..tuning.cloud() }, field };
        let mut found = Learned { cloud: found.cloud, field: found.field };
        let mut losses = [0.0, 0.0];
        tuning
            .stage(100, |turn, _| {
                losses[0] += gradients(turn, &mut start)?.0.loss;
                losses[1] += gradients(turn, &mut found)?.0.loss;
                Ok(None)
            })
            .unwrap();
        assert!(losses[1] < 0.3 * losses[0], "{losses:?}");
    }

    #[test]
    fn in_a_short_run_what_does_not_show_goes_and_what_shows_stays() {
        let mut before = gaussians(100);
        before.opacity_logits.iter_mut().step_by(2).for_each(|logit| *logit = -9.0);
        let capture = capture_of(&before, 20);
        let config = CloudConfig { iterations: 600, ..CloudConfig::default() };
        let scene = TrainedScene { gaussians: &before, capture: &capture, config: &config };
        let found = learned(&mut Tuning::new(&scene).unwrap(), 8, 4e-3).unwrap();
        let faint = found.cloud.opacity_logits.iter().filter(|logit| **logit < -6.0).count();
        assert!(faint == 0 && found.cloud.len() >= 48, "{} are left, {faint} of them faint", found.cloud.len());
    }

    #[test]
    fn rates_fall_three_times() {
        assert_eq!([0.0, 0.2, 0.6, 0.9].map(|share| (1e5 * rate_at(share)).round()), [1000.0, 330.0, 109.0, 36.0]);
    }
}
