//! [`pocketsplat_kernels::ops::loss::ssim`] against an 8-bit photograph: a workgroup is 16×16 pixels of one channel.

use bytemuck::{Pod, Zeroable};

use super::target::Target;
use crate::ops::primitives::sum::Sum;
use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel};
use pocketsplat_kernels::ops::loss::blur::window;

/// Edge of the pixels of a workgroup.
const EDGE: usize = 16;

/// Its kernels, and what forward leaves for backward.
#[derive(Debug)]
pub struct Ssim {
    forward: Kernel,
    backward: Kernel,
    sum: Sum,
    parts: Buffer<f32>,
    /// `[3, height, width, 3]`: derivatives of the mean of S by μₓ, E\[x²\], E\[xy\].
    partials: Buffer<f32>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    size_px: [u32; 2],
    /// What the derivatives are multiplied with.
    weight: f32,
    window: [f32; 11],
}

impl Ssim {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let with = |source| [GROUPS, include_str!("ssim/window.wgsl"), source];
        Ok(Self {
            forward: Kernel::new(gpu, "ssim", &with(include_str!("ssim/forward.wgsl"))),
            backward: Kernel::new(gpu, "ssim backward", &with(include_str!("ssim/backward.wgsl"))),
            sum: Sum::new(gpu),
            parts: Buffer::zeros(gpu, "sums of similarity", 1)?,
            partials: Buffer::zeros(gpu, "derivatives of similarity", 1)?,
        })
    }

    /// Writes Σ S over pixels and channels to `totals[first_total]`, and keeps what [`Self::backward`] needs.
    ///
    /// * `image`: planes `[3, height, width]`, 0 where pixels do not count.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    #[expect(clippy::too_many_arguments, reason = "what the kernel is bound to")]
    pub fn forward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        image: &Buffer<f32>,
        target: &Target,
        size_px: [usize; 2],
        totals: &Buffer<f32>,
        first_total: usize,
    ) -> Result<(), GpuError> {
        let n_groups = n_groups(size_px);
        self.parts.fit(gpu, n_groups)?;
        self.partials.fit(gpu, 3 * image.len())?;
        let parameters = parameters(size_px, 1.0 / image.len() as f32);
        let buffers = [image as _, &target.pixels as _, &self.partials as _, &self.parts as _];
        commands.run(&self.forward, &parameters, &buffers, n_groups);
        self.sum.run(commands, &self.parts, 1, totals, first_total);
        Ok(())
    }

    /// Adds `weight · ∂(mean S)/∂image` to `d_image`, after [`Self::forward`] of the same images.
    pub fn backward(
        &self,
        commands: &mut Commands<'_>,
        image: &Buffer<f32>,
        target: &Target,
        size_px: [usize; 2],
        weight: f64,
        d_image: &Buffer<f32>,
    ) {
        let parameters = parameters(size_px, weight as f32);
        let buffers = [image as _, &target.pixels as _, &self.partials as _, d_image as _];
        commands.run(&self.backward, &parameters, &buffers, n_groups(size_px));
    }
}

fn n_groups(size_px: [usize; 2]) -> usize {
    3 * size_px[0].div_ceil(EDGE) * size_px[1].div_ceil(EDGE)
}

fn parameters(size_px: [usize; 2], weight: f32) -> Parameters {
    Parameters { size_px: size_px.map(|s| s as u32), weight, window: window() }
}

#[cfg(test)]
mod tests {
    use super::super::target::tests::photograph;
    use super::*;
    use crate::parity::{Bound, assert_close, gpu, largest};
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::ops::loss::ssim as cpu;
    use pocketsplat_kernels::ops::simd::Level;
    use pocketsplat_kernels::step::planes;

    /// Bounds: both blur with 22 products in one order and divide by C₂ = 9e-4 at least, which makes 1e-3 of the largest gradient
    /// of a rounding of 1e-7; the mean of S is known to 1e-5.
    fn compare(
        gpu: &Gpu,
        name: &str,
        photograph: &pocketsplat_capture::dataset::Image,
        mask: Option<&[bool]>,
        image: &[f32],
    ) {
        let size_px = [photograph.width_px as usize, photograph.height_px as usize];
        let mut truth = planes(photograph);
        pocketsplat_kernels::step::clear_masked(&mut truth, mask);
        let target = Target::of_planes(gpu, &truth, size_px, mask).expect("room");
        let image_buffer = Buffer::upload(gpu, "image", image).expect("room");
        let totals = Buffer::zeros(gpu, "totals", 2).expect("room");
        let before = 0.25;
        let d_image = Buffer::upload(gpu, "gradient", &vec![before; image.len()]).expect("room");
        let mut ssim = Ssim::new(gpu).expect("room");
        let mut commands = Commands::new(gpu);
        ssim.forward(gpu, &mut commands, &image_buffer, &target, size_px, &totals, 1).expect("room");
        ssim.backward(&mut commands, &image_buffer, &target, size_px, -0.2 * image.len() as f64, &d_image);
        commands.submit().expect("runs");
        let (similarity, partials) = cpu::forward(Level::detect(), image, &truth, size_px);
        let mut expected = vec![before; image.len()];
        cpu::backward(Level::detect(), image, &truth, size_px, &partials, -0.2 * image.len() as f32, &mut expected);
        let found = totals.read(gpu).expect("runs")[1] / image.len() as f32;
        assert_close(name, &[found], &[similarity], Bound { relative: 0.0, absolute: 1e-5 });
        let bound = Bound { relative: 0.0, absolute: 1e-3 * largest(&expected) };
        assert_close(name, &d_image.read(gpu).expect("runs"), &expected, bound);
    }

    #[test]
    fn ssim_agrees_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        for size_px in [[1, 1], [5, 40], [37, 21], [64, 48]] {
            let (photograph, mask) = photograph(3, size_px);
            let noise = random(6, 3 * size_px[0] * size_px[1]);
            let mut image: Vec<f32> = noise.iter().map(|v| (0.5 + 0.5 * v) as f32).collect();
            compare(gpu, "noise", &photograph, None, &image);
            pocketsplat_kernels::step::clear_masked(&mut image, Some(&mask));
            compare(gpu, "masked", &photograph, Some(&mask), &image);
            compare(gpu, "equal", &photograph, None, &planes(&photograph));
            compare(gpu, "flat", &photograph, None, &vec![0.5; image.len()]);
        }
    }
}
