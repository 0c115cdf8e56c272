//! [`pocketsplat_kernels::ops::rate::grid_bits`].

use bytemuck::{Pod, Zeroable};

use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel, MATH};
use pocketsplat_kernels::ops::rate::grid_bits::MARGIN;

/// Its kernels, and the number of positive values.
#[derive(Debug)]
pub struct GridBits {
    count: Kernel,
    backward: Kernel,
    /// `[1]`: values from 0 on, from which [`bits`](pocketsplat_kernels::ops::rate::grid_bits::bits) follow.
    pub n_positive: Buffer<u32>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_values: u32,
    weight: f32,
    margin: f32,
}

impl GridBits {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let with = |source| [GROUPS, MATH, include_str!("grid_bits/parameters.wgsl"), source];
        let count = [GROUPS, include_str!("grid_bits/parameters.wgsl"), include_str!("grid_bits/count.wgsl")];
        Ok(Self {
            count: Kernel::new(gpu, "grid bits: count", &count),
            backward: Kernel::new(gpu, "grid bits", &with(include_str!("grid_bits/backward.wgsl"))),
            n_positive: Buffer::zeros(gpu, "positive values of the grid", 1)?,
        })
    }

    /// Counts the positive values of the grid, and adds `weight` times the gradient of its bits to `d_rows`.
    pub fn forward_backward(&self, commands: &mut Commands<'_>, rows: &Buffer<f32>, weight: f64, d_rows: &Buffer<f32>) {
        let parameters = Parameters { n_values: rows.len() as u32, weight: weight as f32, margin: MARGIN as f32 };
        commands.clear(&self.n_positive);
        commands.run_items(&self.count, &parameters, &[rows, &self.n_positive], rows.len());
        commands.run_items(&self.backward, &parameters, &[rows, &self.n_positive, d_rows], rows.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::{Bound, SIZES, assert_close, gpu};
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::ops::rate::grid_bits as cpu;

    /// Bounds: the count is exact; a logarithm of a quotient of f32 errs by 1e-6 of 1 and of itself, also where all signs are
    /// equal, because the rarer one's share is no difference.
    #[test]
    fn grid_bits_agree_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        let grid_bits = GridBits::new(gpu).expect("room");
        for (n, shift) in SIZES.into_iter().zip([0.0, 0.0, 0.3, 2.0, -2.0]).chain([(100_000, -0.9)]) {
            let mut rows: Vec<f32> = random(4, n).iter().map(|v| (v + shift) as f32).collect();
            if shift == 0.3 {
                rows[..4].copy_from_slice(&[0.0, -0.0, 1.0, 1.000_000_1]);
            }
            let mut expected = vec![0.5; n];
            let bits = cpu::forward_backward(&rows, 0.01, &mut expected);
            let there = Buffer::upload(gpu, "rows", &rows).expect("room");
            let d_rows = Buffer::upload(gpu, "gradients", &vec![0.5; n]).expect("room");
            let mut commands = Commands::new(gpu);
            grid_bits.forward_backward(&mut commands, &there, 0.01, &d_rows);
            commands.submit().expect("runs");
            let n_positive = grid_bits.n_positive.read(gpu).expect("runs")[0];
            assert_eq!(cpu::bits(n, n_positive as usize), bits, "{n} values");
            let bound = Bound { relative: 1e-6, absolute: 1e-8 };
            assert_close("gradient", &d_rows.read(gpu).expect("runs"), &expected, bound);
        }
    }
}
