//! A context network over the anchors of a view that have it: steps for all of them, distributions for a sample, and the way back.

use pocketsplat_format::context::N_GROUPS;

use super::anchors::rooms;
use super::context::DeviceNetwork;
use super::ops::heads::head::Head;
use super::ops::primitives::gather::Gather;
use super::ops::rate::adaptive_step::AdaptiveStep;
use super::ops::rate::integer_network::IntegerNetwork;
use super::ops::rate::sample::Sample;
use super::{Buffer, Commands, Gpu, GpuError};
use pocketsplat_kernels::ops::rate::noise::Stream;

/// Kernels that all passes share.
#[derive(Debug)]
pub(super) struct PassKernels {
    pub(super) head: Head,
    pub(super) integer_network: IntegerNetwork,
    pub(super) adaptive_step: AdaptiveStep,
    pub(super) gather: Gather,
}

/// What one network leaves for the way back.
#[derive(Debug)]
pub(super) struct NetworkPass {
    /// Which of its anchors are in the sample.
    pub(super) sample: Sample,
    /// `[n, n_in]`, for the caller to fill.
    pub(super) inputs: Buffer<f32>,
    pub(super) d_inputs: Buffer<f32>,
    hidden: Buffer<f32>,
    d_hidden: Buffer<f32>,
    /// log₂(step/base), `[n, 3]`.
    exponents: Buffer<f32>,
    d_exponents: Buffer<f32>,
    /// `[n, 3]`; the gradients are for the caller to fill.
    pub(super) steps: Buffer<f32>,
    pub(super) d_steps: Buffer<f32>,
    /// Inputs, hidden units and outputs of the sample, and their gradients; those of the outputs are for the caller to fill.
    sampled: [Buffer<f32>; 3],
    d_sampled: [Buffer<f32>; 3],
    /// Integer hidden units of all anchors, and of the sample; on integers alone.
    units: [Buffer<i32>; 2],
}

impl PassKernels {
    /// Compiles them.
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            head: Head::new(gpu)?,
            integer_network: IntegerNetwork::new(gpu),
            adaptive_step: AdaptiveStep::new(gpu),
            gather: Gather::new(gpu),
        })
    }
}

impl NetworkPass {
    /// Room, and the kernel of the sample.
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let room = |what| Buffer::zeros(gpu, what, 1);
        Ok(Self {
            sample: Sample::new(gpu)?,
            inputs: room("inputs of the context network")?,
            d_inputs: room("gradients of the context network's inputs")?,
            hidden: room("hidden units of the context network")?,
            d_hidden: room("gradients of the context network's hidden units")?,
            exponents: room("exponents of steps")?,
            d_exponents: room("gradients of exponents of steps")?,
            steps: room("steps of values")?,
            d_steps: room("gradients of steps")?,
            sampled: rooms(gpu, "what the context network makes of the sample")?,
            d_sampled: rooms(gpu, "gradients of the sample")?,
            units: rooms(gpu, "integer hidden units")?,
        })
    }

    /// Chooses the sample among its anchors. Returns their number, for which it waits.
    pub(super) fn choose(
        &mut self,
        gpu: &Gpu,
        stream: Stream,
        share: f64,
        view_weights: &Buffer<f32>,
        anchors: &Buffer<u32>,
    ) -> Result<usize, GpuError> {
        self.sample.run(gpu, Commands::new(gpu), stream, share, view_weights, anchors)
    }

    /// Makes room for `n` anchors and the sample that was chosen.
    pub(super) fn fit(&mut self, gpu: &Gpu, network: &DeviceNetwork, n: usize) -> Result<(), GpuError> {
        let (layout, n_sampled) = (&network.layout, self.sample.rows.items.len());
        for inputs in [&mut self.inputs, &mut self.d_inputs] {
            inputs.fit(gpu, n * layout.n_in)?;
        }
        for hidden in [&mut self.hidden, &mut self.d_hidden] {
            hidden.fit(gpu, n * layout.n_hidden)?;
        }
        for steps in [&mut self.exponents, &mut self.d_exponents, &mut self.steps, &mut self.d_steps] {
            steps.fit(gpu, N_GROUPS * n)?;
        }
        let widths = [layout.n_in, layout.n_hidden, layout.n_out];
        for ((values, gradients), width) in self.sampled.iter_mut().zip(&mut self.d_sampled).zip(widths) {
            values.fit(gpu, n_sampled * width)?;
            gradients.fit(gpu, n_sampled * width)?;
        }
        Ok(())
    }

    /// Predicts the steps, from the inputs.
    pub(super) fn steps(
        &self,
        commands: &mut Commands<'_>,
        kernels: &PassKernels,
        network: &DeviceNetwork,
        base_steps: [f32; N_GROUPS],
        on_integers: bool,
    ) {
        let of_steps = network.layout.last_outputs(N_GROUPS);
        let weights = network.asked(on_integers);
        kernels.head.forward(commands, &of_steps, weights, &self.inputs, &self.hidden, &self.exponents);
        kernels.adaptive_step.forward(commands, base_steps, &self.exponents, &self.steps);
    }

    /// Puts what the integers say of steps and distributions in the place of what their floats say.
    ///
    /// * `table`: the steps of all exponents.
    pub(super) fn by_integers(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        kernels: &PassKernels,
        network: &DeviceNetwork,
        table: &Buffer<f32>,
    ) -> Result<(), GpuError> {
        let (layout, integers, ops) = (&network.layout, &network.integers, &kernels.integer_network);
        let [sampled_inputs, _, sampled_outputs] = &self.sampled;
        let rows = [
            (&self.inputs, self.hidden.len(), layout.n_out - N_GROUPS, &self.exponents),
            (sampled_inputs, self.sampled[1].len(), 0, sampled_outputs),
        ];
        for (units, (inputs, n_units, first, outputs)) in self.units.iter_mut().zip(rows) {
            units.fit(gpu, n_units)?;
            ops.hidden(commands, layout, integers, inputs, units);
            ops.outputs(commands, layout, integers, first, units, outputs);
        }
        ops.steps(commands, table, &self.exponents, &self.steps);
        Ok(())
    }

    /// Predicts the distributions of the sample.
    pub(super) fn distributions(
        &self,
        commands: &mut Commands<'_>,
        kernels: &PassKernels,
        network: &DeviceNetwork,
        on_integers: bool,
    ) {
        let (layout, weights) = (&network.layout, network.asked(on_integers));
        let [inputs, hidden, outputs] = &self.sampled;
        kernels.gather.run(commands, &self.inputs, layout.n_in, &self.sample.rows.items, inputs);
        kernels.head.forward(commands, layout, weights, inputs, hidden, outputs);
    }

    /// `[n_sampled, 2C + 3]` what the network says of the sample, and its gradient.
    pub(super) fn outputs(&self) -> [&Buffer<f32>; 2] {
        [&self.sampled[2], &self.d_sampled[2]]
    }

    /// From the gradients of steps and outputs to those of the network, which are added to, and of its inputs.
    pub(super) fn backward(
        &self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        kernels: &mut PassKernels,
        network: &DeviceNetwork,
        on_integers: bool,
    ) -> Result<(), GpuError> {
        let (layout, weights, gradient) = (&network.layout, network.asked(on_integers), &network.gradient);
        commands.clear(&self.d_exponents);
        kernels.adaptive_step.backward(commands, &self.exponents, &self.steps, &self.d_steps, &self.d_exponents);
        commands.clear(&self.d_inputs);
        kernels.head.backward(
            gpu,
            commands,
            &layout.last_outputs(N_GROUPS),
            weights,
            &self.inputs,
            &self.hidden,
            &self.d_exponents,
            &self.d_hidden,
            &self.d_inputs,
            gradient,
        )?;
        let [inputs, hidden, _] = &self.sampled;
        let [d_inputs, d_hidden, d_outputs] = &self.d_sampled;
        commands.clear(d_inputs);
        kernels
            .head
            .backward(gpu, commands, layout, weights, inputs, hidden, d_outputs, d_hidden, d_inputs, gradient)?;
        kernels.gather.add_back(commands, d_inputs, layout.n_in, &self.sample.rows.items, &self.d_inputs);
        Ok(())
    }
}
