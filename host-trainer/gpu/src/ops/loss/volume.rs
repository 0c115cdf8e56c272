//! [`pocketsplat_kernels::ops::loss::volume`] over slots.

use bytemuck::{Pod, Zeroable};

use crate::ops::primitives::sum::Sum;
use crate::{Buffer, Commands, GROUP_THREADS, GROUPS, Gpu, GpuError, Kernel, RECORDS};
use pocketsplat_kernels::ops::heads::neural_gaussians::Gaussian;

/// Its kernels, and the sums of workgroups.
#[derive(Debug)]
pub struct Volume {
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
    weight: f32,
}

impl Volume {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let with = |source| [GROUPS, RECORDS, include_str!("volume/parameters.wgsl"), source];
        Ok(Self {
            forward: Kernel::new(gpu, "volume", &with(include_str!("volume/forward.wgsl"))),
            backward: Kernel::new(gpu, "volume backward", &with(include_str!("volume/backward.wgsl"))),
            sum: Sum::new(gpu),
            parts: Buffer::zeros(gpu, "sums of volumes", 1)?,
        })
    }

    /// Writes `Σ s_x·s_y·s_z` and the number of Gaussians to `totals` from `first_total` on. The number is exact up to 2²⁴.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn forward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        gaussians: &Buffer<Gaussian<f32>>,
        totals: &Buffer<f32>,
        first_total: usize,
    ) -> Result<(), GpuError> {
        let n_groups = gaussians.len().div_ceil(GROUP_THREADS);
        self.parts.fit(gpu, 2 * n_groups)?;
        let parameters = Parameters { n_slots: gaussians.len() as u32, first_total: first_total as u32, weight: 0.0 };
        commands.run(&self.forward, &parameters, &[gaussians, &self.parts], n_groups);
        self.sum.run(commands, &self.parts, 2, totals, first_total);
        Ok(())
    }

    /// Adds the gradient of `weight · mean(s_x·s_y·s_z)` to the scales of `d_gaussians`, after [`Self::forward`].
    pub fn backward(
        &self,
        commands: &mut Commands<'_>,
        gaussians: &Buffer<Gaussian<f32>>,
        weight: f32,
        totals: &Buffer<f32>,
        first_total: usize,
        d_gaussians: &Buffer<Gaussian<f32>>,
    ) {
        let parameters = Parameters { n_slots: gaussians.len() as u32, first_total: first_total as u32, weight };
        commands.run_items(&self.backward, &parameters, &[gaussians, totals, d_gaussians], gaussians.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::{Bound, SIZES, assert_close, gpu};
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::ops::loss::volume as cpu;

    /// Bounds: a product of three in either order is known to 2e-7, a sum of n positive ones to 1e-6; the number is exact.
    #[test]
    fn volume_agrees_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        for n in SIZES.into_iter().chain([70_000]) {
            let slots: Vec<Gaussian<f32>> = random(2, 4 * n)
                .chunks_exact(4)
                .map(|v| match v[3] < -0.3 {
                    true => Gaussian::default(),
                    false => Gaussian {
                        scale: std::array::from_fn(|i| (6.0 * v[i]).exp() as f32),
                        opacity: (v[3] + 0.31) as f32,
                        ..Gaussian::default()
                    },
                })
                .collect();
            let gaussians: Vec<_> = slots.iter().filter(|g| g.opacity > 0.0).copied().collect();
            let weight = 0.01;
            let before = Gaussian { scale: [0.25; 3], ..Gaussian::default() };
            let mut d_expected = vec![before; gaussians.len()];
            cpu::backward(&gaussians, weight, gaussians.len(), &mut d_expected);
            // In f64: one running sum in f32 loses more than the kernel.
            let wide = |g: &Gaussian<f32>| Gaussian { scale: g.scale.map(f64::from), ..Gaussian::default() };
            let wide: Vec<Gaussian<f64>> = gaussians.iter().map(wide).collect();
            let expected = cpu::forward(&wide, 1.0, 1);

            let sources = Buffer::upload(gpu, "Gaussians", &slots).expect("room");
            let d_gaussians = Buffer::upload(gpu, "gradients", &vec![before; n]).expect("room");
            let totals = Buffer::upload(gpu, "totals", &[7.0; 3]).expect("room");
            let mut volume = Volume::new(gpu).expect("room");
            let mut commands = Commands::new(gpu);
            volume.forward(gpu, &mut commands, &sources, &totals, 1).expect("room");
            volume.backward(&mut commands, &sources, weight, &totals, 1, &d_gaussians);
            commands.submit().expect("runs");
            let found = totals.read(gpu).expect("runs");
            assert_eq!((found[0], found[2]), (7.0, gaussians.len() as f32));
            let of_sum = Bound { relative: 1e-6, absolute: 0.0 };
            assert_close("sum", &[found[1]], &[expected as f32], of_sum);
            let d_found = d_gaussians.read(gpu).expect("runs");
            let drawn = slots.iter().zip(&d_found).filter(|(g, _)| g.opacity > 0.0).map(|(_, d)| d);
            for (found, expected) in drawn.zip(&d_expected) {
                assert_close("gradient", &found.scale, &expected.scale, Bound { relative: 2e-6, absolute: 0.0 });
            }
        }
    }
}
