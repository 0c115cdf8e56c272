//! Exclusive prefix sums of whole numbers: reduce, then scan, so that no workgroup waits for another one.

use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel};

/// Values that one workgroup adds up.
const BLOCK: usize = 2048;

/// Its kernels, and the sums between them.
#[derive(Debug)]
pub struct Scan {
    reduce: Kernel,
    scan_sums: Kernel,
    scan_blocks: Kernel,
    sums: Buffer<u32>,
}

impl Scan {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        const SHARED: &str = include_str!("scan/block.wgsl");
        let kernel = |name, source| Kernel::new(gpu, name, &[GROUPS, SHARED, source]);
        Ok(Self {
            reduce: kernel("scan: sums of blocks", include_str!("scan/reduce.wgsl")),
            scan_sums: kernel("scan: before each block", include_str!("scan/sums.wgsl")),
            scan_blocks: kernel("scan", include_str!("scan/blocks.wgsl")),
            sums: Buffer::zeros(gpu, "sums of blocks", 1)?,
        })
    }

    /// `values[i] ← Σ_{j<i} values[j]`, and the sum of all to `total[0]`, modulo 2³².
    ///
    /// Cost: each value is read twice and written once.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn run(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        values: &Buffer<u32>,
        total: &Buffer<u32>,
    ) -> Result<(), GpuError> {
        let n_blocks = values.len().div_ceil(BLOCK);
        self.sums.fit(gpu, n_blocks)?;
        commands.run(&self.reduce, &(values.len() as u32), &[values, &self.sums], n_blocks);
        // Writes the total also where there is no block.
        commands.run(&self.scan_sums, &(n_blocks as u32), &[&self.sums, total], 1);
        commands.run(&self.scan_blocks, &(values.len() as u32), &[values, &self.sums], n_blocks);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::{SIZES, gpu};

    #[test]
    fn sums_are_exact() {
        let Some(gpu) = gpu() else { return };
        let mut scan = Scan::new(gpu).expect("room");
        let total = Buffer::upload(gpu, "total", &[7]).expect("room");
        // The last takes more blocks than a workgroup has threads.
        for n in SIZES.into_iter().chain([BLOCK, 5 * BLOCK + 3, 300 * BLOCK * 8 + 1]) {
            let values: Vec<u32> = (0..n as u32).map(|i| i.wrapping_mul(2_654_435_761) >> 20).collect();
            let buffer = Buffer::upload(gpu, "values", &values).expect("room");
            let mut commands = Commands::new(gpu);
            scan.run(gpu, &mut commands, &buffer, &total).expect("room");
            commands.submit().expect("runs");
            let mut sum = 0u32;
            let expected: Vec<u32> = values
                .iter()
                .map(|v| {
                    let before = sum;
                    sum = sum.wrapping_add(*v);
                    before
                })
                .collect();
            assert!(buffer.read(gpu).expect("runs") == expected, "{n} values");
            assert_eq!(total.read(gpu).expect("runs"), [sum], "{n} values");
        }
    }
}
