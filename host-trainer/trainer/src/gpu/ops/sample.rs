//! The anchors of a view whose bits are counted: those with a draw below a share.

use bytemuck::{Pod, Zeroable};

use super::compact::Compact;
use super::noise::STREAM;
use crate::gpu::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel};
use crate::ops::noise::Stream;

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
    end: u32,
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

    /// Lists the rows of the anchors whose `draw`-th number is below `share`: the CPU's. Returns their number, for which it waits.
    ///
    /// * `anchors`: `[n_rows]`.
    ///
    /// # Errors
    /// [`GpuError`].
    pub fn run(
        &mut self,
        gpu: &Gpu,
        mut commands: Commands<'_>,
        stream: Stream,
        draw: u32,
        share: f64,
        anchors: &Buffer<u32>,
    ) -> Result<usize, GpuError> {
        let n_rows = anchors.len();
        self.rows.fit(gpu, n_rows)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 2²⁴")]
        let end = (share * f64::from(1 << 24)).ceil().clamp(0.0, f64::from(1 << 24)) as u32;
        let parameters = Parameters { n_rows: n_rows as u32, stream: stream.word(), draw, end };
        commands.run_items(&self.mark, &parameters, &[anchors, &self.rows.marks], n_rows);
        self.rows.run(gpu, commands)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::parity::{SIZES, gpu};

    #[test]
    fn the_sample_is_the_cpus() {
        let Some(gpu) = gpu() else { return };
        let mut sample = Sample::new(gpu).expect("room");
        let stream = Stream::of_run(3).branch(70);
        for (n, share) in SIZES.into_iter().zip([0.5, 1.0, 0.05, 0.0, 0.3]) {
            let anchors: Vec<u32> = (0..n as u32).map(|i| 3 * i + 1).collect();
            let is_sampled = |a: u32| f64::from(stream.branch(a).uniform(u32::MAX)) < share;
            let expected: Vec<u32> = (0..n as u32).filter(|row| is_sampled(anchors[*row as usize])).collect();
            let anchors = Buffer::upload(gpu, "anchors", &anchors).expect("room");
            let found = sample.run(gpu, Commands::new(gpu), stream, u32::MAX, share, &anchors).expect("runs");
            assert_eq!((found, sample.rows.items.read(gpu).expect("runs")), (expected.len(), expected));
        }
    }
}
