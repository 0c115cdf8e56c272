//! [`pocketsplat_kernels::step::Exposure`], and the sums that it follows from.

use bytemuck::{Pod, Zeroable};

use super::target::Target;
use crate::ops::primitives::sum::Sum;
use crate::{Buffer, Commands, GROUP_THREADS, GROUPS, Gpu, GpuError, Kernel};
use pocketsplat_kernels::step::{Exposure, ExposureSums};

/// Sums that [`Exposures::sums`] writes.
pub const N_SUMS: usize = 6;

/// Its kernels, and the sums of workgroups.
#[derive(Debug)]
pub struct Exposures {
    shift: Kernel,
    scale: Kernel,
    sums: Kernel,
    sum: Sum,
    parts: Buffer<f32>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Shift {
    n_pixels: u32,
    gain: [f32; 3],
    foot: f32,
}

impl Shift {
    fn of(exposure: &Exposure<f32>, planes: &Buffer<f32>) -> Self {
        Self { n_pixels: (planes.len() / 3) as u32, gain: exposure.gain, foot: Exposure::<f32>::FOOT as f32 }
    }
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Sums {
    n_pixels: u32,
    foot: f32,
    white: u32,
}

impl Exposures {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            shift: Kernel::new(
                gpu,
                "exposure",
                &[GROUPS, include_str!("exposure/gain.wgsl"), include_str!("exposure/shift.wgsl")],
            ),
            scale: Kernel::new(
                gpu,
                "exposure backward",
                &[GROUPS, include_str!("exposure/gain.wgsl"), include_str!("exposure/scale.wgsl")],
            ),
            sums: Kernel::new(gpu, "sums for an exposure", &[GROUPS, include_str!("exposure/sums.wgsl")]),
            sum: Sum::new(gpu),
            parts: Buffer::zeros(gpu, "parts of sums for an exposure", 1)?,
        })
    }

    /// Writes the image as the photograph would show it, planes `[3, height, width]`, to `shown`.
    pub fn apply(
        &self,
        commands: &mut Commands<'_>,
        exposure: &Exposure<f32>,
        image: &Buffer<f32>,
        shown: &Buffer<f32>,
    ) {
        commands.run_items(&self.shift, &Shift::of(exposure, image), &[image, shown], image.len());
    }

    /// From the gradient of that to the gradient of the image, in place.
    pub fn backward(&self, commands: &mut Commands<'_>, exposure: &Exposure<f32>, d_planes: &Buffer<f32>) {
        commands.run_items(&self.scale, &Shift::of(exposure, d_planes), &[d_planes], d_planes.len());
    }

    /// Writes [`ExposureSums`] of an image before its exposure to `totals` from `first_total` on.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn sums(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        image: &Buffer<f32>,
        target: &Target,
        totals: &Buffer<f32>,
        first_total: usize,
    ) -> Result<(), GpuError> {
        let n_pixels = target.pixels.len();
        let n_groups = n_pixels.div_ceil(GROUP_THREADS);
        self.parts.fit(gpu, N_SUMS * n_groups)?;
        let white = u32::from(Exposure::<f32>::WHITE);
        let parameters = Sums { n_pixels: n_pixels as u32, foot: Exposure::<f32>::FOOT as f32, white };
        commands.run(&self.sums, &parameters, &[image, &target.pixels, &self.parts], n_groups);
        self.sum.run(commands, &self.parts, N_SUMS, totals, first_total);
        Ok(())
    }

    /// What [`Self::sums`] wrote.
    pub fn sums_of(totals: &[f32]) -> ExposureSums {
        let three = |from: usize| std::array::from_fn(|c| f64::from(totals[from + c]));
        ExposureSums { products: three(0), squares: three(3) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::target::tests::photograph;
    use super::*;
    use crate::parity::{Bound, assert_close, gpu};
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::step::planes;

    /// Bounds: a multiplication and two additions; sums lose some units of the last place.
    #[test]
    fn exposures_agree_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        for size_px in [[1, 1], [37, 21], [150, 90]] {
            let (photograph, mask) = photograph(2, size_px);
            let truth = planes(&photograph);
            let image: Vec<f32> = random(1, truth.len()).into_iter().map(|v| v as f32).collect();
            for mask in [None, Some(mask.as_slice())] {
                let target = Target::of_planes(gpu, &truth, size_px, mask).expect("room");
                let exposure = Exposure { gain: [1.3, 1.0, 0.8] };
                let [drawn, gradient] =
                    ["image", "gradient"].map(|name| Buffer::upload(gpu, name, &image).expect("room"));
                let shown = Buffer::zeros(gpu, "shown", image.len()).expect("room");
                let totals = Buffer::zeros(gpu, "totals", 1 + N_SUMS).expect("room");
                let mut exposures = Exposures::new(gpu).expect("room");
                let mut commands = Commands::new(gpu);
                exposures.sums(gpu, &mut commands, &drawn, &target, &totals, 1).expect("room");
                exposures.apply(&mut commands, &exposure, &drawn, &shown);
                exposures.backward(&mut commands, &exposure, &gradient);
                commands.submit().expect("runs");
                let bound = Bound { relative: 1e-6, absolute: 1e-7 };
                let (mut applied, mut d_image) = (image.clone(), image.clone());
                exposure.apply(&mut applied);
                exposure.backward(&mut d_image);
                assert_close("image", &shown.read(gpu).expect("runs"), &applied, bound);
                assert_close("gradient", &gradient.read(gpu).expect("runs"), &d_image, bound);
                let sums =
                    |sums: ExposureSums| [sums.products, sums.squares].concat().iter().map(|v| *v as f32).collect();
                let expected: Vec<f32> = sums(ExposureSums::of(&image, &truth, mask));
                let found: Vec<f32> = sums(Exposures::sums_of(&totals.read(gpu).expect("runs")[1..]));
                assert_close("sums", &found, &expected, Bound { relative: 1e-5, absolute: 1e-6 });
            }
        }
    }
}
