//! The heads as a bundle has them: matrices in multiples of a step, biases as they are.

use bytemuck::{Pod, Zeroable};

use super::head::HeadLayout;
use crate::{Buffer, Commands, GROUPS, Gpu, Kernel};

/// Its kernel.
#[derive(Clone, Debug)]
pub struct Written {
    write: Kernel,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_values: u32,
    step: f32,
    first_bias: u32,
    second_matrix: u32,
    second_bias: u32,
}

impl Written {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu) -> Self {
        Self { write: Kernel::new(gpu, "heads as written", &[GROUPS, include_str!("written/write.wgsl")]) }
    }

    /// Rounds the matrices of a head; both arrays are in file order.
    ///
    /// * `step`: a power of two.
    pub fn run(
        &self,
        commands: &mut Commands<'_>,
        head: &HeadLayout,
        step: f32,
        weights: &Buffer<f32>,
        written: &Buffer<f32>,
    ) {
        let [_, first_bias, second_matrix, second_bias] = head.first.map(|place| place as u32);
        let n_values = head.n_params();
        let parameters = Parameters { n_values: n_values as u32, step, first_bias, second_matrix, second_bias };
        commands.run_items(&self.write, &parameters, &[weights, written], n_values);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::gpu;
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::ops::rate::perturb::symbol;
    use pocketsplat_kernels::scene::Head;

    /// Exact: a step is a power of two.
    #[test]
    fn matrices_become_multiples_and_biases_stay() {
        let Some(gpu) = gpu() else { return };
        let mut head = Head::filled(7, 32, 5, 0.0f32);
        for (seed, group) in (0..).zip(head.groups_mut()) {
            let n = group.len();
            group.copy_from_slice(&random(seed, n).iter().map(|v| *v as f32).collect::<Vec<_>>());
        }
        let step = 1.0 / 128.0;
        // Ties.
        head.w1[..4].copy_from_slice(&[0.5 * step, 1.5 * step, -0.5 * step, -2.5 * step]);
        let layout = HeadLayout::of(&head);
        let weights = Buffer::upload(gpu, "weights", &head.groups().concat()).expect("room");
        let written = Buffer::upload(gpu, "written", &vec![9.0; layout.n_params()]).expect("room");
        let mut commands = Commands::new(gpu);
        Written::new(gpu).run(&mut commands, &layout, step, &weights, &written);
        commands.submit().expect("runs");
        for weight in head.w1.iter_mut().chain(&mut head.w2) {
            *weight = symbol(*weight, step) * step;
        }
        assert_eq!(written.read(gpu).expect("runs"), head.groups().concat());
    }
}
