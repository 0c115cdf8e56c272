//! The rate of a step and the gradients of the context model, summed over the blocks.

use pocketsplat_format::context::N_GROUPS;
use rayon::prelude::*;

use super::coded::steps_of;
use super::coding::{RateReport, RateTerms};
use super::{Coding, Network, Weights, Workspace};
use crate::ops::rate::hash_grid::Part;
use crate::ops::rate::{grid_bits, hash_grid};
use crate::real::Real;
use crate::scene::{ContextModel, ContextNetwork, Head, Scene};

/// Gradients of a [`ContextModel`].
#[derive(Clone, Debug)]
pub struct ContextGradients<R> {
    /// As [`ContextModel::rows`].
    pub rows: Vec<R>,
    /// As [`ContextModel::networks`].
    pub networks: Vec<ContextNetwork<R>>,
}

/// The networks that `coding` asks: those of the scene, or what its integers stand for.
fn whole<'a, R>(model: &'a ContextModel<R>, coding: &Coding<'a, R>) -> &'a [ContextNetwork<R>] {
    match coding {
        Coding::Context { exact: Some(exact), .. } => exact.networks,
        _ => &model.networks,
    }
}

/// The part of the networks that every visible anchor needs.
pub(super) fn steps_heads<R: Real>(scene: &Scene<R>, coding: &Coding<'_, R>) -> Option<Vec<Head<R>>> {
    let model = scene.context.as_ref().filter(|_| matches!(coding, Coding::Context { .. }))?;
    Some(whole(model, coding).iter().map(|network| steps_of(&network.mlp)).collect())
}

pub(super) fn network<'a, R>(
    scene: &'a Scene<R>,
    coding: &Coding<'a, R>,
    steps: Option<&'a [Head<R>]>,
) -> Option<Network<'a, R>> {
    let (model, steps) = (scene.context.as_ref()?, steps?);
    Some(Network { model, whole: whole(model, coding), steps })
}

impl<R: Real> Workspace<R> {
    /// The rate terms of a step whose other gradients are done: their value and what was found.
    ///
    /// λ·(mean bits of a value of the sample)·(share of anchors that are drawn at all) + mask·mean σ(mask logits of the
    /// visible anchors) + λ·grid·(bits of the grid)/(values of all anchors) (Chen et al. 2024, HAC; there the mask term runs
    /// over all anchors). Values of masked offsets count in the number of values, not in the bits.
    pub(super) fn rate(&mut self, scene: &Scene<R>, network: Network<'_, R>, terms: &RateTerms) -> (R, RateReport) {
        let shape = &scene.shape;
        let n_channels = shape.values_per_anchor() as f64;
        let n_anchors = scene.anchors.len();
        let n_valid = (0..n_anchors).filter(|a| scene.anchors.has_drawn(*a)).count();
        let n_sampled: usize = self.blocks().iter().map(|b| b.coded.sampled.len()).sum();
        let n_visible: usize = self.blocks().iter().map(|b| b.anchors.len()).sum();
        let valid_share = n_valid as f64 / n_anchors.max(1) as f64;
        let bit = terms.lambda * valid_share / (n_sampled.max(1) as f64 * n_channels);
        let mask = terms.mask / (n_visible * shape.n_offsets).max(1) as f64;
        let anchor = if terms.masks_weigh_anchors { bit } else { 0.0 };
        let weights = Weights { bit: R::real(bit), anchor: R::real(anchor), mask: R::real(mask) };
        let level = self.level;
        self.blocks[..self.n_blocks]
            .par_iter_mut()
            .for_each(|block| block.code_backward(level, shape, network, weights));

        let mut bits = [0.0; N_GROUPS];
        let mut term = R::ZERO;
        for block in self.blocks() {
            term += block.coded.mask_term;
            for (sum, bits) in bits.iter_mut().zip(block.coded.bits) {
                *sum += bits;
            }
        }
        term += R::real(bit * bits.iter().sum::<f64>());
        let mut gradients = self.context_gradients(network);
        if terms.grid > 0.0 {
            let weight = terms.lambda * terms.grid / (n_anchors.max(1) as f64 * n_channels);
            term += R::real(weight * grid_bits::forward_backward(&network.model.rows, weight, &mut gradients.rows));
        }
        self.d_context = Some(gradients);
        let per_anchor = bits.map(|bits| bits / n_sampled.max(1) as f64);
        (term, RateReport { n_sampled, bits: per_anchor })
    }

    /// Adds up the blocks' gradients in block order, and takes those of the grid's features to its rows.
    fn context_gradients(&mut self, network: Network<'_, R>) -> ContextGradients<R> {
        let kept = self.d_context.take().filter(|kept| kept.rows.len() == network.model.rows.len());
        let mut gradients = kept.unwrap_or_else(|| ContextGradients {
            rows: vec![R::ZERO; network.model.rows.len()],
            networks: network.whole.iter().map(|network| network.map(|_| R::ZERO)).collect(),
        });
        for (level, sums) in gradients.networks.iter_mut().enumerate() {
            self.add_up(level, sums);
        }
        let parts: Vec<Part<'_, R>> =
            self.blocks().iter().map(|b| Part { units: &b.coded.units, d_features: &b.coded.d_inputs }).collect();
        hash_grid::backward(&network.model.levels, &network.model.rows, &parts, &mut gradients.rows);
        gradients
    }

    /// Adds up the blocks' gradients of the network of one level.
    fn add_up(&self, level: usize, sums: &mut ContextNetwork<R>) {
        let blocks = || self.blocks().iter().filter(|block| block.coded.anchor_level == level);
        let first = sums.mlp.n_out - N_GROUPS;
        let firsts = [0, 0, first * sums.mlp.n_hidden, first];
        for (g, (sum, first)) in sums.mlp.groups_mut().into_iter().zip(firsts).enumerate() {
            sum.fill(R::ZERO);
            for block in blocks() {
                let parts = [(0, &block.coded.d_whole), (first, &block.coded.d_steps_head)];
                for (first, part) in parts.into_iter().filter_map(|(first, head)| Some((first, head.as_ref()?))) {
                    for (sum, part) in sum[first..].iter_mut().zip(part.groups()[g]) {
                        *sum += *part;
                    }
                }
            }
        }
        sums.taps.fill(R::ZERO);
        for block in blocks() {
            sums.taps.iter_mut().zip(&block.coded.d_taps).for_each(|(sum, part)| *sum += *part);
        }
    }
}
