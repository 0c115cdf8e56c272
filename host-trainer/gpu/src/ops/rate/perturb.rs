//! [`pocketsplat_kernels::ops::rate::perturb`] over one group of the values of a view's anchors.

use bytemuck::{Pod, Zeroable};

use super::noise::STREAM;
use crate::{Buffer, Commands, GROUPS, Gpu, Kernel};
use pocketsplat_kernels::ops::rate::noise::Stream;

/// Its kernels.
#[derive(Clone, Debug)]
pub struct Perturb {
    with_noise: Kernel,
    rounded: Kernel,
    backward: Kernel,
}

/// Which of the values of an anchor share a step.
#[derive(Clone, Copy, Debug)]
pub struct Group {
    /// 0 for features, 1 for log-scales, 2 for offsets.
    pub index: usize,
    /// Number of its first channel.
    pub first: usize,
    /// Channels.
    pub width: usize,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_rows: u32,
    width: u32,
    group: u32,
    first: u32,
    stream: u32,
}

impl Parameters {
    fn new(group: Group, n_values: usize, stream: u32) -> Self {
        Self {
            n_rows: (n_values / group.width) as u32,
            width: group.width as u32,
            group: group.index as u32,
            first: group.first as u32,
            stream,
        }
    }
}

impl Perturb {
    /// Compiles the kernels.
    pub fn new(gpu: &Gpu) -> Self {
        let with = |source| [GROUPS, STREAM, include_str!("perturb/parameters.wgsl"), source];
        Self {
            with_noise: Kernel::new(gpu, "noise", &with(include_str!("perturb/with_noise.wgsl"))),
            rounded: Kernel::new(
                gpu,
                "rounded",
                &[GROUPS, include_str!("perturb/parameters.wgsl"), include_str!("perturb/rounded.wgsl")],
            ),
            backward: Kernel::new(gpu, "perturb backward", &with(include_str!("perturb/backward.wgsl"))),
        }
    }

    /// Adds `u·step` to each value, u uniform in [−½, ½): the CPU's numbers.
    ///
    /// * `stream`: of this iteration. * `anchors`: `[n]`. * `steps`: `[n, 3]`. * `values`: `[n, width]`.
    /// * `residuals`: as `values`, overwritten with u.
    #[expect(clippy::too_many_arguments, reason = "what the kernel is bound to")]
    pub fn with_noise(
        &self,
        commands: &mut Commands<'_>,
        stream: Stream,
        group: Group,
        anchors: &Buffer<u32>,
        steps: &Buffer<f32>,
        values: &Buffer<f32>,
        residuals: &Buffer<f32>,
    ) {
        let parameters = Parameters::new(group, values.len(), stream.word());
        commands.run_items(&self.with_noise, &parameters, &[steps, values, residuals, anchors], values.len());
    }

    /// Rounds each value to a multiple of its step; ties may fall elsewhere than on the CPU, whose quotients are exactly rounded.
    ///
    /// * `residuals`: as `values`, overwritten with what rounding added, in steps.
    pub fn rounded(
        &self,
        commands: &mut Commands<'_>,
        group: Group,
        steps: &Buffer<f32>,
        values: &Buffer<f32>,
        residuals: &Buffer<f32>,
    ) {
        let parameters = Parameters::new(group, values.len(), 0);
        commands.run_items(&self.rounded, &parameters, &[steps, values, residuals], values.len());
    }

    /// Writes the group's column of dL/d(step): `Σ residual·dL/dv` over its channels in their order.
    ///
    /// * `d_values`, `residuals`: `[n, width]`. * `d_steps`: `[n, 3]`.
    pub fn backward(
        &self,
        commands: &mut Commands<'_>,
        group: Group,
        d_values: &Buffer<f32>,
        residuals: &Buffer<f32>,
        d_steps: &Buffer<f32>,
    ) {
        let parameters = Parameters::new(group, d_values.len(), 0);
        commands.run_items(&self.backward, &parameters, &[d_values, residuals, d_steps], d_values.len() / group.width);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::{Bound, SIZES, assert_close, gpu};
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::ops::rate::perturb as cpu;

    /// Bounds: noise is the CPU's to the bit, a value one product and one sum. dL/d(step) is a sum of up to 32 products that may cancel.
    #[test]
    fn perturb_agrees_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        let (kernels, stream) = (Perturb::new(gpu), Stream::of_run(9).branch(1234));
        for (n, width) in SIZES.into_iter().zip([5, 32, 1, 30, 6]) {
            let group = Group { index: width % 3, first: 38, width };
            let of =
                |seed, len: usize, scale: f64| random(seed, len).iter().map(|v| (scale * v) as f32).collect::<Vec<_>>();
            let mut values = of(1, n * width, 3.0);
            for (value, hard) in values.iter_mut().zip([1e9, -1e9, 0.0, 65000.0, 1e-30]) {
                *value = hard;
            }
            let steps: Vec<f32> = of(2, 3 * n, 1.0).iter().map(|v| v.abs() + 0.01).collect();
            let anchors: Vec<u32> = (0..n as u32).map(|i| 2 * i + 5).collect();
            let d_values = of(3, n * width, 1.0);
            let upload = |values: &[f32]| Buffer::upload(gpu, "test", values).expect("room");
            let anchors_there = Buffer::upload(gpu, "anchors", &anchors).expect("room");
            let (steps_there, d_there) = (upload(&steps), upload(&d_values));
            let (mut expected, mut residuals) = (values.clone(), vec![9.0; values.len()]);
            let mut d_steps = vec![7.0; 3 * n];
            for (row, anchor) in anchors.iter().enumerate() {
                let of = row * width..(row + 1) * width;
                let (v, r) = (&mut expected[of.clone()], &mut residuals[of.clone()]);
                cpu::with_noise(stream.branch(*anchor), 38, steps[3 * row + group.index], v, r);
                d_steps[3 * row + group.index] = cpu::backward(&d_values[of], r);
            }
            let (v, r) = (upload(&values), upload(&vec![9.0; values.len()]));
            let d = upload(&vec![7.0; 3 * n]);
            let mut commands = Commands::new(gpu);
            kernels.with_noise(&mut commands, stream, group, &anchors_there, &steps_there, &v, &r);
            kernels.backward(&mut commands, group, &d_there, &r, &d);
            commands.submit().expect("runs");
            assert_eq!(r.read(gpu).expect("runs"), residuals);
            for (i, (found, expected)) in v.read(gpu).expect("runs").iter().zip(&expected).enumerate() {
                let absolute = 2e-7 * f64::from(values[i].abs().max(steps[3 * (i / width) + group.index]));
                assert_close("noised", &[*found], &[*expected], Bound { relative: 0.0, absolute });
            }
            // Ties aside, whole numbers of steps are the CPU's.
            let (rounded, residuals_of_rounded) = (upload(&values), upload(&vec![9.0; values.len()]));
            let mut commands = Commands::new(gpu);
            kernels.rounded(&mut commands, group, &steps_there, &rounded, &residuals_of_rounded);
            commands.submit().expect("runs");
            let left = residuals_of_rounded.read(gpu).expect("runs");
            for (i, found) in rounded.read(gpu).expect("runs").into_iter().enumerate() {
                let (mut own, mut own_left) = ([values[i]], [9.0]);
                let step = steps[3 * (i / width) + group.index];
                cpu::rounded(step, &mut own, &mut own_left);
                let is_tie = (own_left[0].abs() - 0.5).abs() < 1e-4;
                let absolute = if is_tie { 1.01 * f64::from(step) } else { 2e-7 * f64::from(own[0].abs()) };
                assert_close("rounded", &[found], &own, Bound { relative: 0.0, absolute });
                let absolute = if is_tie { 1.01 } else { 1e-6 * f64::from((values[i] / step).abs()).max(1.0) };
                assert_close("what rounding added", &[left[i]], &own_left, Bound { relative: 0.0, absolute });
            }
            let bound = Bound { relative: 1e-5, absolute: 1e-5 };
            assert_close("step", &d.read(gpu).expect("runs"), &d_steps, bound);
        }
    }
}
