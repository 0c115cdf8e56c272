//! [`pocketsplat_kernels::ops::loss::normality`] over the columns of the anchors of a view.

use bytemuck::{Pod, Zeroable};

use crate::ops::primitives::sum::Sum;
use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel};
use pocketsplat_kernels::ops::loss::normality::{ChannelMoments, VARIANCE_FLOOR, Weights};

/// Its kernels, and the moments of the last matrix.
#[derive(Debug)]
pub struct Normality {
    squares: Kernel,
    backward: Kernel,
    sum: Sum,
    /// `[2·width]`: sums of the columns, then of their squared distances to the mean.
    sums: Buffer<f32>,
    squared: Buffer<f32>,
    n_rows: usize,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_rows: u32,
    width: u32,
    divergence: f32,
    spread: f32,
    variance_floor: f32,
}

impl Normality {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let with = |source| [GROUPS, include_str!("normality/parameters.wgsl"), source];
        Ok(Self {
            squares: Kernel::new(gpu, "normality: squares", &with(include_str!("normality/squares.wgsl"))),
            backward: Kernel::new(gpu, "normality", &with(include_str!("normality/backward.wgsl"))),
            sum: Sum::new(gpu),
            sums: Buffer::zeros(gpu, "sums of columns", 1)?,
            squared: Buffer::zeros(gpu, "squared distances to the mean", 1)?,
            n_rows: 0,
        })
    }

    /// Adds the gradient of the term of `values`, `[n, width]`, to `d_values`.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn forward_backward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        weights: &Weights<f32>,
        values: &Buffer<f32>,
        width: usize,
        d_values: &Buffer<f32>,
    ) -> Result<(), GpuError> {
        self.n_rows = values.len() / width;
        self.sums.fit(gpu, 2 * width)?;
        self.squared.fit(gpu, values.len())?;
        let parameters = Parameters {
            n_rows: self.n_rows as u32,
            width: width as u32,
            divergence: weights.divergence,
            spread: weights.spread,
            variance_floor: VARIANCE_FLOOR as f32,
        };
        self.sum.run(commands, values, width, &self.sums, 0);
        commands.run_items(&self.squares, &parameters, &[values, &self.sums, &self.squared], values.len());
        self.sum.run(commands, &self.squared, width, &self.sums, width);
        commands.run_items(&self.backward, &parameters, &[values, &self.sums, d_values], values.len());
        Ok(())
    }

    /// Mean and variance of every column, of which [`ChannelMoments::term`] makes the term; waits.
    ///
    /// # Errors
    /// As [`Buffer::read`].
    pub fn moments(&self, gpu: &Gpu) -> Result<ChannelMoments<f32>, GpuError> {
        let share = 1.0 / self.n_rows.max(1) as f32;
        let sums = self.sums.read(gpu)?;
        let (mean, variance) = sums.split_at(sums.len() / 2);
        let of = |sums: &[f32]| sums.iter().map(|sum| sum * share).collect();
        Ok(ChannelMoments { n: self.n_rows, mean: of(mean), variance: of(variance) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::{Bound, SIZES, assert_close, gpu, largest};
    use pocketsplat_kernels::finite_difference::random;

    /// Bounds: moments are sums of n numbers, known to 1e-6 of the largest number; gradients to 2e-5 of the largest, because 1 − 1/v takes
    /// differences, and to what 1e-6 of its column's largest number moves them by. A column without variance takes the tangent on both
    /// sides, which is steep.
    #[test]
    fn normality_agrees_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        // The divergence of a column without variance drowns its spread.
        for weights in [Weights { divergence: 0.3, spread: 0.7 }, Weights { divergence: 0.0, spread: 0.7 }] {
            compare(gpu, &weights);
        }
    }

    fn compare(gpu: &Gpu, weights: &Weights<f32>) {
        for (n, width) in SIZES.into_iter().zip([4, 3, 32, 50, 1]) {
            let mut values: Vec<f32> = random(1, n * width).iter().map(|v| (1.5 * v + 0.4) as f32).collect();
            if width > 3 {
                // Constant, and almost.
                for row in values.chunks_exact_mut(width) {
                    row[1] = 0.75;
                    row[2] *= 1e-4;
                }
            }
            let expected = ChannelMoments::of(&[&values], width);
            let mut d_expected = vec![0.0; values.len()];
            expected.backward(weights, &values, &mut d_expected);
            let there = Buffer::upload(gpu, "values", &values).expect("room");
            let d_values = Buffer::upload(gpu, "gradients", &vec![0.0; values.len()]).expect("room");
            let mut normality = Normality::new(gpu).expect("room");
            let mut commands = Commands::new(gpu);
            normality.forward_backward(gpu, &mut commands, weights, &there, width, &d_values).expect("room");
            commands.submit().expect("runs");
            let found = normality.moments(gpu).expect("runs");
            assert_eq!(found.n, n);
            let bound = Bound { relative: 1e-5, absolute: 2e-6 };
            assert_close("mean", &found.mean, &expected.mean, bound);
            assert_close("variance", &found.variance, &expected.variance, bound);
            let d_found = d_values.read(gpu).expect("runs");
            for column in 0..width {
                let of = |all: &[f32]| all.iter().skip(column).step_by(width).copied().collect::<Vec<f32>>();
                let variance = f64::from(expected.variance[column]).max(VARIANCE_FLOOR);
                let slope =
                    f64::from(weights.divergence) / variance + 2.0 * f64::from(weights.spread) / variance.sqrt();
                let by_mean = 1e-6 * largest(&of(&values)) * slope / n.max(1) as f64;
                let bound = Bound { relative: 2e-5, absolute: 2e-5 * largest(&d_expected) + by_mean };
                assert_close(&format!("gradient of column {column}"), &of(&d_found), &of(&d_expected), bound);
            }
        }
    }
}
