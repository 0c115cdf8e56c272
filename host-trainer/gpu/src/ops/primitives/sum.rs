//! Sums of many numbers in an order that is always the same.

use bytemuck::{Pod, Zeroable};

use crate::{Buffer, Commands, Gpu, Kernel};

/// Its kernel.
#[derive(Clone, Debug)]
pub struct Sum {
    columns: Kernel,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_rows: u32,
    n_columns: u32,
    first_total: u32,
}

impl Sum {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu) -> Self {
        Self { columns: Kernel::new(gpu, "sum", &[include_str!("sum/columns.wgsl")]) }
    }

    /// `totals[first_total + c] = Σ_r parts[r, c]`: 256 sums of every 256th row each, then these in a tree.
    ///
    /// * `parts`: `[n_rows, n_columns]`, added up in f32.
    pub fn run(
        &self,
        commands: &mut Commands<'_>,
        parts: &Buffer<f32>,
        n_columns: usize,
        totals: &Buffer<f32>,
        first_total: usize,
    ) {
        let n_rows = (parts.len() / n_columns) as u32;
        let parameters = Parameters { n_rows, n_columns: n_columns as u32, first_total: first_total as u32 };
        commands.run(&self.columns, &parameters, &[parts, totals], n_columns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::{Bound, SIZES, assert_close, gpu};
    use pocketsplat_kernels::finite_difference::random;

    /// Bound: 256 lanes and a tree of 8 levels lose a few units of the last place of the sum of the magnitudes.
    #[test]
    fn columns_are_added_up() {
        let Some(gpu) = gpu() else { return };
        let sum = Sum::new(gpu);
        for n_rows in SIZES.into_iter().chain([100_003]) {
            let parts: Vec<f32> = random(4, 3 * n_rows).into_iter().map(|v| v as f32).collect();
            let buffer = Buffer::upload(gpu, "parts", &parts).expect("room");
            let totals = Buffer::upload(gpu, "totals", &[5.0; 4]).expect("room");
            let mut commands = Commands::new(gpu);
            sum.run(&mut commands, &buffer, 3, &totals, 1);
            commands.submit().expect("runs");
            let column = |c: usize| parts.iter().skip(c).step_by(3).map(|v| f64::from(*v)).sum::<f64>() as f32;
            let expected = [5.0, column(0), column(1), column(2)];
            let bound = Bound { relative: 1e-6, absolute: 1e-6 * (1.0 + n_rows as f64) };
            assert_close("totals", &totals.read(gpu).expect("runs"), &expected, bound);
        }
    }
}
