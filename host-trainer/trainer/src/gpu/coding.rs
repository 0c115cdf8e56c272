//! What coding does to the values of a view's anchors, and their rate: the order of `step/coded.rs` and `step/context.rs`, where the
//! context is a grid.

use pocketsplat_core::context::N_GROUPS;

use super::anchors::rooms;
use super::ops::adaptive_step::AdaptiveStep;
use super::ops::anchor_bits::{self, AnchorBits, Sampled};
use super::ops::gather::Gather;
use super::ops::grid_bits::GridBits;
use super::ops::hash_grid::HashGrid;
use super::ops::head::Head;
use super::ops::mask::Mask;
use super::ops::perturb::{self, Perturb};
use super::ops::sample::Sample;
use super::scene::{DeviceScene, MASK_LOGITS};
use super::{Buffer, Commands, Gpu, GpuError};
use crate::ops::grid_bits;
use crate::ops::noise::Stream;
use crate::step::SAMPLE_DRAW;
use crate::step::coding::{RateReport, RateTerms};

/// Weights of a step's rate terms; see `step/context.rs`.
#[derive(Clone, Copy, Debug, Default)]
struct Weights {
    bit: f64,
    mask: f64,
    grid: f64,
}

/// Its kernels, and what the last view was coded with.
#[derive(Debug)]
pub(super) struct GpuCoding {
    hash_grid: HashGrid,
    head: Head,
    adaptive_step: AdaptiveStep,
    perturb: Perturb,
    sample: Sample,
    gather: Gather,
    anchor_bits: AnchorBits,
    mask: Mask,
    grid_bits: GridBits,
    inputs: Buffer<f32>,
    d_inputs: Buffer<f32>,
    hidden: Buffer<f32>,
    d_hidden: Buffer<f32>,
    /// log₂(step/base) and steps, `[n, 3]`, and their gradients.
    exponents: Buffer<f32>,
    d_exponents: Buffer<f32>,
    steps: Buffer<f32>,
    d_steps: Buffer<f32>,
    /// Noise, in steps.
    residuals: [Buffer<f32>; N_GROUPS],
    /// The same of the sample: inputs, hidden units, outputs.
    sampled: [Buffer<f32>; 3],
    d_sampled: [Buffer<f32>; 3],
    n_drawn: Buffer<u32>,
    weights: Weights,
}

/// What a view's rate came to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rate {
    /// The terms of the loss.
    pub(super) term: f32,
    pub(super) report: RateReport,
}

/// Sums of [`GpuCoding::backward`]: openings of masks, then bits.
pub(super) const N_RATE_TOTALS: usize = 1 + N_GROUPS;

/// Which values are features, log-scales, offsets.
fn groups(scene: &DeviceScene) -> [perturb::Group; N_GROUPS] {
    let [features, log_scales, offsets, _] = scene.widths();
    [
        perturb::Group { index: 0, first: 0, width: features },
        perturb::Group { index: 1, first: features, width: log_scales },
        perturb::Group { index: 2, first: features + log_scales, width: offsets },
    ]
}

impl GpuCoding {
    /// Compiles all kernels.
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let room = |what| Buffer::zeros(gpu, what, 1);
        Ok(Self {
            hash_grid: HashGrid::new(gpu),
            head: Head::new(gpu)?,
            adaptive_step: AdaptiveStep::new(gpu),
            perturb: Perturb::new(gpu),
            sample: Sample::new(gpu)?,
            gather: Gather::new(gpu),
            anchor_bits: AnchorBits::new(gpu)?,
            mask: Mask::new(gpu)?,
            grid_bits: GridBits::new(gpu)?,
            inputs: room("inputs of the context network")?,
            d_inputs: room("gradients of the context network's inputs")?,
            hidden: room("hidden units of the context network")?,
            d_hidden: room("gradients of the context network's hidden units")?,
            exponents: room("exponents of steps")?,
            d_exponents: room("gradients of exponents of steps")?,
            steps: room("steps of the view's values")?,
            d_steps: room("gradients of steps")?,
            residuals: rooms(gpu, "noise of the view's values")?,
            sampled: rooms(gpu, "what the context network makes of the sample")?,
            d_sampled: rooms(gpu, "gradients of the sample")?,
            n_drawn: Buffer::zeros(gpu, "number of anchors that are drawn at all", 1)?,
            weights: Weights::default(),
        })
    }

    /// Adds noise of fixed steps to the values.
    ///
    /// * `anchors`: of the view. * `values`: `[n, width]`: features, log-scales, offsets, mask logits.
    pub(super) fn noise(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        scene: &DeviceScene,
        anchors: &Buffer<u32>,
        values: &[Buffer<f32>; 4],
        (stream, steps): (Stream, [f32; N_GROUPS]),
    ) -> Result<(), GpuError> {
        self.steps.fit(gpu, N_GROUPS * anchors.len())?;
        self.adaptive_step.fixed(commands, steps, &self.steps);
        self.perturb_all(gpu, commands, scene, anchors, values, stream)
    }

    fn perturb_all(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        scene: &DeviceScene,
        anchors: &Buffer<u32>,
        values: &[Buffer<f32>; 4],
        stream: Stream,
    ) -> Result<(), GpuError> {
        for (group, (values, residuals)) in groups(scene).into_iter().zip(values.iter().zip(&mut self.residuals)) {
            residuals.fit(gpu, values.len())?;
            self.perturb.with_noise(commands, stream, group, anchors, &self.steps, values, residuals);
        }
        Ok(())
    }

    /// Chooses the sample, predicts the steps of all anchors and the distributions of the sample, and adds noise of these steps to the
    /// values; waits for two numbers.
    pub(super) fn forward(
        &mut self,
        gpu: &Gpu,
        scene: &DeviceScene,
        anchors: &Buffer<u32>,
        values: &[Buffer<f32>; 4],
        stream: Stream,
        terms: &RateTerms,
    ) -> Result<(), GpuError> {
        let context = scene.context.as_ref().expect("asked before");
        let n = anchors.len();
        let mut commands = Commands::new(gpu);
        commands.clear(&self.n_drawn);
        let all_masks = &scene.anchors[MASK_LOGITS].values;
        self.mask.count_drawn(&mut commands, all_masks, scene.shape.n_offsets, &self.n_drawn);
        let n_sampled = self.sample.run(gpu, commands, stream, SAMPLE_DRAW, terms.sample, anchors)?;
        let n_drawn = self.n_drawn.read(gpu)?[0];
        let n_anchors = all_masks.len() / scene.shape.n_offsets;
        let n_values = (n_anchors.max(1) * scene.shape.values_per_anchor()) as f64;
        self.weights = Weights {
            bit: terms.lambda * f64::from(n_drawn) / (n_values * n_sampled.max(1) as f64),
            mask: terms.mask / (n * scene.shape.n_offsets).max(1) as f64,
            grid: terms.lambda * terms.grid / n_values,
        };

        let (layout, weights) = (&context.layout, &context.network.values);
        let of_steps = layout.last_outputs(N_GROUPS);
        self.inputs.fit(gpu, n * layout.n_in)?;
        self.hidden.fit(gpu, n * layout.n_hidden)?;
        self.exponents.fit(gpu, N_GROUPS * n)?;
        self.steps.fit(gpu, N_GROUPS * n)?;
        let widths = [layout.n_in, layout.n_hidden, layout.n_out];
        for (buffers, width) in self.sampled.iter_mut().zip(&mut self.d_sampled).zip(widths) {
            buffers.0.fit(gpu, n_sampled * width)?;
            buffers.1.fit(gpu, n_sampled * width)?;
        }
        let mut commands = Commands::new(gpu);
        self.hash_grid.forward(&mut commands, &context.places, &context.rows.values, anchors, &self.inputs);
        self.head.forward(&mut commands, &of_steps, weights, &self.inputs, &self.hidden, &self.exponents);
        self.adaptive_step.forward(&mut commands, context.base_steps, &self.exponents, &self.steps);
        let [inputs, hidden, outputs] = &self.sampled;
        self.gather.run(&mut commands, &self.inputs, layout.n_in, &self.sample.rows.items, inputs);
        self.head.forward(&mut commands, layout, weights, inputs, hidden, outputs);
        self.perturb_all(gpu, &mut commands, scene, anchors, values, stream)?;
        commands.submit()
    }

    /// Adds the rate's share to the gradients of the values, and takes all of them on to the network and the grid.
    ///
    /// * `row_of_anchor`: of the view. * `gradients`: as `values`. * `totals`: [`N_RATE_TOTALS`] from `first_total` on.
    #[expect(clippy::too_many_arguments, reason = "what the step is told, and its arrays")]
    pub(super) fn backward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        scene: &DeviceScene,
        row_of_anchor: &Buffer<u32>,
        values: &[Buffer<f32>; 4],
        gradients: &[Buffer<f32>; 4],
        terms: &RateTerms,
        (totals, first_total): (&Buffer<f32>, usize),
    ) -> Result<(), GpuError> {
        let context = scene.context.as_ref().expect("asked before");
        let (layout, weights, d_weights) = (&context.layout, &context.network.values, &context.d_network);
        let [features, log_scales, offsets, mask_logits] = values;
        let [d_features, d_log_scales, d_offsets, d_mask_logits] = gradients;
        let Weights { bit, mask, grid } = self.weights;
        commands.clear(d_weights);
        self.mask.term(gpu, commands, mask_logits, mask as f32, d_mask_logits, totals, first_total)?;
        let [inputs, hidden, outputs] = &self.sampled;
        let [d_sample_inputs, d_sample_hidden, d_outputs] = &self.d_sampled;
        let sampled = Sampled {
            shape: &scene.shape,
            base_steps: context.base_steps,
            rows: &self.sample.rows.items,
            values: [features, log_scales, offsets],
            mask_logits,
            outputs,
            n_taps: context.n_taps,
            weights,
            first_tap: layout.n_params(),
        };
        let of_sample = anchor_bits::Gradients {
            values: [d_features, d_log_scales, d_offsets],
            mask_logits: d_mask_logits,
            outputs: d_outputs,
            weights: d_weights,
        };
        let anchor = if terms.masks_weigh_anchors { bit } else { 0.0 };
        let both = [bit, anchor].map(|weight| weight as f32);
        self.anchor_bits.forward_backward(gpu, commands, &sampled, both, &of_sample, totals, first_total + 1)?;

        self.d_steps.fit(gpu, self.steps.len())?;
        self.d_exponents.fit(gpu, self.steps.len())?;
        self.d_inputs.fit(gpu, self.inputs.len())?;
        self.d_hidden.fit(gpu, self.hidden.len())?;
        for (group, (d_values, residuals)) in groups(scene).into_iter().zip(gradients.iter().zip(&self.residuals)) {
            self.perturb.backward(commands, group, d_values, residuals, &self.d_steps);
        }
        commands.clear(&self.d_exponents);
        self.adaptive_step.backward(commands, &self.exponents, &self.steps, &self.d_steps, &self.d_exponents);
        commands.clear(&self.d_inputs);
        let of_steps = layout.last_outputs(N_GROUPS);
        self.head.backward(
            gpu,
            commands,
            &of_steps,
            weights,
            &self.inputs,
            &self.hidden,
            &self.d_exponents,
            &self.d_hidden,
            &self.d_inputs,
            d_weights,
        )?;
        commands.clear(d_sample_inputs);
        self.head.backward(
            gpu,
            commands,
            layout,
            weights,
            inputs,
            hidden,
            d_outputs,
            d_sample_hidden,
            d_sample_inputs,
            d_weights,
        )?;
        self.gather.add_back(commands, d_sample_inputs, layout.n_in, &self.sample.rows.items, &self.d_inputs);
        let (rows, d_rows) = (&context.rows.values, &context.d_rows);
        self.hash_grid.backward(commands, &context.places, rows, row_of_anchor, &self.d_inputs, d_rows);
        if grid > 0.0 {
            self.grid_bits.forward_backward(commands, rows, grid, d_rows);
        }
        Ok(())
    }

    /// What the sums say of the rate; waits.
    ///
    /// * `totals`: the [`N_RATE_TOTALS`] that [`Self::backward`] wrote.
    pub(super) fn rate(&self, gpu: &Gpu, scene: &DeviceScene, totals: &[f32]) -> Result<Rate, GpuError> {
        let Weights { bit, mask, grid } = self.weights;
        let bits: [f64; N_GROUPS] = std::array::from_fn(|group| totals[1 + group].into());
        let mut term = mask * f64::from(totals[0]) + bit * bits.iter().sum::<f64>();
        if grid > 0.0 {
            let n = scene.context.as_ref().map_or(0, |context| context.rows.values.len());
            term += grid * grid_bits::bits(n, self.grid_bits.n_positive.read(gpu)?[0] as usize);
        }
        let n_sampled = self.sample.rows.items.len();
        #[expect(clippy::cast_possible_truncation, reason = "a term of the loss")]
        let term = term as f32;
        Ok(Rate { term, report: RateReport { n_sampled, bits: bits.map(|bits| bits / n_sampled.max(1) as f64) } })
    }
}
