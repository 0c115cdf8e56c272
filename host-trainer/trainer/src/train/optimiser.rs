//! Adam over a whole scene, with a rate per group.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::schedule::Rates;
use pocketsplat_kernels::ops::adam::{self, Moments, Step};
use pocketsplat_kernels::real::Real;
use pocketsplat_kernels::scene::{Anchors, ContextModel, ContextNetwork, Heads, ModelShape, Scene};
use pocketsplat_kernels::step::{Block, GroupSteps, Workspace};

/// Anchors one task updates.
const ROWS: usize = 2048;

/// Moments of every trained parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Optimiser<R> {
    /// Optimiser steps taken.
    pub n_steps: u32,
    /// Of [`Anchors::features`].
    pub features: Moments<R>,
    /// Of [`Anchors::log_scales`].
    pub log_scales: Moments<R>,
    /// Of [`Anchors::offsets`].
    pub offsets: Moments<R>,
    /// Of [`Anchors::mask_logits`].
    pub mask_logits: Moments<R>,
    /// First and second moments of the heads.
    pub heads: [Heads<R>; 2],
    /// Of the background.
    pub background: Moments<R>,
    /// Of the context model, once there is one.
    pub context: Option<ContextMoments<R>>,
}

/// Moments of a context model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContextMoments<R> {
    /// Steps taken with it.
    pub n_steps: u32,
    /// Of the grid's rows.
    pub rows: Moments<R>,
    /// First and second moments of the networks.
    pub networks: [Vec<ContextNetwork<R>>; 2],
}

impl<R: Real> ContextMoments<R> {
    /// Zero moments.
    pub fn zeros(model: &ContextModel<R>) -> Self {
        let networks: Vec<_> = model.networks.iter().map(|network| network.map(|_| R::ZERO)).collect();
        Self { n_steps: 0, rows: Moments::zeros(model.rows.len()), networks: [networks.clone(), networks] }
    }
}

/// One parameter array of the anchors with its moments, cut into tasks.
struct Group<'a, R> {
    width: usize,
    /// `None` where it stays.
    step: Option<Step<R>>,
    parameters: &'a mut [R],
    moments: &'a mut Moments<R>,
    gradient: fn(&Block<R>) -> &[R],
}

impl<R: Real> Optimiser<R> {
    /// Zero moments for a scene.
    pub fn new(scene: &Scene<R>) -> Self {
        let Anchors { features, log_scales, offsets, mask_logits, .. } = &scene.anchors;
        let heads = Heads::filled(&scene.shape, R::ZERO);
        Self {
            n_steps: 0,
            features: Moments::zeros(features.len()),
            log_scales: Moments::zeros(log_scales.len()),
            offsets: Moments::zeros(offsets.len()),
            mask_logits: Moments::zeros(mask_logits.len()),
            heads: [heads.clone(), heads],
            background: Moments::zeros(3),
            context: scene.context.as_ref().map(ContextMoments::zeros),
        }
    }

    /// Zero moments for the context model that the scene has now.
    pub fn begin_context(&mut self, scene: &Scene<R>) {
        self.context = scene.context.as_ref().map(ContextMoments::zeros);
    }

    /// Moves the background by the gradient that the last step left in `workspace`, after [`Self::apply`]; it stays a colour.
    pub fn apply_to_background(&mut self, background: &mut [R; 3], workspace: &Workspace<R>, rate: f64) {
        let Moments { first, second } = &mut self.background;
        adam::update(Step::new(rate, self.n_steps), background, first, second, Some(&workspace.d_background));
        *background = background.map(|channel| channel.larger(R::ZERO).smaller(R::ONE));
    }

    /// Begins the next step: how far it moves anchors and heads.
    ///
    /// Mask logits move only where their rate is above 0.
    ///
    /// * `progress`: share of the run that is done, 0 to 1. * `extent`: of the capture; scales the rates of the offsets and
    ///   of their masks.
    pub fn next(&mut self, rates: &Rates, progress: f64, extent: f64) -> GroupSteps<R> {
        self.n_steps += 1;
        let step = |rate: f64| Step::new(rate, self.n_steps);
        let mask_rate = rates.mask.at(progress) * extent;
        // The detail head goes on with colours, at their rate.
        let of_heads = [rates.opacity_head, rates.covariance_head, rates.colour_head, rates.colour_head];
        GroupSteps {
            anchors: [
                Some(step(rates.feature.at(progress))),
                Some(step(rates.log_scale.at(progress))),
                Some(step(rates.offset.at(progress) * extent)),
                (mask_rate > 0.0).then(|| step(mask_rate)),
            ],
            heads: of_heads.iter().map(|rate| step(rate.at(progress))).collect(),
            context: None,
        }
    }

    /// The same for the context model, where the last step asked it: networks and grid.
    pub fn next_of_context(&mut self, rates: &Rates, progress: f64) -> Option<[Step<R>; 2]> {
        let moments = self.context.as_mut()?;
        moments.n_steps += 1;
        Some([rates.context, rates.grid].map(|rate| Step::new(rate.at(progress), moments.n_steps)))
    }

    /// Moves every parameter by the gradients that the last step left in `workspace`; see [`Self::next`].
    pub fn apply(&mut self, scene: &mut Scene<R>, workspace: &Workspace<R>, rates: &Rates, progress: f64, extent: f64) {
        let steps = self.next(rates, progress, extent);
        let of_context = workspace.d_context.as_ref().and_then(|_| self.next_of_context(rates, progress));
        // Where the gradient of each anchor lies: block and row, or nowhere for an anchor that the view did not see.
        let mut gradient_of = vec![(u32::MAX, 0u32); scene.anchors.len()];
        for (b, block) in (0u32..).zip(workspace.blocks()) {
            for (row, anchor) in (0u32..).zip(&block.anchors) {
                gradient_of[*anchor as usize] = (b, row);
            }
        }
        let Scene { anchors, heads, shape, context, .. } = scene;
        let [feature, log_scale, offset, mask] = steps.anchors;
        let groups = [
            Group {
                width: shape.feature_dim,
                step: feature,
                parameters: &mut anchors.features,
                moments: &mut self.features,
                gradient: |b| &b.d_features,
            },
            Group {
                width: shape.n_log_scales(),
                step: log_scale,
                parameters: &mut anchors.log_scales,
                moments: &mut self.log_scales,
                gradient: |b| &b.d_log_scales,
            },
            Group {
                width: 3 * shape.n_offsets,
                step: offset,
                parameters: &mut anchors.offsets,
                moments: &mut self.offsets,
                gradient: |b| &b.d_offsets,
            },
            Group {
                width: shape.n_offsets,
                step: mask,
                parameters: &mut anchors.mask_logits,
                moments: &mut self.mask_logits,
                gradient: |b| &b.d_mask_logits,
            },
        ];
        for group in groups {
            group.update(workspace, &gradient_of);
        }

        let [first, second] = &mut self.heads;
        let moments = first.each_mut().zip(second.each_mut());
        let all = heads.each_mut().zip(workspace.d_heads.each()).zip(moments).zip(steps.heads);
        for (((head, gradient), (first, second)), step) in all {
            update_groups(step, head.groups_mut(), gradient.groups(), first.groups_mut(), second.groups_mut());
        }
        if let (Some(model), Some(gradient), Some(moments), Some([of_network, of_rows])) =
            (context, &workspace.d_context, &mut self.context, of_context)
        {
            let [first, second] = &mut moments.networks;
            let networks = model.networks.iter_mut().zip(&gradient.networks).zip(first.iter_mut().zip(second));
            for ((network, gradient), (first, second)) in networks {
                update_groups(
                    of_network,
                    network.groups_mut(),
                    gradient.groups(),
                    first.groups_mut(),
                    second.groups_mut(),
                );
            }
            let Moments { first, second } = &mut moments.rows;
            let parts = model.rows.par_chunks_mut(ROWS).zip(gradient.rows.par_chunks(ROWS));
            let parts = parts.zip(first.par_chunks_mut(ROWS)).zip(second.par_chunks_mut(ROWS));
            parts.for_each(|(((p, g), m), v)| {
                workspace.level().run(
                    #[inline(always)]
                    || adam::update(of_rows, p, m, v, Some(g)),
                );
            });
        }
    }

    /// Appends zero moments for the anchors that `scene` has gained.
    pub fn grow(&mut self, scene: &Scene<R>) {
        let Anchors { features, log_scales, offsets, mask_logits, .. } = &scene.anchors;
        let moments = [&mut self.features, &mut self.log_scales, &mut self.offsets, &mut self.mask_logits];
        let lens = [features.len(), log_scales.len(), offsets.len(), mask_logits.len()];
        for (moments, len) in moments.into_iter().zip(lens) {
            moments.first.resize(len, R::ZERO);
            moments.second.resize(len, R::ZERO);
        }
    }

    /// Drops the moments of anchors that `keep` does not mark.
    pub fn retain(&mut self, keep: &[bool], shape: &ModelShape) {
        let moments = [&mut self.features, &mut self.log_scales, &mut self.offsets, &mut self.mask_logits];
        let ModelShape { feature_dim, n_offsets, .. } = *shape;
        let widths = [feature_dim, shape.n_log_scales(), 3 * n_offsets, n_offsets];
        for (moments, width) in moments.into_iter().zip(widths) {
            retain_rows(&mut moments.first, width, keep);
            retain_rows(&mut moments.second, width, keep);
        }
    }
}

/// Moves the groups of a head or a network.
fn update_groups<R: Real, const N: usize>(
    step: Step<R>,
    parameters: [&mut Vec<R>; N],
    gradients: [&[R]; N],
    first: [&mut Vec<R>; N],
    second: [&mut Vec<R>; N],
) {
    for ((p, g), (m, v)) in parameters.into_iter().zip(gradients).zip(first.into_iter().zip(second)) {
        adam::update(step, p, m, v, Some(g));
    }
}

impl<R: Real> Group<'_, R> {
    fn update(self, workspace: &Workspace<R>, gradient_of: &[(u32, u32)]) {
        let Self { width, step, parameters, moments, gradient } = self;
        let Some(step) = step else { return };
        let len = ROWS * width;
        parameters
            .par_chunks_mut(len)
            .zip(moments.first.par_chunks_mut(len))
            .zip(moments.second.par_chunks_mut(len))
            .zip(gradient_of.par_chunks(ROWS))
            .for_each(|(((p, m), v), gradient_of)| {
                workspace.level().run(
                    #[inline(always)]
                    || {
                        let rows =
                            p.chunks_exact_mut(width).zip(m.chunks_exact_mut(width)).zip(v.chunks_exact_mut(width));
                        for (((p, m), v), (block, row)) in rows.zip(gradient_of) {
                            let g = workspace.blocks().get(*block as usize).map(|b| {
                                let at = *row as usize * width;
                                &gradient(b)[at..at + width]
                            });
                            adam::update(step, p, m, v, g);
                        }
                    },
                );
            });
    }
}

/// Keeps the marked rows of a `[n, width]` array, in order.
pub fn retain_rows<T: Copy>(values: &mut Vec<T>, width: usize, keep: &[bool]) {
    let mut end = 0;
    for (row, _) in keep.iter().enumerate().filter(|(_, keep)| **keep) {
        values.copy_within(row * width..(row + 1) * width, end);
        end += width;
    }
    values.truncate(end);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::TrainConfig;
    use pocketsplat_kernels::scene::init::initial_scene;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// The table of docs/method.md: each group at the start, where the decay begins, half-way through it and at the end.
    #[test]
    fn every_group_has_its_learning_rate_at_every_point_of_a_run() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let scene = initial_scene(TrainConfig::default().shape, 0.01, &[glam::DVec3::ZERO], &mut rng);
        let rates = Rates::default();
        let extent = 2.0;
        let half = |start: f64, end: f64| (start * end).sqrt();
        let table = |progress: f64| -> [f64; 8] {
            let optimiser = &mut Optimiser::<f64>::new(&scene.cast());
            let steps = optimiser.next(&rates, progress, extent);
            // The first step divides its rate by 1 − β₁ = 0.1.
            let rate = |step: &Step<f64>| 0.1 * step.scale;
            let [feature, log_scale, offset, mask] = steps.anchors;
            let anchors = [feature, log_scale, offset, mask].map(|step| rate(&step.expect("moved")));
            let heads: [f64; 4] = std::array::from_fn(|i| rate(&steps.heads[i]));
            [anchors, heads].concat().try_into().expect("eight groups")
        };
        // Features, log-scales, offsets and masks (times the extent), then the heads of opacity, covariance, colour and detail.
        let starts = [0.015, 0.007, 0.02, 0.02, 0.002, 0.004, 0.008, 0.008];
        let ends = [0.0005, 0.0005, 0.002, 0.0002, 0.0002, 0.0004, 0.0008, 0.0008];
        let masks_at = |progress: f64| 0.02 * 0.01f64.powf(progress);
        for (progress, expected) in
            [(0.0, starts), (0.85, starts), (0.925, std::array::from_fn(|i| half(starts[i], ends[i]))), (1.0, ends)]
        {
            for (i, (found, expected)) in table(progress).into_iter().zip(expected).enumerate() {
                let expected = if i == 3 { masks_at(progress) } else { expected };
                assert!((found / expected - 1.0).abs() < 1e-9, "group {i} at {progress}: {found}, needed: {expected}");
            }
        }
    }

    #[test]
    fn retained_rows_keep_their_order() {
        let mut values = vec![1, 1, 2, 2, 3, 3, 4, 4];
        retain_rows(&mut values, 2, &[false, true, false, true]);
        assert_eq!(values, [2, 2, 4, 4]);
    }
}
