//! [`pocketsplat_kernels::ops::loss::l1`] and the squared error, against an 8-bit photograph.

use bytemuck::{Pod, Zeroable};

use super::target::Target;
use crate::ops::primitives::sum::Sum;
use crate::{Buffer, Commands, GROUP_THREADS, GROUPS, Gpu, GpuError, Kernel};

/// Its kernels, and the sums of workgroups.
#[derive(Debug)]
pub struct L1 {
    forward: Kernel,
    backward: Kernel,
    sum: Sum,
    parts: Buffer<f32>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_pixels: u32,
    step: f32,
}

impl L1 {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            forward: Kernel::new(gpu, "l1", &[GROUPS, include_str!("l1/truth.wgsl"), include_str!("l1/forward.wgsl")]),
            backward: Kernel::new(
                gpu,
                "l1 backward",
                &[GROUPS, include_str!("l1/truth.wgsl"), include_str!("l1/backward.wgsl")],
            ),
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
        let parameters = Parameters { n_pixels: target.pixels.len() as u32, step: 0.0 };
        commands.run(&self.forward, &parameters, &[image, &target.pixels, &self.parts], n_groups);
        self.sum.run(commands, &self.parts, 2, totals, first_total);
        Ok(())
    }

    /// `d_image ← weight · sign(image − truth)/n`; zero where they are equal.
    pub fn backward(
        &self,
        commands: &mut Commands<'_>,
        image: &Buffer<f32>,
        target: &Target,
        weight: f64,
        d_image: &Buffer<f32>,
    ) {
        let step = weight as f32 / image.len() as f32;
        let parameters = Parameters { n_pixels: target.pixels.len() as u32, step };
        commands.run_items(&self.backward, &parameters, &[image, &target.pixels, d_image], image.len());
    }
}

#[cfg(test)]
mod tests {
    use super::super::target::tests::photograph;
    use super::*;
    use crate::parity::{Bound, assert_close, gpu};
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::ops::loss::l1 as cpu;
    use pocketsplat_kernels::step::planes;

    /// Bounds: the gradient is exact, where the photograph is met to the bit as well; sums lose some units of the last place.
    #[test]
    fn l1_agrees_with_the_cpu() {
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
            let mut l1 = L1::new(gpu).expect("room");
            let mut commands = Commands::new(gpu);
            l1.forward(gpu, &mut commands, &image_buffer, &target, &totals, 1).expect("room");
            l1.backward(&mut commands, &image_buffer, &target, 0.8, &d_image);
            commands.submit().expect("runs");
            let mut expected = vec![0.0; image.len()];
            cpu::backward(&image, &truth, 0.8, &mut expected);
            let exact = Bound { relative: 1e-6, absolute: 0.0 };
            assert_close("gradient", &d_image.read(gpu).expect("runs"), &expected, exact);
            let squares = image.iter().zip(&truth).map(|(x, y)| f64::from(x - y).powi(2)).sum::<f64>() as f32;
            let sums = [0.0, cpu::forward(&image, &truth) * image.len() as f32, squares];
            assert_close("sums", &totals.read(gpu).expect("runs"), &sums, Bound { relative: 1e-5, absolute: 1e-6 });
        }
    }
}
