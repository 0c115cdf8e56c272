//! [`pocketsplat_kernels::ops::loss::high_pass`] against an 8-bit photograph.

use bytemuck::{Pod, Zeroable};

use super::target::Target;
use crate::ops::primitives::sum::Sum;
use crate::{Buffer, Commands, GROUP_THREADS, GROUPS, Gpu, GpuError, Kernel};
use pocketsplat_kernels::ops::loss::blur::window;

/// Its kernels, and the images between them, `[3, height, width]`.
#[derive(Debug)]
pub struct HighPass {
    subtract: Kernel,
    across: Kernel,
    high: Kernel,
    backward: Kernel,
    squares: Kernel,
    sum: Sum,
    difference: Buffer<f32>,
    blurred_across: Buffer<f32>,
    high_frequencies: Buffer<f32>,
    parts: Buffer<f32>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    size_px: [u32; 2],
    slope: f32,
    window: [f32; 11],
}

impl HighPass {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        const PARAMETERS: &str = include_str!("high_pass/parameters.wgsl");
        let kernel = |name, source| Kernel::new(gpu, name, &[GROUPS, PARAMETERS, source]);
        let down = |name, source| {
            Kernel::new(gpu, name, &[GROUPS, PARAMETERS, include_str!("high_pass/blurred.wgsl"), source])
        };
        let room = |what| Buffer::zeros(gpu, what, 1);
        Ok(Self {
            subtract: kernel("high pass: difference", include_str!("high_pass/subtract.wgsl")),
            across: kernel("high pass: blur across", include_str!("high_pass/across.wgsl")),
            high: down("high pass", include_str!("high_pass/high.wgsl")),
            backward: down("high pass backward", include_str!("high_pass/backward.wgsl")),
            squares: kernel("high pass: squares", include_str!("high_pass/squares.wgsl")),
            sum: Sum::new(gpu),
            difference: room("differences")?,
            blurred_across: room("rows of a blur")?,
            high_frequencies: room("high frequencies")?,
            parts: room("sums of squares")?,
        })
    }

    /// Writes `Σ HP(image − truth)²` to `totals[first_total]`, and adds the gradient of `weight` times its mean to `d_image`.
    ///
    /// * `image`, `d_image`: planes `[3, height, width]`, the image 0 where pixels do not count. Cost: two blurs.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    #[expect(clippy::too_many_arguments, reason = "what the kernels are bound to")]
    pub fn forward_backward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        image: &Buffer<f32>,
        target: &Target,
        size_px: [usize; 2],
        weight: f64,
        d_image: &Buffer<f32>,
        totals: &Buffer<f32>,
        first_total: usize,
    ) -> Result<(), GpuError> {
        let n = image.len();
        for buffer in [&mut self.difference, &mut self.blurred_across, &mut self.high_frequencies] {
            buffer.fit(gpu, n)?;
        }
        let n_groups = n.div_ceil(GROUP_THREADS);
        self.parts.fit(gpu, n_groups)?;
        let parameters = Parameters {
            size_px: size_px.map(|s| s as u32),
            slope: (2.0 * weight / n.max(1) as f64) as f32,
            window: window(),
        };
        let Self { difference, blurred_across, high_frequencies, parts, .. } = &*self;
        commands.run_items(&self.subtract, &parameters, &[image, &target.pixels, difference], n);
        commands.run_items(&self.across, &parameters, &[difference, blurred_across], n);
        commands.run_items(&self.high, &parameters, &[difference, blurred_across, high_frequencies], n);
        commands.run(&self.squares, &parameters, &[high_frequencies, parts], n_groups);
        self.sum.run(commands, parts, 1, totals, first_total);
        // The high pass is its own transpose.
        commands.run_items(&self.across, &parameters, &[high_frequencies, blurred_across], n);
        commands.run_items(&self.backward, &parameters, &[high_frequencies, blurred_across, d_image], n);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::target::tests::photograph;
    use super::*;
    use crate::parity::{Bound, assert_close, gpu, largest};
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::ops::loss::high_pass as cpu;
    use pocketsplat_kernels::ops::simd::Level;
    use pocketsplat_kernels::step::{clear_masked, planes};

    /// Bounds: both blur with 11 products across and 11 down in one order, which an adapter may fuse: 1e-5 of the largest; the sum of
    /// squares is known to 1e-5 of itself.
    #[test]
    fn the_high_pass_agrees_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        for size_px in [[1, 1], [5, 40], [37, 21], [64, 48]] {
            let (photograph, mask) = photograph(3, size_px);
            let n = 3 * size_px[0] * size_px[1];
            for mask in [None, Some(mask.as_slice())] {
                let mut image: Vec<f32> = random(6, n).iter().map(|v| (0.5 + 0.5 * v) as f32).collect();
                let mut truth = planes(&photograph);
                clear_masked(&mut image, mask);
                clear_masked(&mut truth, mask);
                let mut expected = vec![0.0; n];
                let term = cpu::forward_backward(Level::detect(), &image, &truth, size_px, 0.5, &mut expected);
                let target = Target::of_planes(gpu, &planes(&photograph), size_px, mask).expect("room");
                let image = Buffer::upload(gpu, "image", &image).expect("room");
                let d_image = Buffer::upload(gpu, "gradient", &vec![0.0; n]).expect("room");
                let totals = Buffer::upload(gpu, "totals", &[7.0; 2]).expect("room");
                let mut high_pass = HighPass::new(gpu).expect("room");
                let mut commands = Commands::new(gpu);
                high_pass
                    .forward_backward(gpu, &mut commands, &image, &target, size_px, 0.5, &d_image, &totals, 1)
                    .expect("room");
                commands.submit().expect("runs");
                let found = totals.read(gpu).expect("runs");
                let sum = term * n as f32 / 0.5;
                assert_close("sum", &found, &[7.0, sum], Bound { relative: 1e-5, absolute: 0.0 });
                let bound = Bound { relative: 0.0, absolute: 1e-5 * largest(&expected) };
                assert_close("gradient", &d_image.read(gpu).expect("runs"), &expected, bound);
            }
        }
    }
}
