//! [`pocketsplat_kernels::ops::adam`] over arrays that stay on the device.

use bytemuck::{Pod, Zeroable};

use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel};
use pocketsplat_kernels::ops::adam::{self, BETA1, BETA2, EPSILON, Step};

/// Its kernels.
#[derive(Clone, Debug)]
pub struct Adam {
    dense: Kernel,
    rows: Kernel,
}

/// [`adam::Moments`] on the device.
#[derive(Debug)]
pub struct Moments {
    /// Running mean of the gradient.
    pub first: Buffer<f32>,
    /// Running mean of its square.
    pub second: Buffer<f32>,
}

impl Moments {
    /// Copies moments to the device.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn upload(gpu: &Gpu, moments: &adam::Moments<f32>) -> Result<Self, GpuError> {
        Ok(Self {
            first: Buffer::upload(gpu, "first moments", &moments.first)?,
            second: Buffer::upload(gpu, "second moments", &moments.second)?,
        })
    }

    /// Copies them back.
    ///
    /// # Errors
    /// As [`Buffer::read`].
    pub fn read(&self, gpu: &Gpu) -> Result<adam::Moments<f32>, GpuError> {
        Ok(adam::Moments { first: self.first.read(gpu)?, second: self.second.read(gpu)? })
    }
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_values: u32,
    width: u32,
    scale: f32,
    second_correction: f32,
    /// β and 1 − β of either moment.
    first_shares: [f32; 2],
    second_shares: [f32; 2],
    epsilon: f32,
}

impl Parameters {
    fn new(step: Step<f32>, n_values: usize, width: usize) -> Self {
        Self {
            n_values: n_values as u32,
            width: width as u32,
            scale: step.scale,
            second_correction: step.second_correction,
            first_shares: [BETA1, 1.0 - BETA1].map(|share| share as f32),
            second_shares: [BETA2, 1.0 - BETA2].map(|share| share as f32),
            epsilon: EPSILON as f32,
        }
    }
}

impl Adam {
    /// Compiles the kernels.
    pub fn new(gpu: &Gpu) -> Self {
        let with = |source| [GROUPS, include_str!("adam/update.wgsl"), source];
        Self {
            dense: Kernel::new(gpu, "Adam", &with(include_str!("adam/dense.wgsl"))),
            rows: Kernel::new(gpu, "Adam of anchors", &with(include_str!("adam/rows.wgsl"))),
        }
    }

    /// Moves `parameters` by a gradient of the same length.
    pub fn update(
        &self,
        commands: &mut Commands<'_>,
        step: Step<f32>,
        parameters: &Buffer<f32>,
        moments: &Moments,
        gradient: &Buffer<f32>,
    ) {
        let n = parameters.len();
        let buffers = [parameters as _, &moments.first as _, &moments.second as _, gradient as _];
        commands.run_items(&self.dense, &Parameters::new(step, n, n), &buffers, n);
    }

    /// Moves values of all anchors by the gradients of those that the view showed; the others have none, and their moments decay.
    ///
    /// * `parameters`: `[n, width]`. * `row_of_anchor`: `[n]`, as [`Compact`](crate::ops::primitives::compact::Compact) has it.
    /// * `gradient`: `[n_visible, width]`.
    pub fn update_rows(
        &self,
        commands: &mut Commands<'_>,
        step: Step<f32>,
        parameters: &Buffer<f32>,
        moments: &Moments,
        row_of_anchor: &Buffer<u32>,
        gradient: &Buffer<f32>,
    ) {
        let n = parameters.len();
        let width = n / row_of_anchor.len().max(1);
        let buffers = [parameters as _, &moments.first as _, &moments.second as _, gradient as _, row_of_anchor as _];
        commands.run_items(&self.rows, &Parameters::new(step, n, width), &buffers, n);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::primitives::compact::NO_ROW;
    use crate::parity::{Bound, SIZES, assert_close, gpu};
    use pocketsplat_kernels::finite_difference::random;

    fn values(seed: u64, len: usize, scale: f64) -> Vec<f32> {
        // Over ten decades, and zero.
        let of = |v: &f64| if v.abs() < 0.05 { 0.0 } else { (scale * v * 10f64.powf(10.0 * (v.abs() - 1.0))) as f32 };
        random(seed, len).iter().map(of).collect()
    }

    /// Bounds: a moment is a sum of two products, which may cancel, so it is known to 2e-7 of the larger one; a parameter to a rounding of
    /// itself and to 1e-5 of its step, which is a root and a quotient.
    fn compare(gpu: &Gpu, n: usize, width: usize, by_rows: bool) {
        let step = Step::new(0.01, 3);
        let len = n * width;
        let start = values(1, len, 1.0);
        let (m, v) = (values(2, len, 0.1), values(3, len, 0.1).iter().map(|v| v * v).collect::<Vec<f32>>());
        let is_visible = |a: usize| !by_rows || a % 3 != 1;
        let mut row_of_anchor = vec![NO_ROW; n];
        for (row, anchor) in (0..).zip((0..n).filter(|a| is_visible(*a))) {
            row_of_anchor[anchor] = row;
        }
        let n_visible = (0..n).filter(|a| is_visible(*a)).count();
        let gradient = values(4, n_visible * width, 1.0);
        let (mut p_expected, mut m_expected, mut v_expected) = (start.clone(), m.clone(), v.clone());
        let moments = adam::Moments { first: m.clone(), second: v };
        for (a, row) in row_of_anchor.iter().enumerate() {
            let g = (*row != NO_ROW).then(|| &gradient[*row as usize * width..][..width]);
            let of = a * width..(a + 1) * width;
            let (p, m, v) = (&mut p_expected[of.clone()], &mut m_expected[of.clone()], &mut v_expected[of]);
            adam::update(step, p, m, v, g);
        }
        let kernels = Adam::new(gpu);
        let parameters = Buffer::upload(gpu, "parameters", &start).expect("room");
        let moments = Moments::upload(gpu, &moments).expect("room");
        let d = Buffer::upload(gpu, "gradient", &gradient).expect("room");
        let rows = Buffer::upload(gpu, "rows", &row_of_anchor).expect("room");
        let mut commands = Commands::new(gpu);
        if by_rows {
            kernels.update_rows(&mut commands, step, &parameters, &moments, &rows, &d);
        } else {
            kernels.update(&mut commands, step, &parameters, &moments, &d);
        }
        commands.submit().expect("runs");
        let found = moments.read(gpu).expect("runs");
        for i in 0..len {
            let bound = Bound { relative: 2e-7, absolute: 2e-7 * f64::from(m[i].abs()) + 1e-37 };
            assert_close("first moment", &found.first[i..=i], &m_expected[i..=i], bound);
        }
        assert_close("second moment", &found.second, &v_expected, Bound { relative: 3e-7, absolute: 1e-37 });
        let p_found = parameters.read(gpu).expect("runs");
        for i in 0..len {
            let moved = f64::from((p_expected[i] - start[i]).abs());
            // What cancelled in the first moment moves as well.
            let doubt = f64::from(m[i].abs()) / (f64::from(v_expected[i]).sqrt() + 1e-15);
            let bound = Bound { relative: 2e-7, absolute: 1e-5 * moved + 1e-8 * doubt };
            assert_close("parameter", &p_found[i..=i], &p_expected[i..=i], bound);
        }
    }

    #[test]
    fn adam_agrees_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        for (n, width) in SIZES.into_iter().zip([3, 32, 1, 30, 7]) {
            compare(gpu, n, width, true);
            compare(gpu, n, width, false);
        }
    }
}
