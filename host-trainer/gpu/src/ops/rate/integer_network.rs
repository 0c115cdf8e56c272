//! A context network in the decoder's integers: [`pocketsplat_kernels::integer_model`], and `decoder-format`'s `context`.

use bytemuck::{Pod, Zeroable};
use pocketsplat_format::context::{Group, MAX_STEP_EXPONENT, MIN_STEP_EXPONENT, N_GROUPS, Steps};

use crate::ops::heads::head::HeadLayout;
use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel};

/// Its kernels.
#[derive(Clone, Debug)]
pub struct IntegerNetwork {
    round: Kernel,
    hidden: Kernel,
    outputs: Kernel,
    steps: Kernel,
}

/// A network's integers, and what they stand for.
#[derive(Debug)]
pub struct Integers {
    /// As the parameters, taps included: the floats that the integers are.
    pub rounded: Buffer<f32>,
    /// As the parameters without the taps; biases with the half that rounds.
    integers: Buffer<i32>,
    /// `[n_hidden + n_out]`.
    shifts: Buffer<i32>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_items: u32,
    n_in: u32,
    n_hidden: u32,
    n_out: u32,
    n_means: u32,
    first_output: u32,
    n_asked: u32,
}

impl Parameters {
    fn new(layout: &HeadLayout, n_items: usize) -> Self {
        Self {
            n_items: n_items as u32,
            n_in: layout.n_in as u32,
            n_hidden: layout.n_hidden as u32,
            n_out: layout.n_out as u32,
            // A mean and a scale of each channel, then the steps.
            n_means: (layout.n_out - N_GROUPS) as u32 / 2,
            first_output: 0,
            n_asked: layout.n_out as u32,
        }
    }
}

impl Integers {
    /// Room for those of a network.
    ///
    /// * `n_parameters`: taps included.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn zeros(gpu: &Gpu, layout: &HeadLayout, n_parameters: usize) -> Result<Self, GpuError> {
        Ok(Self {
            rounded: Buffer::zeros(gpu, "what the integers of the context network stand for", n_parameters)?,
            integers: Buffer::zeros(gpu, "integers of the context network", layout.n_params())?,
            shifts: Buffer::zeros(gpu, "shifts of the context network", layout.n_hidden + layout.n_out)?,
        })
    }
}

/// `[32, 3]`: the steps of all exponents, from the smallest on.
pub fn table_of_steps(base_steps: [f32; N_GROUPS]) -> Vec<f32> {
    let exponents = MIN_STEP_EXPONENT as i16..=MAX_STEP_EXPONENT as i16;
    let steps = exponents.map(|exponent| Steps::new(base_steps, [exponent; N_GROUPS]));
    steps.flat_map(|steps| Group::ALL.map(|group| steps.value(group))).collect()
}

impl IntegerNetwork {
    /// Compiles the kernels.
    pub fn new(gpu: &Gpu) -> Self {
        const LAYOUT: &str = include_str!("integer_network/layout.wgsl");
        let kernel = |name, source| Kernel::new(gpu, name, &[GROUPS, LAYOUT, source]);
        Self {
            round: kernel("integer network: round", include_str!("integer_network/round.wgsl")),
            hidden: kernel("integer network: hidden", include_str!("integer_network/hidden.wgsl")),
            outputs: kernel("integer network: outputs", include_str!("integer_network/outputs.wgsl")),
            steps: Kernel::new(gpu, "integer network: steps", &[GROUPS, include_str!("integer_network/steps.wgsl")]),
        }
    }

    /// The integers of a network. Those of a weight that does not fit end at the range; the writer of bundles refuses it.
    pub fn round(&self, commands: &mut Commands<'_>, layout: &HeadLayout, weights: &Buffer<f32>, into: &Integers) {
        let n_taps = weights.len() - layout.n_params();
        let n_items = layout.n_hidden + layout.n_out + n_taps;
        let buffers = [weights as _, &into.rounded as _, &into.integers as _, &into.shifts as _];
        commands.run_items(&self.round, &Parameters::new(layout, n_items), &buffers, n_items);
    }

    /// Hidden units of rows of inputs.
    ///
    /// * `inputs`: `[n, n_in]`, as a hash grid gives them. * `units`: `[n, n_hidden]`.
    pub fn hidden(
        &self,
        commands: &mut Commands<'_>,
        layout: &HeadLayout,
        network: &Integers,
        inputs: &Buffer<f32>,
        units: &Buffer<i32>,
    ) {
        let buffers = [inputs as _, &network.integers as _, &network.shifts as _, units as _];
        commands.run_items(&self.hidden, &Parameters::new(layout, units.len()), &buffers, units.len());
    }

    /// Outputs from `first` on, in floats.
    ///
    /// * `units`: `[n, n_hidden]`. * `outputs`: `[n, n_out − first]`.
    pub fn outputs(
        &self,
        commands: &mut Commands<'_>,
        layout: &HeadLayout,
        network: &Integers,
        first: usize,
        units: &Buffer<i32>,
        outputs: &Buffer<f32>,
    ) {
        let n_asked = (layout.n_out - first) as u32;
        let all = Parameters::new(layout, outputs.len());
        let parameters = Parameters { first_output: first as u32, n_asked, ..all };
        let buffers = [units as _, &network.integers as _, &network.shifts as _, outputs as _];
        commands.run_items(&self.outputs, &parameters, &buffers, outputs.len());
    }

    /// The decoder's steps of exponents.
    ///
    /// * `table`: [`table_of_steps`]. * `exponents`, `steps`: `[n, 3]`.
    pub fn steps(
        &self,
        commands: &mut Commands<'_>,
        table: &Buffer<f32>,
        exponents: &Buffer<f32>,
        steps: &Buffer<f32>,
    ) {
        let n_values = exponents.len();
        commands.run_items(&self.steps, &(n_values as u32), &[exponents, table, steps], n_values);
    }
}

#[cfg(test)]
mod tests;
