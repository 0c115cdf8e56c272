//! Rows of some anchors out of arrays of all: what a step does first with what the view shows.

use bytemuck::{Pod, Zeroable};

use crate::gpu::{Buffer, Commands, GROUPS, Gpu, Kernel};

/// Its kernel.
#[derive(Clone, Debug)]
pub struct Gather {
    rows: Kernel,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_values: u32,
    width: u32,
}

impl Gather {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu) -> Self {
        Self { rows: Kernel::new(gpu, "gather rows", &[GROUPS, include_str!("gather/rows.wgsl")]) }
    }

    /// `rows[r, c] = values[indices[r], c]`.
    ///
    /// * `values`: `[n, width]` of one word each. * `indices`: `[n_rows]`, below n. * `rows`: `[n_rows, width]`.
    pub fn run<T: Pod>(
        &self,
        commands: &mut Commands<'_>,
        values: &Buffer<T>,
        width: usize,
        indices: &Buffer<u32>,
        rows: &Buffer<T>,
    ) {
        const { assert!(size_of::<T>() == 4, "values of one word") };
        let n_values = indices.len() * width;
        let parameters = Parameters { n_values: n_values as u32, width: width as u32 };
        commands.run_items(&self.rows, &parameters, &[values, indices, rows], n_values);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::parity::{SIZES, gpu};

    #[test]
    fn rows_are_those_of_the_indices() {
        let Some(gpu) = gpu() else { return };
        let gather = Gather::new(gpu);
        for (n, width) in SIZES.into_iter().zip([3, 32, 1, 30, 7]) {
            let values: Vec<u32> = (0..(n * width) as u32).map(|i| i.wrapping_mul(0x9e37_79b9)).collect();
            let indices: Vec<u32> = (0..n as u32).filter(|i| i % 3 != 1).collect();
            let expected: Vec<u32> =
                indices.iter().flat_map(|i| &values[*i as usize * width..][..width]).copied().collect();
            let rows = Buffer::upload(gpu, "rows", &vec![7u32; expected.len()]).expect("room");
            let values = Buffer::upload(gpu, "values", &values).expect("room");
            let indices = Buffer::upload(gpu, "indices", &indices).expect("room");
            let mut commands = Commands::new(gpu);
            gather.run(&mut commands, &values, width, &indices, &rows);
            commands.submit().expect("runs");
            assert!(rows.read(gpu).expect("runs") == expected, "{n} rows of {width}");
        }
    }
}
