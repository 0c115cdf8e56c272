//! Looks at every gradient before it is applied: a parameter that once is NaN stays NaN and spreads to all others.

use rayon::prelude::*;

use crate::train::error::Cause;
use pocketsplat_kernels::ops::heads::neural_gaussians::Gaussian;
use pocketsplat_kernels::scene::{ContextNetwork, Heads, Scene};
use pocketsplat_kernels::step::{Block, StepReport, TargetView, Workspace};

/// Gradients above are refused like infinite ones: their squares would overflow in Adam's second moment.
pub(super) const LARGEST_GRADIENT: f32 = 1e18;

/// Steps dropped in a row that a run survives. A single bad step has a passing cause; that many have one that stays.
pub const MAX_DROPPED_IN_A_ROW: u32 = 100;

/// How many steps were dropped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Watchdog {
    /// In the whole run.
    pub n_dropped: u32,
    /// Since the last one that was not.
    pub n_in_a_row: u32,
}

impl Watchdog {
    /// Counts a step that was applied.
    pub(crate) fn passed(&mut self) {
        self.n_in_a_row = 0;
    }

    /// Counts a step that was dropped.
    ///
    /// * returns whether the run should stop.
    pub(crate) fn dropped(&mut self) -> bool {
        self.n_dropped += 1;
        self.n_in_a_row += 1;
        self.n_in_a_row > MAX_DROPPED_IN_A_ROW
    }
}

/// Whether loss and gradients of a step may be applied, and what is wrong with them otherwise.
///
/// From finite parameters and moments, gradients that pass move to finite parameters and moments. Costs one reading of
/// the gradients.
pub(super) fn inspect(
    scene: &Scene<f32>,
    target: &TargetView<'_, f32>,
    background: [f32; 3],
    workspace: &Workspace<f32>,
    report: &StepReport<f32>,
) -> Option<Cause> {
    let blocks_sound = workspace.blocks().par_iter().all(|block| {
        let Block { screen_gradients, d_features, d_log_scales, d_offsets, d_mask_logits, .. } = block;
        let arrays = [screen_gradients, d_features, d_log_scales, d_offsets, d_mask_logits];
        workspace.level().run(
            #[inline(always)]
            || arrays.iter().all(|gradients| sound(gradients)),
        )
    });
    let heads_sound = groups(&workspace.d_heads).chain(context_gradients(workspace)).all(sound);
    if report.loss.is_finite() && blocks_sound && heads_sound {
        return None;
    }
    // Rare, so it may be slow: the whole chain from the start.
    let found = input_fault(scene, target.truth(), background).or_else(|| drawing_fault(workspace));
    let loss = || refused(&[report.loss], 1, f32::MAX).map(|(_, value)| cause("the loss", None, value));
    let found = found.or_else(loss).or_else(|| gradient_fault(workspace));
    Some(found.unwrap_or(cause("a value", None, f32::NAN)))
}

/// Whether all gradients are below the limit. Without early exit inside a run of 1024, so that it vectorises.
#[inline(always)]
pub(crate) fn sound(gradients: &[f32]) -> bool {
    gradients.chunks(1024).all(
        #[inline(always)]
        |run| run.iter().fold(true, |sound, g| sound & (g.abs() <= LARGEST_GRADIENT)),
    )
}

fn cause(array: &'static str, anchor: Option<usize>, value: f32) -> Cause {
    Cause { array, anchor, value }
}

fn context_gradients(workspace: &Workspace<f32>) -> impl Iterator<Item = &[f32]> {
    workspace
        .d_context
        .iter()
        .flat_map(|found| found.networks.iter().flat_map(ContextNetwork::groups).chain([found.rows.as_slice()]))
}

fn groups(heads: &Heads<f32>) -> impl Iterator<Item = &[f32]> {
    heads.each().flat_map(|head| head.groups())
}

/// Row and value of the first number whose magnitude is not at most `limit`.
fn refused(values: &[f32], width: usize, limit: f32) -> Option<(usize, f32)> {
    // Not `>`: NaN has to be found.
    let at = values.iter().position(|v| !(v.abs() <= limit))?;
    Some((at / width.max(1), values[at]))
}

fn input_fault(scene: &Scene<f32>, truth: &[f32], background: [f32; 3]) -> Option<Cause> {
    let (f, k) = (scene.shape.feature_dim, scene.shape.n_offsets);
    let anchors = &scene.anchors;
    [
        ("a feature", &anchors.features, f),
        ("a log-scale", &anchors.log_scales, scene.shape.n_log_scales()),
        ("an offset", &anchors.offsets, 3 * k),
        ("a mask logit", &anchors.mask_logits, k),
    ]
    .into_iter()
    .find_map(|(array, values, width)| {
        refused(values, width, f32::MAX).map(|(anchor, value)| cause(array, Some(anchor), value))
    })
    .or_else(|| {
        let heads = groups(&scene.heads).find_map(|group| refused(group, 1, f32::MAX));
        heads.map(|(_, value)| cause("a weight of the heads", None, value))
    })
    .or_else(|| {
        let model = scene.context.as_ref()?;
        let mut arrays = model.networks.iter().flat_map(ContextNetwork::groups).chain([model.rows.as_slice()]);
        let (_, value) = arrays.find_map(|array| refused(array, 1, f32::MAX))?;
        Some(cause("a weight of the context model", None, value))
    })
    .or_else(|| refused(truth, 1, f32::MAX).map(|(_, value)| cause("a pixel of the photograph", None, value)))
    .or_else(|| refused(&background, 1, f32::MAX).map(|(_, value)| cause("the background", None, value)))
}

fn drawing_fault(workspace: &Workspace<f32>) -> Option<Cause> {
    workspace.blocks().iter().find_map(|block| {
        block.gaussians.iter().zip(&block.sources).find_map(|(gaussian, source)| {
            let Gaussian { centre, scale, rotation, opacity, colour } = gaussian;
            let volume = scale.iter().product();
            let parts: [(&'static str, &[f32]); 6] = [
                ("the centre of a Gaussian", centre),
                ("the size of a Gaussian", scale),
                ("the volume of a Gaussian", std::slice::from_ref(&volume)),
                ("the rotation of a Gaussian", rotation),
                ("the opacity of a Gaussian", std::slice::from_ref(opacity)),
                ("the colour of a Gaussian", colour),
            ];
            let (array, value) =
                parts.into_iter().find_map(|(array, v)| refused(v, 1, f32::MAX).map(|(_, value)| (array, value)))?;
            Some(cause(array, Some(block.anchors[source.row as usize] as usize), value))
        })
    })
}

fn gradient_fault(workspace: &Workspace<f32>) -> Option<Cause> {
    let in_blocks = workspace.blocks().iter().find_map(|block| {
        let n = block.anchors.len().max(1);
        let anchor = |row: usize| block.anchors.get(row).map(|a| *a as usize);
        let drawn = |i: usize| anchor(block.sources[block.drawn[i] as usize].row as usize);
        if let Some((i, value)) = refused(&block.screen_gradients, 1, LARGEST_GRADIENT) {
            return Some(cause("the gradient on screen", drawn(i), value));
        }
        [
            ("the gradient of a log-scale", &block.d_log_scales),
            ("the gradient of an offset", &block.d_offsets),
            ("the gradient of a feature", &block.d_features),
            ("the gradient of a mask logit", &block.d_mask_logits),
        ]
        .into_iter()
        .find_map(|(array, gradients)| {
            let (row, value) = refused(gradients, gradients.len() / n, LARGEST_GRADIENT)?;
            Some(cause(array, anchor(row), value))
        })
    });
    in_blocks.or_else(|| {
        let heads = groups(&workspace.d_heads).find_map(|group| refused(group, 1, LARGEST_GRADIENT));
        heads.map(|(_, value)| cause("the gradient of the heads", None, value)).or_else(|| {
            let found = context_gradients(workspace).find_map(|group| refused(group, 1, LARGEST_GRADIENT));
            found.map(|(_, value)| cause("the gradient of the context model", None, value))
        })
    })
}

#[cfg(test)]
mod tests;
