//! [`pocketsplat_kernels::ops::heads::head`] in tiled products.

use bytemuck::{Pod, Zeroable};

use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel};
use pocketsplat_kernels::scene;

/// Rows and columns of a product that one workgroup makes.
const TILE: [usize; 2] = [64, 16];

/// Most parts that a sum over rows is cut into, and the fewest rows of one.
const MAX_PARTS: usize = 256;
const MIN_PART_ROWS: usize = 256;

/// Widths of a head, and where its groups lie in an array of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HeadLayout {
    /// Inputs.
    pub n_in: usize,
    /// Hidden units.
    pub n_hidden: usize,
    /// Outputs.
    pub n_out: usize,
    /// Where W1 `[n_hidden, n_in]`, b1, W2 `[n_out, n_hidden]` and b2 start.
    pub first: [usize; 4],
}

impl HeadLayout {
    /// The groups of a head in file order, one after the other.
    pub fn of<R>(head: &scene::Head<R>) -> Self {
        let scene::Head { n_in, n_hidden, n_out, .. } = *head;
        let b1 = n_hidden * n_in;
        let w2 = b1 + n_hidden;
        Self { n_in, n_hidden, n_out, first: [0, b1, w2, w2 + n_out * n_hidden] }
    }

    /// Number of parameters.
    pub fn n_params(&self) -> usize {
        self.first[3] + self.n_out
    }

    /// The head that has the last `n` outputs alone.
    #[must_use]
    pub fn last_outputs(&self, n: usize) -> Self {
        let left_out = self.n_out - n;
        let [w1, b1, w2, b2] = self.first;
        Self { n_out: n, first: [w1, b1, w2 + left_out * self.n_hidden, b2 + left_out], ..*self }
    }

    /// W and b of the first or the second layer, its inputs and its outputs.
    fn layer(&self, second: bool) -> [usize; 4] {
        let [w1, b1, w2, b2] = self.first;
        if second { [w2, b2, self.n_hidden, self.n_out] } else { [w1, b1, self.n_in, self.n_hidden] }
    }
}

/// The parameters of all groups of a head, in file order: what its buffer holds.
pub fn parameters_of(head: &scene::Head<f32>) -> Vec<f32> {
    head.groups().concat()
}

/// Its kernels, and the sums of parts of the rows.
#[derive(Debug)]
pub struct Head {
    layer: Kernel,
    to_hidden: Kernel,
    to_input: Kernel,
    parts_of_weights: Kernel,
    sum: Kernel,
    parts: Buffer<f32>,
}

/// What a product is told, and the sum of its parts; `head/parameters.wgsl` has the same.
#[derive(Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
struct Product {
    n_rows: u32,
    n_columns: u32,
    depth: u32,
    /// Values from one row of the input to the next.
    input_stride: u32,
    first_weight: u32,
    first_bias: u32,
    is_rectified: u32,
    /// Rows of the input that one workgroup adds up.
    part_rows: u32,
    n_parts: u32,
}

impl Head {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        const PARAMETERS: &str = include_str!("head/parameters.wgsl");
        const PRODUCT: &str = include_str!("head/product.wgsl");
        const BACK: &str = include_str!("head/back.wgsl");
        let kernel = |name, source| Kernel::new(gpu, name, &[GROUPS, PARAMETERS, PRODUCT, source]);
        let back = |name, source| Kernel::new(gpu, name, &[GROUPS, PARAMETERS, PRODUCT, BACK, source]);
        Ok(Self {
            layer: kernel("head: layer", include_str!("head/layer.wgsl")),
            to_hidden: back("head: to hidden", include_str!("head/to_hidden.wgsl")),
            to_input: back("head: to input", include_str!("head/to_input.wgsl")),
            parts_of_weights: kernel("head: weights", include_str!("head/weights.wgsl")),
            sum: Kernel::new(gpu, "head: sum", &[GROUPS, PARAMETERS, include_str!("head/sum.wgsl")]),
            parts: Buffer::zeros(gpu, "parts of gradients of weights", 1)?,
        })
    }

    /// `y = W2·relu(W1·x + b1) + b2` for each row.
    ///
    /// * `weights`: all parameters. * `input`: `[n, ≥ n_in]`. * `hidden`: `[n, n_hidden]`, overwritten with relu(W1·x + b1).
    /// * `output`: `[n, n_out]`, overwritten.
    pub fn forward(
        &self,
        commands: &mut Commands<'_>,
        head: &HeadLayout,
        weights: &Buffer<f32>,
        input: &Buffer<f32>,
        hidden: &Buffer<f32>,
        output: &Buffer<f32>,
    ) {
        let n_rows = hidden.len() / head.n_hidden;
        for (second, from, to) in [(false, input, hidden), (true, hidden, output)] {
            let [first_weight, first_bias, depth, n_columns] = head.layer(second);
            let parameters = Product {
                n_rows: n_rows as u32,
                n_columns: n_columns as u32,
                depth: depth as u32,
                input_stride: stride(from, n_rows),
                first_weight: first_weight as u32,
                first_bias: first_bias as u32,
                is_rectified: u32::from(!second),
                ..Product::default()
            };
            commands.run(&self.layer, &parameters, &[from, weights, to], n_tiles(n_rows, n_columns));
        }
    }

    /// Gradients of [`Self::forward`], added to `d_input` and `d_weights`.
    ///
    /// Rows are summed in parts of equal size, the parts one after the other.
    ///
    /// * `input`, `hidden`: as forward left them. * `d_hidden`: scratch `[n, n_hidden]`. * `d_input`: as `input`.
    /// * `d_weights`: as `weights`.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    #[expect(clippy::too_many_arguments, reason = "what the kernels are bound to")]
    pub fn backward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        head: &HeadLayout,
        weights: &Buffer<f32>,
        input: &Buffer<f32>,
        hidden: &Buffer<f32>,
        d_output: &Buffer<f32>,
        d_hidden: &Buffer<f32>,
        d_input: &Buffer<f32>,
        d_weights: &Buffer<f32>,
    ) -> Result<(), GpuError> {
        let n_rows = hidden.len() / head.n_hidden;
        let through = |second: bool| {
            let [first_weight, first_bias, n_columns, depth] = head.layer(second);
            Product {
                n_rows: n_rows as u32,
                n_columns: n_columns as u32,
                depth: depth as u32,
                input_stride: stride(input, n_rows),
                first_weight: first_weight as u32,
                first_bias: first_bias as u32,
                ..Product::default()
            }
        };
        let n_groups = n_tiles(n_rows, head.n_hidden);
        commands.run(&self.to_hidden, &through(true), &[d_output, weights, hidden, d_hidden], n_groups);
        commands.run(&self.to_input, &through(false), &[d_hidden, weights, d_input], n_tiles(n_rows, head.n_in));
        let layers = [(through(true), hidden, d_output), (through(false), input, d_hidden)];
        for (layer, from, d_to) in layers {
            // W has a row for each output, and a column for each input and for the bias.
            let (n_outputs, n_columns) = (layer.depth as usize, layer.n_columns as usize + 1);
            let part_rows = n_rows.div_ceil(MAX_PARTS).max(MIN_PART_ROWS);
            let n_parts = n_rows.div_ceil(part_rows);
            self.parts.fit(gpu, n_parts * n_outputs * n_columns)?;
            let parameters = Product {
                n_rows: n_outputs as u32,
                n_columns: n_columns as u32,
                depth: n_rows as u32,
                input_stride: stride(from, n_rows),
                part_rows: part_rows as u32,
                n_parts: n_parts as u32,
                ..layer
            };
            let n_groups = n_parts * n_tiles(n_outputs, n_columns);
            commands.run(&self.parts_of_weights, &parameters, &[d_to, from, &self.parts], n_groups);
            commands.run_items(&self.sum, &parameters, &[&self.parts, d_weights], n_outputs * n_columns);
        }
        Ok(())
    }
}

/// Values from one row to the next.
fn stride(rows: &Buffer<f32>, n_rows: usize) -> u32 {
    (rows.len() / n_rows.max(1)) as u32
}

fn n_tiles(n_rows: usize, n_columns: usize) -> usize {
    n_rows.div_ceil(TILE[0]) * n_columns.div_ceil(TILE[1])
}

#[cfg(test)]
mod tests;
