//! What coding does to the values of a view's anchors, and their rate: the order of `step/coded.rs` and `step/context.rs`.

use pocketsplat_format::context::{N_GROUPS, N_LEVELS};

use super::anchors::rooms;
use super::levels::GpuLevels;
use super::network_pass::{NetworkPass, PassKernels};
use super::ops::heads::mask::Mask;
use super::ops::rate::anchor_bits::{self, AnchorBits, Sampled};
use super::ops::rate::grid_bits::GridBits;
use super::ops::rate::hash_grid::HashGrid;
use super::ops::rate::perturb::Perturb;
use super::scene::{DeviceScene, MASK_LOGITS};
use super::{Buffer, Commands, Gpu, GpuError};
use pocketsplat_kernels::ops::rate::noise::Stream;
use pocketsplat_kernels::step::coding::RateTerms;

mod rate;

use rate::Weights;

/// Its kernels, and what the last view was coded with.
#[derive(Debug)]
pub(super) struct GpuCoding {
    kernels: PassKernels,
    hash_grid: HashGrid,
    perturb: Perturb,
    anchor_bits: AnchorBits,
    mask: Mask,
    grid_bits: GridBits,
    levels: GpuLevels,
    /// The network's, with a grid.
    pass: NetworkPass,
    /// `[n, 3]` where not one network has all anchors.
    steps: Buffer<f32>,
    d_steps: Buffer<f32>,
    /// Noise, in steps.
    residuals: [Buffer<f32>; N_GROUPS],
    /// `[n_anchors]` of the scene: 1 where one is drawn at all.
    drawn: Buffer<u32>,
    weights: Weights,
    n_sampled: usize,
}

/// Sums of [`GpuCoding::backward`]: openings of masks, then bits of each network's anchors.
pub(super) const N_RATE_TOTALS: usize = 1 + N_LEVELS * N_GROUPS;

impl GpuCoding {
    /// Compiles all kernels.
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            kernels: PassKernels::new(gpu)?,
            hash_grid: HashGrid::new(gpu),
            perturb: Perturb::new(gpu),
            anchor_bits: AnchorBits::new(gpu)?,
            mask: Mask::new(gpu)?,
            grid_bits: GridBits::new(gpu)?,
            levels: GpuLevels::new(gpu)?,
            pass: NetworkPass::new(gpu)?,
            steps: Buffer::zeros(gpu, "steps of the view's values", 1)?,
            d_steps: Buffer::zeros(gpu, "gradients of steps", 1)?,
            residuals: rooms(gpu, "noise of the view's values")?,
            drawn: Buffer::zeros(gpu, "anchors that are drawn at all", 1)?,
            weights: Weights::default(),
            n_sampled: 0,
        })
    }

    /// Forgets the scene that it worked on.
    pub(super) fn forget(&mut self) {
        self.levels.forget();
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
        self.kernels.adaptive_step.fixed(commands, steps, &self.steps);
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
        let steps = if follows_grid(scene) { &self.pass.steps } else { &self.steps };
        for (group, (values, residuals)) in scene.coded_groups().into_iter().zip(values.iter().zip(&mut self.residuals))
        {
            residuals.fit(gpu, values.len())?;
            if scene.on_integers {
                self.perturb.rounded(commands, group, steps, values, residuals);
            } else {
                self.perturb.with_noise(commands, stream, group, anchors, steps, values, residuals);
            }
        }
        Ok(())
    }

    /// Chooses the sample, predicts the steps of all anchors and the distributions of the sample, and adds noise of these steps to the
    /// values, or rounds them; waits for the sample's number and for what is drawn.
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
        let all_masks = &scene.anchors[MASK_LOGITS].values;
        let n_anchors = all_masks.len() / scene.shape.n_offsets;
        self.drawn.fit(gpu, n_anchors)?;
        let mut commands = Commands::new(gpu);
        self.mask.mark_drawn(&mut commands, all_masks, scene.shape.n_offsets, &self.drawn);
        commands.submit()?;
        let drawn = self.drawn.ask(gpu);

        let (n_sampled, drawn) = match &context.grid {
            Some(grid) => {
                let (network, pass) = (&context.networks[0], &mut self.pass);
                let n_sampled = pass.choose(gpu, stream, terms.sample, &scene.view_weights, anchors)?;
                // There by now: nothing has been submitted since.
                let drawn = drawn.take(gpu)?;
                pass.fit(gpu, network, anchors.len())?;
                let mut commands = Commands::new(gpu);
                self.hash_grid.forward(&mut commands, &grid.places, &grid.rows.values, anchors, &pass.inputs);
                if scene.on_integers {
                    let (layout, parameters) = (&network.layout, &network.parameters.values);
                    self.kernels.integer_network.round(&mut commands, layout, parameters, &network.integers);
                }
                pass.steps(&mut commands, &self.kernels, network, context.base_steps, scene.on_integers);
                pass.distributions(&mut commands, &self.kernels, network, scene.on_integers);
                if scene.on_integers {
                    pass.by_integers(gpu, &mut commands, &self.kernels, network, &context.step_table)?;
                }
                commands.submit()?;
                (n_sampled, drawn)
            }
            None => {
                let drawn = drawn.take(gpu)?;
                self.levels.find(gpu, scene, &drawn)?;
                self.levels.give(gpu, scene, &self.kernels, &self.perturb, stream)?;
                self.steps.fit(gpu, N_GROUPS * anchors.len())?;
                let sample = (stream, terms.sample);
                let n_sampled = self.levels.forward(gpu, scene, &self.kernels, anchors, &self.steps, sample)?;
                (n_sampled, drawn)
            }
        };
        self.n_sampled = n_sampled;
        let mut commands = Commands::new(gpu);
        self.perturb_all(gpu, &mut commands, scene, anchors, values, stream)?;
        commands.submit()?;
        let n_drawn = drawn.iter().sum::<u32>() as usize;
        self.weights = Weights::of(terms, scene, [n_anchors, anchors.len(), n_drawn, n_sampled]);
        Ok(())
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
        let Weights { bit, mask, grid: of_grid } = self.weights;
        let anchor = if terms.masks_weigh_anchors { bit } else { 0.0 };
        for network in &context.networks {
            commands.clear(&network.gradient);
        }
        let [features, log_scales, offsets, mask_logits] = values;
        let [d_features, d_log_scales, d_offsets, d_mask_logits] = gradients;
        self.mask.term(gpu, commands, mask_logits, mask as f32, d_mask_logits, totals, first_total)?;
        let passes: Vec<(&NetworkPass, &Buffer<u32>)> = match &context.grid {
            Some(_) => vec![(&self.pass, &self.pass.sample.rows.items)],
            None => self.levels.passes().collect(),
        };
        for (level, ((pass, rows), network)) in passes.into_iter().zip(&context.networks).enumerate() {
            let [outputs, d_outputs] = pass.outputs();
            let sampled = Sampled {
                shape: &scene.shape,
                base_steps: context.base_steps,
                rows,
                values: [features, log_scales, offsets],
                mask_logits,
                outputs,
                n_taps: network.n_taps,
                weights: network.asked(scene.on_integers),
                first_tap: network.layout.n_params(),
            };
            let of_sample = anchor_bits::Gradients {
                values: [d_features, d_log_scales, d_offsets],
                mask_logits: d_mask_logits,
                outputs: d_outputs,
                weights: &network.gradient,
            };
            let first = first_total + 1 + N_GROUPS * level;
            let both = [bit, anchor].map(|weight| weight as f32);
            self.anchor_bits.forward_backward(gpu, commands, &sampled, both, &of_sample, totals, first)?;
        }

        self.d_steps.fit(gpu, N_GROUPS * n_of_view(values, scene))?;
        let d_steps = if context.grid.is_some() { &self.pass.d_steps } else { &self.d_steps };
        for (group, (d_values, residuals)) in
            scene.coded_groups().into_iter().zip(gradients.iter().zip(&self.residuals))
        {
            self.perturb.backward(commands, group, d_values, residuals, d_steps);
        }
        match &context.grid {
            Some(grid) => {
                self.pass.backward(gpu, commands, &mut self.kernels, &context.networks[0], scene.on_integers)?;
                let (places, rows, d_inputs) = (&grid.places, &grid.rows.values, &self.pass.d_inputs);
                self.hash_grid.backward(commands, places, rows, row_of_anchor, d_inputs, &grid.gradient);
                if of_grid > 0.0 {
                    self.grid_bits.forward_backward(commands, rows, of_grid, &grid.gradient);
                }
                Ok(())
            }
            None => self.levels.backward(gpu, commands, &mut self.kernels, &context.networks, &self.d_steps),
        }
    }
}

/// Whether one network has all anchors.
fn follows_grid(scene: &DeviceScene) -> bool {
    scene.context.as_ref().is_some_and(|context| context.grid.is_some())
}

/// Anchors of the view.
fn n_of_view(values: &[Buffer<f32>; 4], scene: &DeviceScene) -> usize {
    values[MASK_LOGITS].len() / scene.shape.n_offsets
}
