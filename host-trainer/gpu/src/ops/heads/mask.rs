//! The term of [`pocketsplat_kernels::ops::heads::mask`].

use bytemuck::{Pod, Zeroable};

use crate::ops::primitives::sum::Sum;
use crate::{Buffer, Commands, GROUP_THREADS, GROUPS, Gpu, GpuError, Kernel, MATH};
use pocketsplat_kernels::scene::MASK_THRESHOLD;

/// Its kernel, and the sums of workgroups.
#[derive(Debug)]
pub struct Mask {
    term: Kernel,
    drawn: Kernel,
    sum: Sum,
    parts: Buffer<f32>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_logits: u32,
    weight: f32,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Counted {
    n_anchors: u32,
    n_offsets: u32,
    threshold: f32,
}

impl Mask {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            term: Kernel::new(gpu, "mask term", &[GROUPS, MATH, include_str!("mask/term.wgsl")]),
            drawn: Kernel::new(gpu, "anchors that are drawn", &[GROUPS, include_str!("mask/drawn.wgsl")]),
            sum: Sum::new(gpu),
            parts: Buffer::zeros(gpu, "sums of openings", 1)?,
        })
    }

    /// Writes 1 for each anchor with an offset that is drawn, and 0 for the others.
    ///
    /// * `logits`: `[n, n_offsets]`. * `marks`: `[n]`.
    pub fn mark_drawn(&self, commands: &mut Commands<'_>, logits: &Buffer<f32>, n_offsets: usize, marks: &Buffer<u32>) {
        let n_anchors = logits.len() / n_offsets;
        let parameters =
            Counted { n_anchors: n_anchors as u32, n_offsets: n_offsets as u32, threshold: MASK_THRESHOLD as f32 };
        commands.run_items(&self.drawn, &parameters, &[logits, marks], n_anchors);
    }

    /// Writes `Σ σ(logit)` to `totals[first_total]`, and adds `weight` times its gradient to `d_logits`.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    #[expect(clippy::too_many_arguments, reason = "what the kernel is bound to")]
    pub fn term(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        logits: &Buffer<f32>,
        weight: f32,
        d_logits: &Buffer<f32>,
        totals: &Buffer<f32>,
        first_total: usize,
    ) -> Result<(), GpuError> {
        let n_groups = logits.len().div_ceil(GROUP_THREADS);
        self.parts.fit(gpu, n_groups)?;
        let parameters = Parameters { n_logits: logits.len() as u32, weight };
        commands.run(&self.term, &parameters, &[logits, d_logits, &self.parts], n_groups);
        self.sum.run(commands, &self.parts, 1, totals, first_total);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::{Bound, SIZES, assert_close, gpu};
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::ops::heads::mask as cpu;

    /// Bounds: a sigmoid is known to 1e-6 of itself, 1 − σ to 1e-7, the sum of n of them to 1e-6.
    #[test]
    fn the_mask_term_agrees_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        for n in SIZES {
            let mut logits: Vec<f32> = random(8, n).iter().map(|v| (12.0 * v) as f32).collect();
            for (logit, hard) in logits.iter_mut().zip([0.0, 100.0, -100.0, -11.5]) {
                *logit = hard;
            }
            let before = 1e-3;
            let mut expected = vec![before; n];
            let sum = cpu::term(&logits, 0.25f32, &mut expected) / 0.25;
            let d_logits = Buffer::upload(gpu, "gradients", &vec![before; n]).expect("room");
            let totals = Buffer::upload(gpu, "totals", &[7.0; 2]).expect("room");
            let logits = Buffer::upload(gpu, "logits", &logits).expect("room");
            let mut mask = Mask::new(gpu).expect("room");
            let mut commands = Commands::new(gpu);
            mask.term(gpu, &mut commands, &logits, 0.25, &d_logits, &totals, 1).expect("room");
            commands.submit().expect("runs");
            let of_sum = Bound { relative: 2e-6, absolute: 1e-7 };
            assert_close("sum", &totals.read(gpu).expect("runs"), &[7.0, sum], of_sum);
            let bound = Bound { relative: 2e-6, absolute: 1e-7 };
            assert_close("gradient", &d_logits.read(gpu).expect("runs"), &expected, bound);
        }
    }

    #[test]
    fn anchors_with_an_offset_that_is_drawn_are_marked() {
        let Some(gpu) = gpu() else { return };
        let mask = Mask::new(gpu).expect("room");
        for (n, k) in SIZES.into_iter().zip([3, 1, 10, 4, 7]) {
            let logits: Vec<f32> = random(3, n * k).iter().map(|v| (6.0 * v - 5.0) as f32).collect();
            let has_drawn = |row: &&[f32]| row.iter().any(|logit| cpu::is_open(*logit));
            let expected: Vec<u32> = logits.chunks_exact(k).map(|row| u32::from(has_drawn(&row))).collect();
            let found = Buffer::upload(gpu, "marks", &vec![9u32; n]).expect("room");
            let mut commands = Commands::new(gpu);
            mask.mark_drawn(&mut commands, &Buffer::upload(gpu, "logits", &logits).expect("room"), k, &found);
            commands.submit().expect("runs");
            assert_eq!(found.read(gpu).expect("runs"), expected);
        }
    }
}
