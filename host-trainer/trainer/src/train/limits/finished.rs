//! What a finished run hands to the writer of bundles.

use pocketsplat_format::context::{Context, N_GROUPS};
use rayon::prelude::*;

use crate::train::context::integers::{HEAD_FRACTION_BITS, Integers};
use crate::train::density::Visibility;
use crate::train::error::TrainError;
use crate::train::worth::bits::{self, all_steps};
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::rate::perturb;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::Workspace;

/// Anchors that one task looks at.
const ROWS: usize = 512;

/// A trained scene and what is known of it.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The scene, its values not rounded: the writer does that, once. Offsets that no view draws are masked.
    pub scene: Scene<f32>,
    /// `[n]` which anchors matter: their [places](pocketsplat_kernels::scene::Anchors::prune_rank) if they have any, else what they are
    /// [worth](crate::train::worth::Probe::importance) once the run has ended, before that their [opacity](Visibility::opacity). The
    /// order of the tiers.
    pub importance: Vec<f32>,
    /// What lies behind it, rounded.
    pub background: [u8; 3],
    /// Offsets that were masked because no view draws them.
    pub n_undrawn: usize,
    /// Bits of the fraction of the heads' weights, where training has ended with weights of so many.
    pub head_fraction_bits: Option<u8>,
    /// Bits of features, log-scales and drawn offsets under the float context model, in all; none without such a model.
    pub estimated_bits: Option<[f64; N_GROUPS]>,
    /// How the photographs were prepared, for the bundle to say; training does not know.
    pub protocol: Option<String>,
}

impl Finished {
    /// Masks and surveys a scene, with the views that training sees.
    ///
    /// Both look at the values that the last phase of training drew: with a context model, rounded by its steps.
    ///
    /// * `cameras`: of these views. Cost: one forward pass over them.
    ///
    /// # Errors
    /// [`TrainError::NoContext`] or [`TrainError::IntegerModel`] when the context model has no integer form.
    pub fn of(mut scene: Scene<f32>, cameras: &[&Pinhole<f32>], background: [f32; 3]) -> Result<Self, TrainError> {
        let integers = scene.context.is_some().then(|| Integers::of(&scene)).transpose()?;
        let context = integers.as_ref().map(|integers| integers.context(&scene)).transpose()?;
        let mut drawn = scene.clone();
        if let (Some(context), Some(integers)) = (&context, &integers) {
            round_values(&mut drawn, context);
            drawn.heads = integers.heads.clone();
        }
        let seen = Visibility::new(&drawn, &mut Workspace::new(&drawn.shape), cameras, false);
        let n_undrawn = seen.mask_undrawn(&mut drawn);
        let estimated_bits = context.as_ref().map(|context| bits::of_scene(&drawn, context));
        scene.anchors.mask_logits = drawn.anchors.mask_logits;
        // Places that training has given out decide; it has prepared the scene for them.
        let importance =
            if scene.anchors.prune_rank.is_empty() { seen.opacity } else { scene.anchors.prune_rank.clone() };
        // It is between 0 and 1.
        let background = background.map(|channel| (channel * 255.0).round() as u8);
        let head_fraction_bits = context.is_some().then_some(HEAD_FRACTION_BITS);
        Ok(Self { scene, importance, background, n_undrawn, head_fraction_bits, estimated_bits, protocol: None })
    }
}

/// Makes every value a symbol times its step, as the integer model has it.
fn round_values(scene: &mut Scene<f32>, context: &Context<'_>) {
    let (f, s, o) = (scene.shape.feature_dim, scene.shape.n_log_scales(), 3 * scene.shape.n_offsets);
    let steps = all_steps(scene, context);
    let anchors = &mut scene.anchors;
    let rows = steps.par_chunks(ROWS).zip(anchors.features.par_chunks_mut(ROWS * f));
    let rows = rows.zip(anchors.log_scales.par_chunks_mut(ROWS * s)).zip(anchors.offsets.par_chunks_mut(ROWS * o));
    rows.for_each(|(((steps, features), log_scales), offsets)| {
        let mut residuals = vec![0.0; f.max(s).max(o)];
        let rows = features.chunks_exact_mut(f).zip(log_scales.chunks_exact_mut(s)).zip(offsets.chunks_exact_mut(o));
        for (steps, ((features, log_scales), offsets)) in steps.iter().zip(rows) {
            for (values, step) in [features, log_scales, offsets].into_iter().zip(steps) {
                perturb::rounded(*step, values, &mut residuals);
            }
        }
    });
}
