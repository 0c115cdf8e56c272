//! [`crate::step::Difference`] from an 8-bit photograph: [`crate::ops::l1`] and [`crate::ops::rmse`].

use bytemuck::{Pod, Zeroable};

use super::sum::Sum;
use super::target::Target;
use crate::gpu::{Bind, Buffer, Commands, GROUP_THREADS, GROUPS, Gpu, GpuError, Kernel};
use crate::step::Difference;

/// Its kernels, and the sums of workgroups.
#[derive(Debug)]
pub struct DifferenceKernels {
    forward: Kernel,
    l1_backward: Kernel,
    rmse_backward: Kernel,
    sum: Sum,
    parts: Buffer<f32>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_pixels: u32,
    weight: f32,
    squares: u32,
}

impl DifferenceKernels {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let kernel = |name, source| Kernel::new(gpu, name, &[GROUPS, include_str!("difference/truth.wgsl"), source]);
        Ok(Self {
            forward: kernel("difference", include_str!("difference/forward.wgsl")),
            l1_backward: kernel("l1 backward", include_str!("difference/l1_backward.wgsl")),
            rmse_backward: kernel("rmse backward", include_str!("difference/rmse_backward.wgsl")),
            sum: Sum::new(gpu),
            parts: Buffer::zeros(gpu, "sums of differences", 1)?,
        })
    }

    /// Writes `Σ |image − truth|` and `Σ (image − truth)²` to `totals` from `first_total` on.
    ///
    /// * `image`: planes `[3, height, width]`, 0 where pixels do not count.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn forward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        image: &Buffer<f32>,
        target: &Target,
        totals: &Buffer<f32>,
        first_total: usize,
    ) -> Result<(), GpuError> {
        let n_groups = image.len().div_ceil(GROUP_THREADS);
        self.parts.fit(gpu, 2 * n_groups)?;
        let parameters = Parameters { n_pixels: target.pixels.len() as u32, weight: 0.0, squares: 0 };
        commands.run(&self.forward, &parameters, &[image, &target.pixels, &self.parts], n_groups);
        self.sum.run(commands, &self.parts, 2, totals, first_total);
        Ok(())
    }

    /// `d_image ← weight · ∂difference/∂image`; zero where the images are equal.
    ///
    /// * `totals`, `first_total`: what [`Self::forward`] wrote, and where.
    #[allow(clippy::too_many_arguments, reason = "buffers of one kernel")]
    pub fn backward(
        &self,
        commands: &mut Commands<'_>,
        difference: Difference,
        image: &Buffer<f32>,
        target: &Target,
        weight: f64,
        (totals, first_total): (&Buffer<f32>, usize),
        d_image: &Buffer<f32>,
    ) {
        let n_pixels = target.pixels.len() as u32;
        let parameters = Parameters { n_pixels, weight: weight as f32, squares: first_total as u32 + 1 };
        let n_values = image.len();
        match difference {
            Difference::L1 => {
                commands.run_items(&self.l1_backward, &parameters, &[image, &target.pixels, d_image], n_values);
            }
            Difference::Rmse => {
                let buffers: [&dyn Bind; 4] = [image, &target.pixels, totals, d_image];
                commands.run_items(&self.rmse_backward, &parameters, &buffers, n_values);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::target::tests::photograph;
    use super::*;
    use crate::finite_difference::random;
    use crate::gpu::parity::{Bound, assert_close, gpu};
    use crate::ops::{l1, rmse};
    use crate::step::planes;

    /// Bounds: L1's gradient is exact, where the photograph is met to the bit as well; sums lose some units of the last place.
    #[test]
    fn differences_agree_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        for size_px in [[1, 1], [37, 21], [150, 90]] {
            let (photograph, _) = photograph(2, size_px);
            let truth = planes(&photograph);
            // Every fifth value is met exactly.
            let image: Vec<f32> = (0..)
                .zip(random(1, truth.len()))
                .map(|(i, v): (usize, f64)| if i % 5 == 0 { truth[i] } else { v as f32 })
                .collect();
            let target = Target::of_planes(gpu, &truth, size_px, None).expect("room");
            let image_buffer = Buffer::upload(gpu, "image", &image).expect("room");
            let totals = Buffer::zeros(gpu, "totals", 3).expect("room");
            let d_image = Buffer::upload(gpu, "gradient", &vec![9.0; image.len()]).expect("room");
            let mut kernels = DifferenceKernels::new(gpu).expect("room");
            let squared_sum = rmse::squared_sum(&image, &truth);
            let mut l1_gradient = vec![0.0; image.len()];
            l1::backward(&image, &truth, 0.8, &mut l1_gradient);
            let mut rmse_gradient = vec![0.0; image.len()];
            rmse::backward(&image, &truth, squared_sum, 0.8, &mut rmse_gradient);
            let exact = Bound { relative: 1e-6, absolute: 0.0 };
            let rounded = Bound { relative: 1e-5, absolute: 1e-7 };
            for (difference, expected, bound) in
                [(Difference::L1, &l1_gradient, exact), (Difference::Rmse, &rmse_gradient, rounded)]
            {
                let mut commands = Commands::new(gpu);
                kernels.forward(gpu, &mut commands, &image_buffer, &target, &totals, 1).expect("room");
                kernels.backward(&mut commands, difference, &image_buffer, &target, 0.8, (&totals, 1), &d_image);
                commands.submit().expect("runs");
                assert_close("gradient", &d_image.read(gpu).expect("runs"), expected, bound);
            }
            let sums = [0.0, l1::forward(&image, &truth) * image.len() as f32, squared_sum as f32];
            assert_close("sums", &totals.read(gpu).expect("runs"), &sums, Bound { relative: 1e-5, absolute: 1e-6 });
        }
    }
}
