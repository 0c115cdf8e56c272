//! [`pocketsplat_kernels::ops::heads::detail`] over slots, with a row of inputs for each.

use bytemuck::{Pod, Zeroable};

use super::head::{Head, HeadLayout};
use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel, RECORDS};
use pocketsplat_kernels::ops::heads::neural_gaussians::Gaussian;

/// Its kernels, and what forward leaves for backward.
#[derive(Debug)]
pub struct Detail {
    to_input: Kernel,
    add: Kernel,
    from_gaussians: Kernel,
    to_gaussians: Kernel,
    to_features: Kernel,
    head: Head,
    /// `[n·K, F + 3]`: the feature, then the colour without residual.
    input: Buffer<f32>,
    hidden: Buffer<f32>,
    output: Buffer<f32>,
    d_input: Buffer<f32>,
    d_hidden: Buffer<f32>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_items: u32,
    n_offsets: u32,
    n_inputs: u32,
}

impl Detail {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let with = |source| [GROUPS, RECORDS, include_str!("detail/parameters.wgsl"), source];
        let kernel = |name, source| Kernel::new(gpu, name, &with(source));
        let room = |what| Buffer::zeros(gpu, what, 1);
        Ok(Self {
            to_input: kernel("detail: input", include_str!("detail/to_input.wgsl")),
            add: kernel("detail: add", include_str!("detail/add.wgsl")),
            from_gaussians: kernel("detail: from Gaussians", include_str!("detail/from_gaussians.wgsl")),
            to_gaussians: kernel("detail: to Gaussians", include_str!("detail/to_gaussians.wgsl")),
            to_features: kernel("detail: to features", include_str!("detail/to_features.wgsl")),
            head: Head::new(gpu)?,
            input: room("inputs of the detail head")?,
            hidden: room("hidden units of the detail head")?,
            output: room("outputs of the detail head")?,
            d_input: room("gradients of the detail head's inputs")?,
            d_hidden: room("gradients of the detail head's hidden units")?,
        })
    }

    /// Adds the residual to the colours of the Gaussians.
    ///
    /// * `weights`: of the head. * `features`: `[n, F]`. * `gaussians`: `[n·K]`. Cost: n·K·(F + 6)·H multiply-adds.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn forward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        head: &HeadLayout,
        weights: &Buffer<f32>,
        features: &Buffer<f32>,
        gaussians: &Buffer<Gaussian<f32>>,
    ) -> Result<(), GpuError> {
        let n_slots = gaussians.len();
        self.input.fit(gpu, n_slots * head.n_in)?;
        self.hidden.fit(gpu, n_slots * head.n_hidden)?;
        self.output.fit(gpu, n_slots * head.n_out)?;
        let of_input = parameters(head, features, n_slots, n_slots * head.n_in);
        commands.run_items(&self.to_input, &of_input, &[features, gaussians, &self.input], n_slots * head.n_in);
        self.head.forward(commands, head, weights, &self.input, &self.hidden, &self.output);
        let of_slots = parameters(head, features, n_slots, n_slots);
        commands.run_items(&self.add, &of_slots, &[&self.output, gaussians], n_slots);
        Ok(())
    }

    /// Gradients of [`Self::forward`]: those of the colours with residual become those of the colours without.
    ///
    /// * `gaussians`: as forward left them. * `d_features`, `d_weights`: added to.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    #[expect(clippy::too_many_arguments, reason = "what the kernels are bound to")]
    pub fn backward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        head: &HeadLayout,
        weights: &Buffer<f32>,
        gaussians: &Buffer<Gaussian<f32>>,
        d_gaussians: &Buffer<Gaussian<f32>>,
        d_features: &Buffer<f32>,
        d_weights: &Buffer<f32>,
    ) -> Result<(), GpuError> {
        let n_slots = gaussians.len();
        self.d_input.fit(gpu, n_slots * head.n_in)?;
        self.d_hidden.fit(gpu, n_slots * head.n_hidden)?;
        commands.clear(&self.d_input);
        let of_slots = parameters(head, d_features, n_slots, n_slots);
        // The outputs are not needed again.
        let d_output = &self.output;
        commands.run_items(&self.from_gaussians, &of_slots, &[gaussians, d_gaussians, d_output], n_slots);
        let (input, hidden, d_hidden, d_input) = (&self.input, &self.hidden, &self.d_hidden, &self.d_input);
        self.head.backward(gpu, commands, head, weights, input, hidden, d_output, d_hidden, d_input, d_weights)?;
        commands.run_items(&self.to_gaussians, &of_slots, &[d_input, gaussians, d_gaussians], n_slots);
        let of_features = parameters(head, d_features, n_slots, d_features.len());
        commands.run_items(&self.to_features, &of_features, &[d_input, d_features], d_features.len());
        Ok(())
    }
}

/// * `features`: `[n, F]`, of which K follows.
fn parameters(head: &HeadLayout, features: &Buffer<f32>, n_slots: usize, n_items: usize) -> Parameters {
    let n_anchors = features.len() / (head.n_in - 3);
    Parameters { n_items: n_items as u32, n_offsets: (n_slots / n_anchors.max(1)) as u32, n_inputs: head.n_in as u32 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::heads::head::parameters_of;
    use crate::parity::{Bound, SIZES, assert_close, gpu, largest};
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::ops::heads::detail as cpu;
    use pocketsplat_kernels::ops::heads::neural_gaussians::Source;
    use pocketsplat_kernels::scene;

    /// Bounds: those of a head, 1e-5 of the largest magnitude, and 1e-7·√n more for sums over n Gaussians. A hidden unit that a rounding
    /// turns on moves a gradient by a share of 1e-6 of itself times its weight: none is that near in these cases.
    #[test]
    fn detail_agrees_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        for (n, (f, h, k)) in SIZES.into_iter().zip([(8, 4, 2), (32, 16, 10), (5, 3, 1), (32, 16, 3), (16, 8, 4)]) {
            let of = |seed, len: usize| random(seed, len).iter().map(|v| *v as f32).collect::<Vec<f32>>();
            let mut head = scene::Head::filled(f + 3, h, 3, 0.0f32);
            for (i, group) in (0..).zip(head.groups_mut()) {
                *group = of(10 + i, group.len());
            }
            let features = of(1, n * f);
            let slot = |(v, i): (&[f32], usize)| match v[0] < -0.4 {
                true => Gaussian::default(),
                false => {
                    Gaussian { opacity: 0.5, colour: [v[1], v[2], v[3]], scale: [i as f32; 3], ..Gaussian::default() }
                }
            };
            let slots: Vec<Gaussian<f32>> = of(2, 4 * n * k).chunks_exact(4).zip(0..).map(slot).collect();
            let d_slots: Vec<Gaussian<f32>> = of(3, 3 * n * k)
                .chunks_exact(3)
                .map(|v| Gaussian { colour: [v[0], v[1], v[2]], opacity: 0.125, ..Gaussian::default() })
                .collect();
            let drawn: Vec<usize> = (0..slots.len()).filter(|slot| slots[*slot].opacity > 0.0).collect();
            let source = |slot: &usize| Source { row: (slot / k) as u32, offset: (slot % k) as u32 };
            let sources: Vec<Source> = drawn.iter().map(source).collect();
            let mut gaussians: Vec<_> = drawn.iter().map(|slot| slots[*slot]).collect();
            let mut d_gaussians: Vec<_> = drawn.iter().map(|slot| d_slots[*slot]).collect();
            let (mut d_features, mut d_head) = (vec![0.5; features.len()], head.map(|_| 0.0));
            let mut kept = cpu::ForwardCache::default();
            cpu::forward(&head, &features, &sources, &mut gaussians, &mut kept);
            cpu::backward(&head, &features, &sources, &mut kept, &mut d_gaussians, &mut d_features, &mut d_head);

            let upload = |values: &[f32]| Buffer::upload(gpu, "test", values).expect("room");
            let records = |values: &[Gaussian<f32>]| Buffer::upload(gpu, "test", values).expect("room");
            let layout = HeadLayout::of(&head);
            let (weights, there) = (upload(&parameters_of(&head)), upload(&features));
            let (g, d_g) = (records(&slots), records(&d_slots));
            let (d_f, d_w) = (upload(&vec![0.5; features.len()]), upload(&vec![0.0; layout.n_params()]));
            let mut detail = Detail::new(gpu).expect("room");
            let mut commands = Commands::new(gpu);
            detail.forward(gpu, &mut commands, &layout, &weights, &there, &g).expect("room");
            detail.backward(gpu, &mut commands, &layout, &weights, &g, &d_g, &d_f, &d_w).expect("room");
            commands.submit().expect("runs");
            let share = 1e-5 + 1e-7 * ((n * k) as f64).sqrt();
            let close = |what: &str, found: &[f32], expected: &[f32]| {
                let bound = Bound { relative: 0.0, absolute: share * largest(expected) };
                assert_close(&format!("{what} of {n} anchors"), found, expected, bound);
            };
            let colours = |all: &[Gaussian<f32>]| all.iter().flat_map(|g| g.colour).collect::<Vec<f32>>();
            let of_drawn = |all: Vec<Gaussian<f32>>| drawn.iter().map(|slot| all[*slot]).collect::<Vec<_>>();
            let found = g.read(gpu).expect("runs");
            assert!((0..slots.len()).all(|i| found[i].scale == slots[i].scale && found[i].opacity == slots[i].opacity));
            assert!((0..slots.len()).all(|i| slots[i].opacity > 0.0 || found[i] == slots[i]), "empty slots stay so");
            close("colours", &colours(&of_drawn(found)), &colours(&gaussians));
            close("d_colours", &colours(&of_drawn(d_g.read(gpu).expect("runs"))), &colours(&d_gaussians));
            close("d_features", &d_f.read(gpu).expect("runs"), &d_features);
            let found = d_w.read(gpu).expect("runs");
            for (first, group) in layout.first.into_iter().zip(d_head.groups()) {
                close("d_weights", &found[first..first + group.len()], group);
            }
        }
    }
}
