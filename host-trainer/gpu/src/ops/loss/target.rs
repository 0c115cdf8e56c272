//! The photograph that a step compares with, kept as 8 bit: [`pocketsplat_kernels::step::TargetView`].

use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel};

/// A photograph and where it shows the scene.
#[derive(Debug)]
pub struct Target {
    /// `[height, width]`: red, green, blue from the low byte up, and 255 where the pixel counts; 0 where it does not.
    pub pixels: Buffer<u32>,
    /// Pixels that count.
    pub n_counted: usize,
}

impl Target {
    /// Uploads a photograph.
    ///
    /// * `truth`: planes `[3, height, width]` that were 8 bit. * `mask`: `[height, width]` pixels that count; all of them without a mask.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn of_planes(gpu: &Gpu, truth: &[f32], size_px: [usize; 2], mask: Option<&[bool]>) -> Result<Self, GpuError> {
        let n = size_px[0] * size_px[1];
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a byte")]
        let byte = |v: f32| (v * 255.0).round().clamp(0.0, 255.0) as u8;
        let pixel = |i: usize| {
            let counts = mask.is_none_or(|mask| mask[i]);
            let rgb = [truth[i], truth[n + i], truth[2 * n + i]].map(byte);
            if counts { u32::from_le_bytes([rgb[0], rgb[1], rgb[2], 255]) } else { 0 }
        };
        let pixels: Vec<u32> = (0..n).map(pixel).collect();
        Ok(Self {
            n_counted: pixels.iter().filter(|p| **p > 0).count(),
            pixels: Buffer::upload(gpu, "photographs", &pixels)?,
        })
    }

    /// Whether all pixels count.
    pub fn is_whole(&self) -> bool {
        self.n_counted == self.pixels.len()
    }
}

/// Kernel that makes the pixels that do not count zero.
#[derive(Clone, Debug)]
pub struct ClearMasked {
    clear: Kernel,
}

impl ClearMasked {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu) -> Self {
        Self { clear: Kernel::new(gpu, "clear masked", &[GROUPS, include_str!("target/clear_masked.wgsl")]) }
    }

    /// Makes the pixels of `planes`, `[3, height, width]`, that do not count zero.
    pub fn run(&self, commands: &mut Commands<'_>, target: &Target, planes: &Buffer<f32>) {
        if !target.is_whole() {
            let n_pixels = target.pixels.len() as u32;
            commands.run_items(&self.clear, &n_pixels, &[&target.pixels, planes], planes.len());
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use pocketsplat_capture::dataset::Image;

    use super::*;
    use crate::parity::gpu;
    use pocketsplat_kernels::step::planes;

    /// Some photograph, and a mask of it.
    pub(crate) fn photograph(seed: u32, [width, height]: [usize; 2]) -> (Image, Vec<bool>) {
        let hash = |i: usize| (i as u32 + seed).wrapping_mul(2_654_435_761) >> 16;
        let rgb = (0..3 * width * height).map(|i| (hash(i) & 255) as u8).collect();
        let mask = (0..width * height).map(|i| hash(i / 7) % 4 > 0).collect();
        (Image { width_px: width as u32, height_px: height as u32, rgb }, mask)
    }

    #[test]
    fn pixels_that_do_not_count_become_zero() {
        let Some(gpu) = gpu() else { return };
        for size_px in [[1, 1], [37, 21]] {
            let (image, mask) = photograph(1, size_px);
            for mask in [None, Some(mask.as_slice())] {
                let target = Target::of_planes(gpu, &planes(&image), size_px, mask).expect("room");
                let n = size_px[0] * size_px[1];
                let planes: Vec<f32> = (0..3 * n).map(|i| 1.0 + i as f32).collect();
                let buffer = Buffer::upload(gpu, "planes", &planes).expect("room");
                let mut commands = Commands::new(gpu);
                ClearMasked::new(gpu).run(&mut commands, &target, &buffer);
                commands.submit().expect("runs");
                let mut expected = planes;
                pocketsplat_kernels::step::clear_masked(&mut expected, mask);
                assert_eq!(buffer.read(gpu).expect("runs"), expected);
                assert_eq!(target.n_counted, mask.map_or(n, |mask| mask.iter().filter(|m| **m).count()));
            }
        }
    }
}
