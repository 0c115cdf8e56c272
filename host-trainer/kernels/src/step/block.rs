//! A block of anchors: from parameters to splats, and back.

use super::buffer::refill;
use super::coded::{Coded, Network, Weights};
use super::coding::Coding;
use super::parents::Parents;
use crate::ops::Pinhole;
use crate::ops::heads::neural_gaussians::{Gaussian, HeadOutputs, Source};
use crate::ops::heads::{detail, head, head_input, neural_gaussians};
use crate::ops::image::project;
use crate::ops::image::project::{Footprint, Splat};
use crate::ops::loss::volume;
use crate::ops::simd::Level;
use crate::real::Real;
use crate::scene::{Anchors, ContextModel, Head, Heads, ModelShape, Scene};

/// A block of visible anchors on its way through the chain; buffers are kept from step to step.
#[derive(Clone, Debug, Default)]
pub struct Block<R> {
    /// Indices of its anchors in the scene, ascending.
    pub anchors: Vec<u32>,
    /// Gaussians with positive opacity.
    pub gaussians: Vec<Gaussian<R>>,
    /// Where each of them comes from.
    pub sources: Vec<Source>,
    /// Those of them that reached the image.
    pub drawn: Vec<u32>,
    /// Length of dL/d(mean) of each drawn one, in units of half the image (the growth statistic).
    pub screen_gradients: Vec<R>,
    /// dL/d(features) `[n, F]`.
    pub d_features: Vec<R>,
    /// dL/d(log-scales) `[n, 6]` or `[n, 4]`.
    pub d_log_scales: Vec<R>,
    /// dL/d(offsets) `[n, 3K]`.
    pub d_offsets: Vec<R>,
    /// dL/d(mask logits) `[n, K]`.
    pub d_mask_logits: Vec<R>,
    positions: Vec<[R; 3]>,
    features: Vec<R>,
    log_scales: Vec<R>,
    offsets: Vec<R>,
    mask_logits: Vec<R>,
    pub(super) coded: Coded<R>,
    input: Vec<R>,
    hidden: [Vec<R>; 3],
    outputs: HeadOutputs<R>,
    /// Their splats.
    pub splats: Vec<Splat<R>>,
    /// How far these reach.
    pub footprints: Vec<Footprint<R>>,
    /// dL/d(Gaussians): zero after the forward pass, for terms on Gaussians to add to.
    pub d_gaussians: Vec<Gaussian<R>>,
    /// What the detail head leaves, if the scene has one.
    detail: detail::ForwardCache<R>,
    d_outputs: HeadOutputs<R>,
    d_hidden: Vec<R>,
    d_input: Vec<R>,
    pub(super) d_heads: Heads<R>,
}

impl<R: Real> Block<R> {
    /// Copies the gradients of its anchors into arrays of all anchors: `[N, F]` features, `[N, 6]` or `[N, 4]` log-scales, `[N, 3K]` offsets.
    pub fn copy_gradients(&self, shape: &ModelShape, d_anchors: &mut Anchors<R>) {
        let copy = |from: &[R], to: &mut [R], len: usize| {
            for (row, &anchor) in from.chunks_exact(len).zip(&self.anchors) {
                to[anchor as usize * len..][..len].copy_from_slice(row);
            }
        };
        copy(&self.d_features, &mut d_anchors.features, shape.feature_dim);
        copy(&self.d_log_scales, &mut d_anchors.log_scales, shape.n_log_scales());
        copy(&self.d_offsets, &mut d_anchors.offsets, 3 * shape.n_offsets);
    }

    pub(super) fn new(shape: &ModelShape) -> Self {
        Self { d_heads: Heads::filled(shape, R::ZERO), ..Self::default() }
    }

    /// Copies the rows of `anchors` out of the scene.
    pub(super) fn gather(&mut self, scene: &Scene<R>, anchors: &[u32]) {
        let (f, s, k) = (scene.shape.feature_dim, scene.shape.n_log_scales(), scene.shape.n_offsets);
        for buffer in [&mut self.features, &mut self.log_scales, &mut self.offsets, &mut self.mask_logits] {
            buffer.clear();
        }
        self.anchors.clear();
        self.anchors.extend_from_slice(anchors);
        self.positions.clear();
        for a in anchors.iter().map(|a| *a as usize) {
            self.positions.push(scene.position(a));
            self.features.extend_from_slice(&scene.anchors.features[a * f..(a + 1) * f]);
            self.log_scales.extend_from_slice(&scene.anchors.log_scales[a * s..(a + 1) * s]);
            self.offsets.extend_from_slice(&scene.anchors.offsets[3 * a * k..3 * (a + 1) * k]);
            self.mask_logits.extend_from_slice(&scene.anchors.mask_logits[a * k..(a + 1) * k]);
        }
    }

    /// Puts coding's traces into the values.
    pub(super) fn code(
        &mut self,
        level: Level,
        scene: &Scene<R>,
        coding: &Coding<'_, R>,
        network: Option<Network<'_, R>>,
        parents: &Parents<R>,
    ) {
        let values = [&mut self.features, &mut self.log_scales, &mut self.offsets];
        self.coded.forward(level, scene, coding, network, parents, &self.anchors, values);
    }

    /// Writes what its anchors give those that follow them; after [`Self::code`].
    pub(super) fn give(&self, model: &ContextModel<R>, rounded: bool, parents: &mut Parents<R>) {
        self.coded.give(model, rounded, &self.anchors, [&self.features, &self.log_scales], parents);
    }

    /// [`Self::code`] backwards, where it asked the context; after [`Self::backward`].
    pub(super) fn code_backward(
        &mut self,
        level: Level,
        shape: &ModelShape,
        network: Network<'_, R>,
        weights: Weights<R>,
    ) {
        let values = [&mut self.features, &mut self.log_scales, &mut self.offsets];
        let d_values = [&mut self.d_features, &mut self.d_log_scales, &mut self.d_offsets];
        let masks = (self.mask_logits.as_slice(), self.d_mask_logits.as_mut_slice());
        self.coded.backward(level, shape, network, weights, [values, d_values], masks);
    }

    /// From anchors to splats.
    pub(super) fn forward(&mut self, level: Level, scene: &Scene<R>, camera: &Pinhole<R>) {
        let (shape, n) = (&scene.shape, self.anchors.len());
        refill(&mut self.input, n * shape.head_inputs());
        head_input::forward(shape, camera, &self.features, &self.positions, &mut self.input);
        self.outputs.reset(shape, n);
        let outputs = [&mut self.outputs.opacity, &mut self.outputs.covariance, &mut self.outputs.colour];
        for ((weights, hidden), output) in scene.heads.each().zip(&mut self.hidden).zip(outputs) {
            hidden.resize(n * weights.n_hidden, R::ZERO);
            head::forward(weights, &self.input, hidden, output);
        }
        self.gaussians.clear();
        self.sources.clear();
        self.splats.clear();
        self.footprints.clear();
        self.drawn.clear();
        level.run(
            #[inline(always)]
            || {
                neural_gaussians::forward(
                    shape,
                    &self.positions,
                    &self.log_scales,
                    &self.offsets,
                    &self.mask_logits,
                    &self.outputs,
                    &mut self.gaussians,
                    &mut self.sources,
                );
            },
        );
        if let Some(head) = &scene.heads.detail {
            detail::forward(head, &self.features, &self.sources, &mut self.gaussians, &mut self.detail);
        }
        self.d_gaussians.clear();
        self.d_gaussians.resize(self.gaussians.len(), Gaussian::default());
        level.run(
            #[inline(always)]
            || {
                for (i, gaussian) in (0u32..).zip(&self.gaussians) {
                    if let Some((splat, footprint)) = project::forward(camera, gaussian, shape.dilation_compensation) {
                        self.splats.push(splat);
                        self.footprints.push(footprint);
                        self.drawn.push(i);
                    }
                }
            },
        );
    }

    /// From the gradients of its splats to those of its Gaussians, which are added to.
    pub(super) fn splats_backward(&mut self, shape: &ModelShape, camera: &Pinhole<R>, d_splats: &[Splat<R>]) {
        self.screen_gradients.clear();
        let half = camera.size_px.map(|s| R::real(0.5 * s as f64));
        for (drawn, d_splat) in self.drawn.iter().zip(d_splats) {
            let i = *drawn as usize;
            let d = project::backward(camera, &self.gaussians[i], shape.dilation_compensation, d_splat);
            self.d_gaussians[i].add(&d);
            let [x, y] = [d_splat.mean_px[0] * half[0], d_splat.mean_px[1] * half[1]];
            self.screen_gradients.push((x * x + y * y).sqrt());
        }
    }

    /// From the gradients of its Gaussians to those of its anchors and of the heads.
    pub(super) fn backward(&mut self, level: Level, scene: &Scene<R>, volume_weight: R, n_gaussians: usize) {
        let (shape, n) = (&scene.shape, self.anchors.len());
        volume::backward(&self.gaussians, volume_weight, n_gaussians, &mut self.d_gaussians);
        for group in self.d_heads.each_mut().flat_map(Head::groups_mut) {
            group.fill(R::ZERO);
        }
        let mut by_detail = vec![R::ZERO; if scene.heads.detail.is_some() { n * shape.feature_dim } else { 0 }];
        if let (Some(head), Some(d_head)) = (&scene.heads.detail, &mut self.d_heads.detail) {
            let Self { features, sources, detail, d_gaussians, .. } = self;
            detail::backward(head, features, sources, detail, d_gaussians, &mut by_detail, d_head);
        }
        self.d_outputs.reset(shape, n);
        refill(&mut self.d_log_scales, n * shape.n_log_scales());
        refill(&mut self.d_offsets, n * 3 * shape.n_offsets);
        refill(&mut self.d_mask_logits, n * shape.n_offsets);
        level.run(
            #[inline(always)]
            || {
                neural_gaussians::backward(
                    shape,
                    &self.log_scales,
                    &self.offsets,
                    &self.mask_logits,
                    &self.outputs,
                    &self.gaussians,
                    &self.sources,
                    &self.d_gaussians,
                    &mut self.d_outputs,
                    &mut self.d_log_scales,
                    &mut self.d_offsets,
                    &mut self.d_mask_logits,
                );
            },
        );
        refill(&mut self.d_input, n * shape.head_inputs());
        let d_outputs = [&self.d_outputs.opacity, &self.d_outputs.covariance, &self.d_outputs.colour];
        let heads = scene.heads.each().zip(self.d_heads.each_mut());
        for (((weights, d_weights), hidden), d_output) in heads.zip(&self.hidden).zip(d_outputs) {
            self.d_hidden.resize(n * weights.n_hidden, R::ZERO);
            head::backward(weights, &self.input, hidden, d_output, &mut self.d_hidden, &mut self.d_input, d_weights);
        }
        refill(&mut self.d_features, n * shape.feature_dim);
        head_input::backward(shape, &self.d_input, &mut self.d_features);
        for (d, by_detail) in self.d_features.iter_mut().zip(by_detail) {
            *d += by_detail;
        }
    }
}
