//! One step a group for a scene whose context model has steps that follow the place.

use super::WriteError;
use super::channels::{ContextWork, GROUPS};
use crate::integer_model;
use crate::scene::{QuantisationSteps, Scene};

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
    let mut work = ContextWork::default();
    let (mut n, mut sums) = (0_usize, [0_i64; 3]);
    let anchors = &scene.anchors;
    for anchor in (0..anchors.len()).filter(|anchor| anchors.has_drawn(*anchor)) {
        n += 1;
        let steps = work.enter(&context, anchors.lattice[anchor]);
        for (sum, group) in sums.iter_mut().zip(GROUPS) {
            *sum += i64::from(steps.exponent(group));
        }
    }
    let mean = |group: usize| model.base_steps[group] * (sums[group] as f64 / n.max(1) as f64 / 8.0).exp2() as f32;
    Ok(std::array::from_fn(mean).into())
}
