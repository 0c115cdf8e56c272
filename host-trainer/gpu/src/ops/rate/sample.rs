//! The anchors of a view whose bits are counted: `step/sample.rs` on the device.

use bytemuck::{Pod, Zeroable};

use super::noise::STREAM;
use crate::ops::primitives::compact::Compact;
use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel};
use pocketsplat_kernels::ops::rate::noise::Stream;
use pocketsplat_kernels::step::sample::SAMPLE_DRAW;

/// Its kernel, and the rows of the last view.
#[derive(Debug)]
pub struct Sample {
    mark: Kernel,
    /// The sampled rows of the view's anchors, ascending.
    pub rows: Compact,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_rows: u32,
    stream: u32,
    draw: u32,
    share: f32,
}

impl Sample {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let mark = Kernel::new(gpu, "sample", &[GROUPS, STREAM, include_str!("sample/mark.wgsl")]);
        Ok(Self { mark, rows: Compact::new(gpu)? })
    }

    /// Lists the rows of the anchors whose draw is below `share` times their weights: the CPU's. Returns their number, for which it waits.
    ///
    /// * `view_weights`: of all anchors. * `anchors`: `[n_rows]`.
    ///
    /// # Errors
    /// [`GpuError`].
    pub fn run(
        &mut self,
        gpu: &Gpu,
        mut commands: Commands<'_>,
        stream: Stream,
        share: f64,
        view_weights: &Buffer<f32>,
        anchors: &Buffer<u32>,
    ) -> Result<usize, GpuError> {
        let n_rows = anchors.len();
        self.rows.fit(gpu, n_rows)?;
        #[expect(clippy::cast_possible_truncation, reason = "a share")]
        let share = share as f32;
        let parameters = Parameters { n_rows: n_rows as u32, stream: stream.word(), draw: SAMPLE_DRAW, share };
        commands.run_items(&self.mark, &parameters, &[anchors as _, view_weights as _, &self.rows.marks as _], n_rows);
        self.rows.run(gpu, commands)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::{SIZES, gpu};
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::step::sample::holds;

    #[test]
    fn the_sample_is_the_cpus() {
        let Some(gpu) = gpu() else { return };
        let mut kernels = Sample::new(gpu).expect("room");
        let stream = Stream::of_run(3).branch(70);
        for (n, share) in SIZES.into_iter().zip([0.5, 1.0, 0.05, 0.0, 0.3]) {
            let anchors: Vec<u32> = (0..n as u32).map(|i| 3 * i + 1).collect();
            let view_weights: Vec<f32> = random(7, 3 * n + 1).iter().map(|r| (1.0 + 0.9 * r) as f32).collect();
            let is_sampled = |a: u32| holds(stream, a, share, &view_weights);
            let expected: Vec<u32> = (0..n as u32).filter(|row| is_sampled(anchors[*row as usize])).collect();
            let anchors = Buffer::upload(gpu, "anchors", &anchors).expect("room");
            let view_weights = Buffer::upload(gpu, "view weights", &view_weights).expect("room");
            let found = kernels.run(gpu, Commands::new(gpu), stream, share, &view_weights, &anchors).expect("runs");
            assert_eq!((found, kernels.rows.items.read(gpu).expect("runs")), (expected.len(), expected));
        }
    }
}
