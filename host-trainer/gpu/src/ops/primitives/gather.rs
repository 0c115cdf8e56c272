//! Rows of some anchors out of arrays of all, and back: what a step does with what the view shows, and with a sample of that.

use bytemuck::{Pod, Zeroable};

use crate::{Buffer, Commands, GROUPS, Gpu, Kernel};

/// Its kernels.
#[derive(Clone, Debug)]
pub struct Gather {
    rows: Kernel,
    add_back: Kernel,
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
        let with = |source| [GROUPS, include_str!("gather/parameters.wgsl"), source];
        Self {
            rows: Kernel::new(gpu, "gather rows", &with(include_str!("gather/rows.wgsl"))),
            add_back: Kernel::new(gpu, "add rows back", &with(include_str!("gather/add_back.wgsl"))),
        }
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

    /// `values[indices[r], c] += rows[r, c]`.
    ///
    /// * `indices`: no two are equal.
    pub fn add_back(
        &self,
        commands: &mut Commands<'_>,
        rows: &Buffer<f32>,
        width: usize,
        indices: &Buffer<u32>,
        values: &Buffer<f32>,
    ) {
        let n_values = indices.len() * width;
        let parameters = Parameters { n_values: n_values as u32, width: width as u32 };
        commands.run_items(&self.add_back, &parameters, &[rows, indices, values], n_values);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::{SIZES, gpu};

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

    #[test]
    fn rows_are_added_where_they_came_from() {
        let Some(gpu) = gpu() else { return };
        let gather = Gather::new(gpu);
        for (n, width) in SIZES.into_iter().zip([3, 32, 1, 30, 7]) {
            let indices: Vec<u32> = (0..n as u32).filter(|i| i % 3 != 1).collect();
            // Sums of small whole numbers are exact.
            let rows: Vec<f32> = (0..indices.len() * width).map(|i| (i % 1000) as f32).collect();
            let mut expected: Vec<f32> = (0..n * width).map(|i| (i % 77) as f32).collect();
            let values = Buffer::upload(gpu, "values", &expected).expect("room");
            for (i, row) in indices.iter().zip(rows.chunks(width)) {
                let sums = &mut expected[*i as usize * width..][..width];
                sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += value);
            }
            let rows = Buffer::upload(gpu, "rows", &rows).expect("room");
            let indices = Buffer::upload(gpu, "indices", &indices).expect("room");
            let mut commands = Commands::new(gpu);
            gather.add_back(&mut commands, &rows, width, &indices, &values);
            commands.submit().expect("runs");
            assert!(values.read(gpu).expect("runs") == expected, "{n} rows of {width}");
        }
    }
}
