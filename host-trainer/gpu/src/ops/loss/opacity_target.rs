//! [`pocketsplat_kernels::ops::loss::opacity_target`] over slots.

use bytemuck::{Pod, Zeroable};

use crate::ops::primitives::sum::Sum;
use crate::{Buffer, Commands, GROUP_THREADS, GROUPS, Gpu, GpuError, Kernel, RECORDS};
use pocketsplat_kernels::ops::heads::neural_gaussians::Gaussian;

/// Its kernels, and the sums of workgroups.
#[derive(Debug)]
pub struct OpacityTarget {
    forward: Kernel,
    backward: Kernel,
    sum: Sum,
    parts: Buffer<f32>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_slots: u32,
    first_total: u32,
    target: f32,
    slope: f32,
}

impl OpacityTarget {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let with = |source| [GROUPS, RECORDS, include_str!("opacity_target/parameters.wgsl"), source];
        Ok(Self {
            forward: Kernel::new(gpu, "opacity target", &with(include_str!("opacity_target/forward.wgsl"))),
            backward: Kernel::new(gpu, "opacity target backward", &with(include_str!("opacity_target/backward.wgsl"))),
            sum: Sum::new(gpu),
            parts: Buffer::zeros(gpu, "sums of opacities", 1)?,
        })
    }

    /// Writes Σα to `totals[first_total]`, and adds the gradient of `weight·(Σα − target)²/n_slots` to the opacities of `d_gaussians`.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    #[expect(clippy::too_many_arguments, reason = "what the kernels are bound to")]
    pub fn forward_backward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        gaussians: &Buffer<Gaussian<f32>>,
        target: f64,
        weight: f64,
        d_gaussians: &Buffer<Gaussian<f32>>,
        totals: &Buffer<f32>,
        first_total: usize,
    ) -> Result<(), GpuError> {
        let n_slots = gaussians.len();
        let n_groups = n_slots.div_ceil(GROUP_THREADS);
        self.parts.fit(gpu, n_groups)?;
        let parameters = Parameters {
            n_slots: n_slots as u32,
            first_total: first_total as u32,
            target: target as f32,
            slope: (2.0 * weight / n_slots.max(1) as f64) as f32,
        };
        commands.run(&self.forward, &parameters, &[gaussians, &self.parts], n_groups);
        self.sum.run(commands, &self.parts, 1, totals, first_total);
        commands.run_items(&self.backward, &parameters, &[gaussians, totals, d_gaussians], n_slots);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::{Bound, SIZES, assert_close, gpu};
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::ops::loss::opacity_target as cpu;

    /// Bounds: a sum of n opacities is known to 1e-6 of itself, Σα − T to 1e-6 of the larger of the two.
    #[test]
    fn the_opacity_target_agrees_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        for (n, target) in SIZES.into_iter().zip([0.0, 0.3, 60.0, 100.0, 900.0]) {
            let of = |v: &f64| Gaussian { opacity: if *v < 0.0 { 0.0 } else { *v as f32 }, ..Gaussian::default() };
            let gaussians: Vec<Gaussian<f32>> = random(2, n).iter().map(of).collect();
            let sum: f64 = gaussians.iter().map(|g| f64::from(g.opacity)).sum();
            let (_, slope) = cpu::forward_backward(sum, n, target, 0.7);
            let before = Gaussian { opacity: 0.25, ..Gaussian::default() };
            let sources = Buffer::upload(gpu, "Gaussians", &gaussians).expect("room");
            let d_gaussians = Buffer::upload(gpu, "gradients", &vec![before; n]).expect("room");
            let totals = Buffer::upload(gpu, "totals", &[7.0; 2]).expect("room");
            let mut term = OpacityTarget::new(gpu).expect("room");
            let mut commands = Commands::new(gpu);
            term.forward_backward(gpu, &mut commands, &sources, target, 0.7, &d_gaussians, &totals, 1).expect("room");
            commands.submit().expect("runs");
            let of_sum = Bound { relative: 1e-6, absolute: 1e-7 };
            assert_close("sum", &totals.read(gpu).expect("runs"), &[7.0, sum as f32], of_sum);
            let d_found: Vec<f32> = d_gaussians.read(gpu).expect("runs").iter().map(|d| d.opacity).collect();
            let expected: Vec<f32> =
                gaussians.iter().map(|g| if g.opacity > 0.0 { 0.25 + slope as f32 } else { 0.25 }).collect();
            let bound = Bound { relative: 1e-6, absolute: 3e-6 * (sum + target) / n.max(1) as f64 };
            assert_close("gradient", &d_found, &expected, bound);
        }
    }
}
