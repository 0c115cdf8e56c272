//! What anchors give those that follow them (ContextGS): `step::parents` on the device.

use bytemuck::{Pod, Zeroable};
use pocketsplat_format::context::PARENT_UNITS;

use crate::ops::primitives::compact::Compact;
use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel};
use pocketsplat_kernels::scene::ModelShape;

/// Its kernels, and the rows of the level listed last.
#[derive(Debug)]
pub struct Parents {
    mark: Kernel,
    inputs: Kernel,
    give: Kernel,
    /// The rows of a view's anchors that are of a level, ascending.
    pub rows: Compact,
}

/// Where the anchors of a scene stand, and what they give.
#[derive(Clone, Copy, Debug)]
pub struct Places<'a> {
    /// `[n_anchors]`.
    pub levels: &'a Buffer<u32>,
    /// `[n_anchors, 3]` in cells of their level's, 0 to 1.
    pub positions: &'a Buffer<f32>,
    /// `[n_anchors]`: the anchor that each follows.
    pub parents: &'a Buffer<u32>,
    /// `[n_anchors, F + log-scales]`: what each gives.
    pub given: &'a Buffer<f32>,
}

#[derive(Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_items: u32,
    level: u32,
    /// Inputs of the network, or features.
    width: u32,
    n_log_scales: u32,
    /// 1 over what makes an input of one.
    per_unit: [f32; 2],
}

impl Parents {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let kernel = |name, source| Kernel::new(gpu, name, &[GROUPS, include_str!("parents/parameters.wgsl"), source]);
        Ok(Self {
            mark: kernel("parents: anchors of a level", include_str!("parents/mark.wgsl")),
            inputs: kernel("parents: inputs", include_str!("parents/inputs.wgsl")),
            give: kernel("parents: give", include_str!("parents/give.wgsl")),
            rows: Compact::new(gpu)?,
        })
    }

    /// Lists the rows of `anchors` that are of a level. Returns their number, for which it waits.
    ///
    /// # Errors
    /// [`GpuError`].
    pub fn of_level(
        &mut self,
        gpu: &Gpu,
        mut commands: Commands<'_>,
        places: Places<'_>,
        anchors: &Buffer<u32>,
        level: usize,
    ) -> Result<usize, GpuError> {
        self.rows.fit(gpu, anchors.len())?;
        let parameters = Parameters { n_items: anchors.len() as u32, level: level as u32, ..Parameters::default() };
        commands.run_items(&self.mark, &parameters, &[places.levels, anchors, &self.rows.marks], anchors.len());
        self.rows.run(gpu, commands)
    }

    /// Writes the inputs of the network of some anchors: their place, then what their parent gives, where they have one.
    ///
    /// * `anchors`: `[n]`, of one level. * `n_inputs`: 3 at the highest level. * `inputs`: `[n, n_inputs]`.
    pub fn inputs(
        &self,
        commands: &mut Commands<'_>,
        places: Places<'_>,
        anchors: &Buffer<u32>,
        n_inputs: usize,
        inputs: &Buffer<f32>,
    ) {
        let n_items = anchors.len() * n_inputs;
        let parameters = Parameters { n_items: n_items as u32, width: n_inputs as u32, ..Parameters::default() };
        let buffers = [places.positions as _, places.parents as _, places.given as _, anchors as _, inputs as _];
        commands.run_items(&self.inputs, &parameters, &buffers, n_items);
    }

    /// Writes what some anchors give whose values are not rounded: shares of [`PARENT_UNITS`] base steps, within ±1.
    ///
    /// * `anchors`: `[n]`. * `features`, `log_scales`: `[n, …]`, with noise.
    pub fn give(
        &self,
        commands: &mut Commands<'_>,
        shape: &ModelShape,
        base_steps: [f32; 3],
        anchors: &Buffer<u32>,
        [features, log_scales]: [&Buffer<f32>; 2],
        given: &Buffer<f32>,
    ) {
        let n_items = features.len() + log_scales.len();
        let unit = |group: usize| f64::from(base_steps[group]) * f64::from(PARENT_UNITS[group]);
        let parameters = Parameters {
            n_items: n_items as u32,
            width: shape.feature_dim as u32,
            n_log_scales: shape.n_log_scales() as u32,
            per_unit: [0, 1].map(|group| (1.0 / unit(group)) as f32),
            ..Parameters::default()
        };
        commands.run_items(&self.give, &parameters, &[features, log_scales, anchors, given], n_items);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::{Bound, SIZES, assert_close, gpu};
    use pocketsplat_kernels::finite_difference::random;

    /// Bounds: inputs are copied, and places are whole numbers of 2⁻¹⁴. What is given is a product where the CPU has a quotient: 2e-7.
    #[test]
    fn parents_give_what_they_give_on_the_cpu() {
        let Some(gpu) = gpu() else { return };
        let mut kernels = Parents::new(gpu).expect("room");
        let (shape, base_steps) = (ModelShape::plain(7, 2), [0.5, 0.02, 0.1]);
        let (f, s) = (shape.feature_dim, shape.n_log_scales());
        let width = f + s;
        for n in SIZES {
            let of =
                |seed, len: usize, scale: f64| random(seed, len).iter().map(|v| (scale * v) as f32).collect::<Vec<_>>();
            let anchors: Vec<u32> = (0..n as u32).filter(|a| a % 4 != 1).collect();
            let levels: Vec<u32> = (0..n as u32).map(|a| (a * a) % 3).collect();
            let parents: Vec<u32> = (0..n as u32).map(|a| a / 2).collect();
            let positions: Vec<f32> = of(1, 3 * n, 16384.0).iter().map(|v| v.round().abs() / 16384.0).collect();
            let (features, log_scales) = (of(2, anchors.len() * f, 80.0), of(3, anchors.len() * s, 4.0));
            let before = of(4, n * width, 1.0);
            let mut given = before.clone();
            let unit = |group: usize| (f64::from(base_steps[group]) * f64::from(PARENT_UNITS[group])) as f32;
            for (row, anchor) in anchors.iter().enumerate() {
                let given = &mut given[*anchor as usize * width..][..width];
                for (to, value) in given.iter_mut().zip(&features[row * f..][..f]) {
                    *to = (value / unit(0)).clamp(-1.0, 1.0);
                }
                for (to, value) in given[f..].iter_mut().zip(&log_scales[row * s..][..s]) {
                    *to = (value / unit(1)).clamp(-1.0, 1.0);
                }
            }
            let upload = |values: &[f32]| Buffer::upload(gpu, "test", values).expect("room");
            let words = |values: &[u32]| Buffer::upload(gpu, "test", values).expect("room");
            let (levels_there, parents_there, anchors_there) = (words(&levels), words(&parents), words(&anchors));
            let (positions_there, given_there) = (upload(&positions), upload(&before));
            let places = Places {
                levels: &levels_there,
                positions: &positions_there,
                parents: &parents_there,
                given: &given_there,
            };
            let values = [&upload(&features), &upload(&log_scales)];
            let inputs = [3, 3 + width].map(|n_in| upload(&vec![9.0; anchors.len() * n_in]));
            let mut commands = Commands::new(gpu);
            for (n_in, inputs) in [3, 3 + width].into_iter().zip(&inputs) {
                kernels.inputs(&mut commands, places, &anchors_there, n_in, inputs);
            }
            kernels.give(&mut commands, &shape, base_steps, &anchors_there, values, &given_there);
            commands.submit().expect("runs");
            for (n_in, inputs) in [3, 3 + width].into_iter().zip(&inputs) {
                let of_anchor = |a: &u32| {
                    let parent = parents[*a as usize] as usize;
                    let place = &positions[*a as usize * 3..][..3];
                    place.iter().chain(&before[parent * width..][..n_in - 3]).copied().collect::<Vec<f32>>()
                };
                let expected: Vec<f32> = anchors.iter().flat_map(of_anchor).collect();
                assert!(inputs.read(gpu).expect("runs") == expected, "{n_in} inputs of {n} anchors");
            }
            let bound = Bound { relative: 3e-7, absolute: 0.0 };
            assert_close("given", &given_there.read(gpu).expect("runs"), &given, bound);
            for level in 0..3 {
                let expected: Vec<u32> =
                    (0..).zip(&anchors).filter(|(_, a)| levels[**a as usize] == level).map(|(row, _)| row).collect();
                let found = kernels.of_level(gpu, Commands::new(gpu), places, &anchors_there, level as usize);
                assert_eq!(found.expect("runs"), expected.len());
                assert_eq!(kernels.rows.items.read(gpu).expect("runs"), expected, "level {level}");
            }
        }
    }
}
