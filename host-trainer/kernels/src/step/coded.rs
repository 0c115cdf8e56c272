//! The values of a block of anchors as coding leaves them, and their rate.

mod backward;

use pocketsplat_format::context::{Group, MEAN_PARTS, N_GROUPS, Steps};
use pocketsplat_format::entropy::EIGHTHS;

use super::coding::{Coding, IntegerModel};
use super::parents::{Parents, give_symbols, give_values};
use super::sample;
use crate::ops::heads::head;
use crate::ops::rate::noise::Stream;
use crate::ops::rate::{adaptive_step, anchor_bits, hash_grid, perturb};
use crate::ops::simd::Level;
use crate::real::Real;
use crate::scene::{ContextModel, ContextNetwork, Head, ModelShape, Scene};

/// The values of a block, or their gradients: `[n, F]`, `[n, 6]` or `[n, 4]`, `[n, 3K]`.
pub(super) type Values<'a, R> = [&'a mut Vec<R>; N_GROUPS];

/// The context networks of a step.
#[derive(Clone, Copy)]
pub(super) struct Network<'a, R> {
    pub(super) model: &'a ContextModel<R>,
    /// All outputs, by the level of the anchors: for the sample of the rate.
    pub(super) whole: &'a [ContextNetwork<R>],
    /// [`steps_of`] them: for every visible anchor.
    pub(super) steps: &'a [Head<R>],
}

/// Weights of a step's rate terms.
#[derive(Clone, Copy)]
pub(super) struct Weights<R> {
    /// Of a bit of the sample.
    pub(super) bit: R,
    /// The same where masks answer for the features and log-scales of their anchor, else 0.
    pub(super) anchor: R,
    /// Of the opening of one mask.
    pub(super) mask: R,
}

/// What coding did to a block, kept for the way back; buffers are kept from step to step.
#[derive(Clone, Debug, Default)]
pub(super) struct Coded<R> {
    /// The level that its anchors all have; 0 where the context is a grid.
    pub(super) anchor_level: usize,
    /// `[n]` places in the grid's cube.
    pub(super) units: Vec<[u16; 3]>,
    /// dL/d(grid features), `[n, 4·levels]`.
    pub(super) d_inputs: Vec<R>,
    /// Rows that are in the sample of the rate.
    pub(super) sampled: Vec<u32>,
    /// Bits of the sample.
    pub(super) bits: [f64; N_GROUPS],
    /// The mask term of the loss.
    pub(super) mask_term: R,
    /// dL/d(network): through the steps of all anchors, and through the distributions of the sample.
    pub(super) d_steps_head: Option<Head<R>>,
    pub(super) d_whole: Option<Head<R>>,
    /// dL/d(taps), empty without.
    pub(super) d_taps: Vec<R>,
    inputs: Vec<R>,
    hidden: Vec<R>,
    d_hidden: Vec<R>,
    /// log₂(step/base) `[n, 3]` as the network gives it, and the steps.
    exponents: Vec<R>,
    steps: Vec<R>,
    d_steps: Vec<R>,
    d_exponents: Vec<R>,
    /// Noise, or what rounding took, in steps.
    residuals: [Vec<R>; N_GROUPS],
    sample: Sample<R>,
}

/// The whole network's way for the anchors of the sample.
#[derive(Clone, Debug, Default)]
struct Sample<R> {
    inputs: Vec<R>,
    hidden: Vec<R>,
    outputs: Vec<R>,
    d_outputs: Vec<R>,
    d_hidden: Vec<R>,
    d_inputs: Vec<R>,
    d_drawn: Vec<R>,
    drawn: Vec<bool>,
    scratch: anchor_bits::Scratch<R>,
}

/// The network without its rows for means and scales.
pub(super) fn steps_of<R: Real>(network: &Head<R>) -> Head<R> {
    let first = network.n_out - N_GROUPS;
    Head {
        n_out: N_GROUPS,
        w1: network.w1.clone(),
        b1: network.b1.clone(),
        w2: network.w2[first * network.n_hidden..].to_vec(),
        b2: network.b2[first..].to_vec(),
        ..*network
    }
}

fn widths(shape: &ModelShape) -> [usize; N_GROUPS] {
    [shape.feature_dim, shape.n_log_scales(), 3 * shape.n_offsets]
}

impl<R: Real> Coded<R> {
    /// Puts coding's traces into the values of a block.
    ///
    /// * `network`: where `coding` asks the context. * `parents`: of all anchors. * `anchors`: of one level.
    #[expect(clippy::too_many_arguments, reason = "what a step and what a block is told")]
    pub(super) fn forward(
        &mut self,
        level: Level,
        scene: &Scene<R>,
        coding: &Coding<'_, R>,
        network: Option<Network<'_, R>>,
        parents: &Parents<R>,
        anchors: &[u32],
        values: Values<'_, R>,
    ) {
        self.sampled.clear();
        self.anchor_level = anchors.first().map_or(0, |anchor| parents.level(*anchor));
        let n = anchors.len();
        match (coding, network) {
            (Coding::Noise { stream, steps }, _) => {
                let steps = steps.map(|step| R::real(step.into()));
                self.steps.clear();
                self.steps.extend(std::iter::repeat_n(steps, n).flatten());
                self.perturb(level, &scene.shape, Some(*stream), anchors, values);
            }
            (Coding::Context { stream, rate, exact }, Some(network)) => {
                let is_sampled = |anchor: u32| sample::holds(*stream, anchor, rate.sample, &scene.anchors.view_weights);
                self.sampled.extend((0u32..).zip(anchors).filter_map(|(row, a)| is_sampled(*a).then_some(row)));
                self.predict(scene, network, parents, anchors);
                if let Some(exact) = exact {
                    self.predict_quantised(scene, exact, parents, anchors);
                }
                self.perturb(level, &scene.shape, exact.is_none().then_some(*stream), anchors, values);
            }
            (Coding::Integers { .. }, _) => unreachable!("of scenes that a device holds"),
            _ => {}
        }
    }

    /// Predicts the steps of all anchors and the distributions of the sample.
    fn predict(&mut self, scene: &Scene<R>, network: Network<'_, R>, parents: &Parents<R>, anchors: &[u32]) {
        let (model, n) = (network.model, anchors.len());
        let (steps_head, mlp) = (&network.steps[self.anchor_level], &network.whole[self.anchor_level].mlp);
        let lattice = anchors.iter().map(|a| scene.anchors.lattice[*a as usize]);
        self.units.clear();
        self.units.extend(lattice.map(|cell| model.frame.unit(cell)));
        let n_in = mlp.n_in;
        if model.shifts.is_some() {
            self.inputs.clear();
            anchors.iter().for_each(|anchor| parents.push_inputs(*anchor, &mut self.inputs));
        } else {
            self.inputs.resize(n * n_in, R::ZERO);
            hash_grid::forward(&model.levels, &model.rows, &self.units, &mut self.inputs);
        }
        self.hidden.resize(n * steps_head.n_hidden, R::ZERO);
        self.exponents.resize(n * N_GROUPS, R::ZERO);
        head::forward(steps_head, &self.inputs, &mut self.hidden, &mut self.exponents);
        self.steps.resize(n * N_GROUPS, R::ZERO);
        let base_steps = model.base_steps.map(|step| R::real(step.into()));
        adaptive_step::forward(base_steps, &self.exponents, &mut self.steps);

        let sample = &mut self.sample;
        sample.inputs.clear();
        for row in self.sampled.iter().map(|row| *row as usize) {
            sample.inputs.extend_from_slice(&self.inputs[row * n_in..(row + 1) * n_in]);
        }
        sample.hidden.resize(self.sampled.len() * mlp.n_hidden, R::ZERO);
        sample.outputs.resize(self.sampled.len() * mlp.n_out, R::ZERO);
        head::forward(mlp, &sample.inputs, &mut sample.hidden, &mut sample.outputs);
    }

    /// Puts what the integers say in the place of what the floats say.
    fn predict_quantised(
        &mut self,
        scene: &Scene<R>,
        exact: &IntegerModel<'_, R>,
        parents: &Parents<R>,
        anchors: &[u32],
    ) {
        let context = exact.context;
        let n_channels = scene.shape.values_per_anchor();
        let part = |output: i16, parts: i32| R::real(f64::from(output) / f64::from(parts));
        let (mut features, mut hidden) = (vec![0; context.n_inputs()], vec![0; context.n_hidden()]);
        let mut sampled = self.sampled.iter().zip(self.sample.outputs.chunks_exact_mut(context.n_outputs())).peekable();
        let rows = self.exponents.chunks_exact_mut(N_GROUPS).zip(self.steps.chunks_exact_mut(N_GROUPS));
        for ((row, anchor), (exponents, steps)) in (0u32..).zip(anchors).zip(rows) {
            let network = parents.enter(context, *anchor, scene.anchors.lattice[*anchor as usize], &mut features);
            network.hidden(&features, &mut hidden);
            let exact_steps = network.steps(&hidden);
            for (i, group) in Group::ALL.into_iter().enumerate() {
                exponents[i] = part(network.output(2 * n_channels + i, &hidden), EIGHTHS);
                steps[i] = R::real(exact_steps.value(group).into());
            }
            if let Some((_, outputs)) = sampled.next_if(|(sampled, _)| **sampled == row) {
                for (i, output) in outputs.iter_mut().enumerate() {
                    let parts = if i < n_channels { MEAN_PARTS } else { EIGHTHS };
                    *output = part(network.output(i, &hidden), parts);
                }
            }
        }
    }

    /// Writes what the block's anchors give those that follow them.
    ///
    /// * `values`: features and log-scales as [`Self::forward`] left them.
    pub(super) fn give(
        &self,
        model: &ContextModel<R>,
        rounded: bool,
        anchors: &[u32],
        values: [&[R]; 2],
        parents: &mut Parents<R>,
    ) {
        let n = anchors.len().max(1);
        let mut given = Vec::new();
        for (row, anchor) in anchors.iter().enumerate() {
            given.clear();
            // Eighths of an octave.
            #[expect(clippy::cast_possible_truncation, reason = "limited by the steps")]
            let exponent = |i: usize| (self.exponents[row * N_GROUPS + i].into() * f64::from(EIGHTHS)).round() as i16;
            let steps = Steps::new(model.base_steps, std::array::from_fn(exponent));
            for (i, (group, values)) in [Group::Feature, Group::LogScale].into_iter().zip(values).enumerate() {
                let width = values.len() / n;
                let values = &values[row * width..][..width];
                if rounded {
                    give_symbols(&steps, group, values, &mut given);
                } else {
                    give_values(model.base_steps[i], i, values, &mut given);
                }
            }
            parents.given_mut(*anchor).copy_from_slice(&given);
        }
    }

    /// Noise from `stream`, or rounding without.
    fn perturb(
        &mut self,
        level: Level,
        shape: &ModelShape,
        stream: Option<Stream>,
        anchors: &[u32],
        values: Values<'_, R>,
    ) {
        let mut first = 0u32;
        for (group, (values, width)) in values.into_iter().zip(widths(shape)).enumerate() {
            let residuals = &mut self.residuals[group];
            residuals.resize(values.len(), R::ZERO);
            let steps = &self.steps;
            level.run(
                #[inline(always)]
                || {
                    let rows = values.chunks_exact_mut(width).zip(residuals.chunks_exact_mut(width));
                    let rows = rows.zip(steps.chunks_exact(N_GROUPS)).zip(anchors);
                    for (((values, residuals), steps), anchor) in rows {
                        match stream {
                            Some(stream) => {
                                perturb::with_noise(stream.branch(*anchor), first, steps[group], values, residuals);
                            }
                            None => perturb::rounded(steps[group], values, residuals),
                        }
                    }
                },
            );
            first += u32::try_from(width).expect("a few hundred channels");
        }
    }
}
