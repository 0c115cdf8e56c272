//! [`pocketsplat_kernels::ops::rate::adaptive_step`] over the anchors of a view.

use bytemuck::{Pod, Zeroable};

use crate::{Buffer, Commands, GROUPS, Gpu, Kernel, MATH};
use pocketsplat_kernels::ops::rate::adaptive_step::EXPONENTS;

/// Its kernels.
#[derive(Clone, Debug)]
pub struct AdaptiveStep {
    fixed: Kernel,
    forward: Kernel,
    backward: Kernel,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    base_steps: [f32; 3],
    exponents: [f32; 2],
    n_values: u32,
}

impl Parameters {
    fn new(base_steps: [f32; 3], n_values: usize) -> Self {
        Self { base_steps, exponents: EXPONENTS.map(|e| e as f32), n_values: n_values as u32 }
    }
}

impl AdaptiveStep {
    /// Compiles the kernels.
    pub fn new(gpu: &Gpu) -> Self {
        let with = |source| [GROUPS, MATH, include_str!("adaptive_step/clamp.wgsl"), source];
        let fixed = [GROUPS, include_str!("adaptive_step/clamp.wgsl"), include_str!("adaptive_step/fixed.wgsl")];
        Self {
            fixed: Kernel::new(gpu, "fixed steps", &fixed),
            forward: Kernel::new(gpu, "adaptive steps", &with(include_str!("adaptive_step/forward.wgsl"))),
            backward: Kernel::new(gpu, "adaptive steps backward", &with(include_str!("adaptive_step/backward.wgsl"))),
        }
    }

    /// Gives all anchors the same steps, where no model chooses them.
    ///
    /// * `steps`: `[n, 3]`.
    pub fn fixed(&self, commands: &mut Commands<'_>, base_steps: [f32; 3], steps: &Buffer<f32>) {
        commands.run_items(&self.fixed, &Parameters::new(base_steps, steps.len()), &[steps], steps.len());
    }

    /// step = base·2^e, e within its range.
    ///
    /// * `exponents`, `steps`: `[n, 3]`.
    pub fn forward(
        &self,
        commands: &mut Commands<'_>,
        base_steps: [f32; 3],
        exponents: &Buffer<f32>,
        steps: &Buffer<f32>,
    ) {
        commands.run_items(&self.forward, &Parameters::new(base_steps, steps.len()), &[exponents, steps], steps.len());
    }

    /// Adds the gradients of [`Self::forward`] to `d_exponents`; all `[n, 3]`.
    pub fn backward(
        &self,
        commands: &mut Commands<'_>,
        exponents: &Buffer<f32>,
        steps: &Buffer<f32>,
        d_steps: &Buffer<f32>,
        d_exponents: &Buffer<f32>,
    ) {
        let parameters = Parameters::new([0.0; 3], steps.len());
        commands.run_items(&self.backward, &parameters, &[exponents, steps, d_steps, d_exponents], steps.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::{Bound, SIZES, assert_close, gpu};
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::ops::rate::adaptive_step as cpu;

    /// Bounds: one exponential, known to 5e-7 of itself, and products.
    #[test]
    fn adaptive_steps_agree_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        let (kernels, base_steps) = (AdaptiveStep::new(gpu), [1.0, 0.001, 0.2]);
        for n in SIZES {
            let of = |seed, scale: f64| random(seed, 3 * n).iter().map(|v| (scale * v) as f32).collect::<Vec<f32>>();
            let mut exponents = of(1, 4.0);
            for (e, hard) in exponents.iter_mut().zip([-3.0, 0.875, 0.0, -100.0, 100.0]) {
                *e = hard;
            }
            let (d_steps, before) = (of(2, 1.0), of(3, 1.0));
            let (mut steps, mut d_exponents) = (vec![0.0; 3 * n], before.clone());
            cpu::forward(base_steps, &exponents, &mut steps);
            cpu::backward(&exponents, &steps, &d_steps, &mut d_exponents);
            let upload = |values: &[f32]| Buffer::upload(gpu, "test", values).expect("room");
            let (e, s, fixed) = (upload(&exponents), upload(&vec![9.0; 3 * n]), upload(&vec![9.0; 3 * n]));
            let d = upload(&before);
            let mut commands = Commands::new(gpu);
            kernels.forward(&mut commands, base_steps, &e, &s);
            kernels.backward(&mut commands, &e, &s, &upload(&d_steps), &d);
            kernels.fixed(&mut commands, base_steps, &fixed);
            commands.submit().expect("runs");
            assert_close("steps", &s.read(gpu).expect("runs"), &steps, Bound { relative: 5e-7, absolute: 0.0 });
            let bound = Bound { relative: 1e-6, absolute: 1e-6 };
            assert_close("gradient", &d.read(gpu).expect("runs"), &d_exponents, bound);
            assert!(fixed.read(gpu).expect("runs").chunks(3).all(|steps| steps == base_steps));
        }
    }
}
