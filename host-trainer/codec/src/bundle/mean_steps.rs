//! One step a group for a scene whose context model has steps that follow the place.

use super::WriteError;
use super::order::Placement;
use super::quantise::{StepSource, quantise};
use super::write::WriteOptions;
use pocketsplat_kernels::integer_model;
use pocketsplat_kernels::scene::{QuantisationSteps, Scene};

/// The geometric mean of a context model's steps over the anchors that are coded.
///
/// `base·2^(q̄/8)` for each group, q̄ being the mean exponent. Static tables of these steps come to about the same quality where steps
/// differ little from place to place, and lose decibels where they differ much.
///
/// # Errors
/// [`WriteError::NoContext`]; those of the model's integer form.
pub fn mean_steps(scene: &Scene<f32>) -> Result<QuantisationSteps, WriteError> {
    let model = scene.context.as_ref().ok_or(WriteError::NoContext)?;
    let section = integer_model::section(model, scene.shape.values_per_anchor())?;
    let context = integer_model::parse(&section, &scene.shape).map_err(WriteError::ReadBack)?;
    let placement = Placement::of(scene, None, &[0.0], WriteOptions::default().chunk_anchors.into())?;
    let rows = quantise(scene, &placement, StepSource::Context(&context))?;
    let (n, mut sums) = (rows.steps.len(), [0.0; 3]);
    for steps in &rows.steps {
        for ((sum, step), base) in sums.iter_mut().zip(steps).zip(model.base_steps) {
            // Whole eighths of an octave, so that the order does not matter.
            *sum += (f64::from(step / base).log2() * 8.0).round();
        }
    }
    let mean = |group: usize| model.base_steps[group] * (sums[group] / n.max(1) as f64 / 8.0).exp2() as f32;
    Ok(std::array::from_fn(mean).into())
}
