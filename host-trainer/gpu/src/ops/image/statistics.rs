//! What growth and pruning learn from a view: `train::density::statistics` over slots.

use bytemuck::{Pod, Zeroable};

use crate::{Buffer, Commands, GROUPS, Gpu, Kernel, RECORDS};
use pocketsplat_kernels::ops::heads::neural_gaussians::Gaussian;
use pocketsplat_kernels::ops::image::project::{Footprint, Splat};

/// Its kernels.
#[derive(Clone, Debug)]
pub struct Statistics {
    add: Kernel,
    count: Kernel,
}

/// Running sums of all anchors.
#[derive(Clone, Copy, Debug)]
pub struct Sums<'a> {
    /// `[n]` Σ over views of Σ_k max(α, 0).
    pub opacities: &'a Buffer<f32>,
    /// `[n]` views that saw the anchor.
    pub n_views: &'a Buffer<u32>,
    /// `[n, K]` Σ over views of ‖∂L/∂mean‖, units of half the image.
    pub gradients: &'a Buffer<f32>,
    /// `[n, K]` views in which the offset reached a pixel.
    pub n_drawn: &'a Buffer<u32>,
}

/// The slots of a view.
#[derive(Clone, Copy, Debug)]
pub struct Slots<'a> {
    /// `[n_visible]`
    pub anchors: &'a Buffer<u32>,
    /// `[n_visible·K]`, as all others.
    pub gaussians: &'a Buffer<Gaussian<f32>>,
    /// See above.
    pub footprints: &'a Buffer<Footprint<f32>>,
    /// See above.
    pub d_splats: &'a Buffer<Splat<f32>>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    half_size_px: [f32; 2],
    n_anchors: u32,
    n_offsets: u32,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Counted {
    n_slots: u32,
    counter: u32,
}

impl Statistics {
    /// Compiles the kernels.
    pub fn new(gpu: &Gpu) -> Self {
        let kernel = |name, source| Kernel::new(gpu, name, &[GROUPS, RECORDS, source]);
        Self {
            add: kernel("statistics", include_str!("statistics/add.wgsl")),
            count: kernel("number of splats", include_str!("statistics/count.wgsl")),
        }
    }

    /// Adds one view, after its backward pass.
    ///
    /// * `size_px`: of its image.
    pub fn add(&self, commands: &mut Commands<'_>, size_px: [usize; 2], slots: Slots<'_>, sums: Sums<'_>) {
        let n_anchors = slots.anchors.len();
        let parameters = Parameters {
            half_size_px: size_px.map(|s| (0.5 * s as f64) as f32),
            n_anchors: n_anchors as u32,
            n_offsets: (slots.gaussians.len() / n_anchors.max(1)) as u32,
        };
        let Slots { anchors, gaussians, footprints, d_splats } = slots;
        let of_view = [anchors as _, gaussians as _, footprints as _, d_splats as _];
        let of_all = [sums.opacities as _, sums.n_views as _, sums.gradients as _, sums.n_drawn as _];
        commands.run_items(&self.add, &parameters, &[of_view, of_all].concat(), n_anchors);
    }

    /// Adds the number of slots with a splat to `counters[counter]`.
    pub fn count(
        &self,
        commands: &mut Commands<'_>,
        footprints: &Buffer<Footprint<f32>>,
        counters: &Buffer<u32>,
        counter: usize,
    ) {
        let parameters = Counted { n_slots: footprints.len() as u32, counter: counter as u32 };
        commands.run_items(&self.count, &parameters, &[footprints, counters], footprints.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::{Bound, SIZES, assert_close, gpu};
    use pocketsplat_kernels::finite_difference::random;

    /// Bounds: the same sums of a view in the same order; products and a root may be fused or off by three units of the last place. Counts
    /// are exact.
    #[test]
    fn statistics_agree_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        let kernels = Statistics::new(gpu);
        for (n_visible, k) in SIZES.into_iter().zip([3, 1, 10, 4, 7]) {
            let (n, n_slots, size_px) = (2 * n_visible + 1, n_visible * k, [40usize, 30]);
            let anchors: Vec<u32> = (0..n_visible as u32).map(|i| 2 * i + 1).collect();
            let of = |seed, len| random(seed, len).iter().map(|v| *v as f32).collect::<Vec<f32>>();
            let numbers = of(1, 4 * n_slots);
            let gaussian = |v: &[f32]| Gaussian { opacity: v[0].max(0.0), ..Gaussian::default() };
            let footprint =
                |v: &[f32]| Footprint { depth: if v[0] > 0.2 { 2.0 } else { 0.0 }, half_extent_px: [1.0; 2] };
            let d_splat = |v: &[f32]| Splat { mean_px: [v[1], v[2]], ..Splat::default() };
            let gaussians: Vec<_> = numbers.chunks_exact(4).map(gaussian).collect();
            let footprints: Vec<_> = numbers.chunks_exact(4).map(footprint).collect();
            let d_splats: Vec<_> = numbers.chunks_exact(4).map(d_splat).collect();
            let (mut opacities, mut gradients) = (of(2, n), of(3, n * k));
            let (mut n_views, mut n_drawn) = (vec![3u32; n], vec![5u32; n * k]);

            let upload = |values: &[f32]| Buffer::upload(gpu, "test", values).expect("room");
            let count = |values: &[u32]| Buffer::upload(gpu, "test", values).expect("room");
            let on_device = (upload(&opacities), count(&n_views), upload(&gradients), count(&n_drawn));
            let (a, counters) = (count(&anchors), count(&[7, 1]));
            let g = Buffer::upload(gpu, "test", &gaussians).expect("room");
            let f = Buffer::upload(gpu, "test", &footprints).expect("room");
            let d = Buffer::upload(gpu, "test", &d_splats).expect("room");
            let slots = Slots { anchors: &a, gaussians: &g, footprints: &f, d_splats: &d };
            let sums =
                Sums { opacities: &on_device.0, n_views: &on_device.1, gradients: &on_device.2, n_drawn: &on_device.3 };
            let mut commands = Commands::new(gpu);
            kernels.add(&mut commands, size_px, slots, sums);
            kernels.count(&mut commands, &f, &counters, 1);
            commands.submit().expect("runs");

            for (row, anchor) in anchors.iter().map(|a| *a as usize).enumerate() {
                n_views[anchor] += 1;
                for offset in 0..k {
                    let (slot, at) = (row * k + offset, anchor * k + offset);
                    opacities[anchor] += gaussians[slot].opacity;
                    if footprints[slot].depth > 0.0 {
                        let [x, y] = d_splats[slot].mean_px;
                        gradients[at] += ((20.0 * x) * (20.0 * x) + (15.0 * y) * (15.0 * y)).sqrt();
                        n_drawn[at] += 1;
                    }
                }
            }
            let bound = Bound { relative: 1e-6, absolute: 1e-6 };
            assert_close("opacities", &on_device.0.read(gpu).expect("runs"), &opacities, bound);
            assert_close("gradients", &on_device.2.read(gpu).expect("runs"), &gradients, bound);
            assert_eq!(on_device.1.read(gpu).expect("runs"), n_views);
            assert_eq!(on_device.3.read(gpu).expect("runs"), n_drawn);
            let n_splats = footprints.iter().filter(|f| f.depth > 0.0).count() as u32;
            assert_eq!(counters.read(gpu).expect("runs"), [7, 1 + n_splats], "{n_slots} slots");
        }
    }
}
