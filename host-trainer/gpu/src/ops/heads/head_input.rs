//! [`pocketsplat_kernels::ops::heads::head_input`].

use bytemuck::{Pod, Zeroable};

use crate::{Buffer, Commands, GROUPS, Gpu, Kernel};
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::scene::ModelShape;

/// Its kernels.
#[derive(Clone, Debug)]
pub struct HeadInput {
    forward: Kernel,
    backward: Kernel,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    centre_world: [f32; 3],
    n_rows: u32,
    feature_dim: u32,
    n_inputs: u32,
    view_distance: u32,
}

impl Parameters {
    fn new(shape: &ModelShape, centre_world: [f32; 3], n_rows: usize) -> Self {
        Self {
            centre_world,
            n_rows: n_rows as u32,
            feature_dim: shape.feature_dim as u32,
            n_inputs: shape.head_inputs() as u32,
            view_distance: shape.view_distance.into(),
        }
    }
}

impl HeadInput {
    /// Compiles the kernels.
    pub fn new(gpu: &Gpu) -> Self {
        let with = |source| [GROUPS, include_str!("head_input/parameters.wgsl"), source];
        Self {
            forward: Kernel::new(gpu, "head input", &with(include_str!("head_input/forward.wgsl"))),
            backward: Kernel::new(gpu, "head input backward", &with(include_str!("head_input/backward.wgsl"))),
        }
    }

    /// Writes `[feature F, distance 1, direction 3]` of each anchor of the view, the last two if a head sees them.
    ///
    /// * `features`: `[n, F]`. * `positions`: `[n, 3]`, world frame. * `input`: `[n, head_inputs]`.
    pub fn forward(
        &self,
        commands: &mut Commands<'_>,
        shape: &ModelShape,
        camera: &Pinhole<f32>,
        features: &Buffer<f32>,
        positions: &Buffer<f32>,
        input: &Buffer<f32>,
    ) {
        let parameters = Parameters::new(shape, camera.centre_world, positions.len() / 3);
        commands.run_items(&self.forward, &parameters, &[features, positions, input], input.len());
    }

    /// Adds the features' share of `d_input`, `[n, head_inputs]`, to `d_features`, `[n, F]`.
    pub fn backward(
        &self,
        commands: &mut Commands<'_>,
        shape: &ModelShape,
        d_input: &Buffer<f32>,
        d_features: &Buffer<f32>,
    ) {
        let parameters = Parameters::new(shape, [0.0; 3], d_input.len() / shape.head_inputs());
        commands.run_items(&self.backward, &parameters, &[d_input, d_features], d_features.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::image::prefilter::tests::camera;
    use crate::parity::{Bound, SIZES, assert_close, gpu};
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::ops::heads::head_input as cpu;

    /// Bound: features are copied; distance and direction are a root and a quotient, which adapters may miss by three units of the last
    /// place each.
    #[test]
    fn head_input_agrees_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        let (camera, kernels) = (camera(), HeadInput::new(gpu));
        let effects = [(false, false, 32), (true, false, 7), (false, true, 32), (true, true, 50), (true, true, 1)];
        for (n, (view_colour, view_distance, f)) in SIZES.into_iter().zip(effects) {
            let shape = ModelShape { view_colour, view_distance, ..ModelShape::plain(f, 3) };
            let of = |seed, len| random(seed, len).iter().map(|v| *v as f32).collect::<Vec<f32>>();
            let (features, d_input) = (of(1, n * f), of(3, n * shape.head_inputs()));
            let mut positions = of(2, 3 * n);
            if n > 2 {
                // At the camera itself there is no direction.
                positions[3..6].copy_from_slice(&camera.centre_world);
            }
            let places: Vec<[f32; 3]> = positions.as_chunks().0.to_vec();
            let (mut expected, mut d_expected) = (vec![0.0; d_input.len()], vec![0.0; features.len()]);
            cpu::forward(&shape, &camera, &features, &places, &mut expected);
            cpu::backward(&shape, &d_input, &mut d_expected);

            let upload = |values: &[f32]| Buffer::upload(gpu, "test", values).expect("room");
            let (input, d_features) = (upload(&vec![9.0; d_input.len()]), upload(&vec![0.0; features.len()]));
            let mut commands = Commands::new(gpu);
            let (features, positions) = (upload(&features), upload(&positions));
            kernels.forward(&mut commands, &shape, &camera, &features, &positions, &input);
            kernels.backward(&mut commands, &shape, &upload(&d_input), &d_features);
            commands.submit().expect("runs");
            let found = input.read(gpu).expect("runs");
            for (found, expected) in found.chunks(shape.head_inputs()).zip(expected.chunks(shape.head_inputs())) {
                assert_eq!(found[..f], expected[..f]);
                assert_close("view", &found[f..], &expected[f..], Bound { relative: 1e-6, absolute: 1e-7 });
            }
            assert_eq!(d_features.read(gpu).expect("runs"), d_expected);
        }
    }
}
