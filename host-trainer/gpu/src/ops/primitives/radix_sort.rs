//! Sorts pairs of key and value by key, stably: four bits a pass, reduce-then-scan over counts of digits.

use std::mem;

use bytemuck::{Pod, Zeroable};

use super::scan::Scan;
use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel};

/// Pairs that one workgroup takes.
const BLOCK: usize = 2048;

/// Bits of a digit: its 16 counts of all 256 threads fill half of the shared memory that every adapter has.
const DIGIT_BITS: u32 = 4;

/// Its kernels, and what they write between them.
#[derive(Debug)]
pub struct RadixSort {
    count: Kernel,
    scatter: Kernel,
    scan: Scan,
    counts: Buffer<u32>,
    total: Buffer<u32>,
    other: Pairs,
}

/// Keys and their values, of one length.
#[derive(Debug)]
pub struct Pairs {
    /// What is sorted by.
    pub keys: Buffer<u32>,
    /// What goes with it.
    pub values: Buffer<u32>,
}

impl Pairs {
    /// Room for `len` pairs.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn zeros(gpu: &Gpu, len: usize) -> Result<Self, GpuError> {
        Ok(Self { keys: Buffer::zeros(gpu, "keys to sort", len)?, values: Buffer::zeros(gpu, "values to sort", len)? })
    }

    /// Makes room for `len` pairs, whose contents are left open.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn fit(&mut self, gpu: &Gpu, len: usize) -> Result<(), GpuError> {
        self.keys.fit(gpu, len)?;
        self.values.fit(gpu, len)
    }
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_pairs: u32,
    n_blocks: u32,
    shift: u32,
}

impl RadixSort {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        const SHARED: &str = include_str!("radix_sort/digit.wgsl");
        let kernel = |name, source| Kernel::new(gpu, name, &[GROUPS, SHARED, source]);
        Ok(Self {
            count: kernel("sort: count", include_str!("radix_sort/count.wgsl")),
            scatter: kernel("sort: scatter", include_str!("radix_sort/scatter.wgsl")),
            scan: Scan::new(gpu)?,
            counts: Buffer::zeros(gpu, "counts of digits", 1)?,
            total: Buffer::zeros(gpu, "total", 1)?,
            other: Pairs::zeros(gpu, 1)?,
        })
    }

    /// Sorts by the low `bits` of the keys; equal ones keep their order.
    ///
    /// Cost: per four bits two reads and one write of every pair.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn run(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        pairs: &mut Pairs,
        bits: u32,
    ) -> Result<(), GpuError> {
        let n_pairs = pairs.keys.len();
        let n_blocks = n_pairs.div_ceil(BLOCK);
        self.other.fit(gpu, n_pairs)?;
        self.counts.fit(gpu, n_blocks << DIGIT_BITS)?;
        for shift in (0..bits).step_by(DIGIT_BITS as usize) {
            let parameters = Parameters { n_pairs: n_pairs as u32, n_blocks: n_blocks as u32, shift };
            commands.run(&self.count, &parameters, &[&pairs.keys, &self.counts], n_blocks);
            self.scan.run(gpu, commands, &self.counts, &self.total)?;
            let (from, to) = (&*pairs, &self.other);
            let buffers = [&from.keys as _, &from.values as _, &self.counts as _, &to.keys as _, &to.values as _];
            commands.run(&self.scatter, &parameters, &buffers, n_blocks);
            mem::swap(pairs, &mut self.other);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::{SIZES, gpu};

    #[test]
    fn pairs_are_sorted_and_equal_keys_keep_their_order() {
        let Some(gpu) = gpu() else { return };
        let mut sort = RadixSort::new(gpu).expect("room");
        let hash = |i: u32| i.wrapping_mul(2_654_435_761) ^ (i >> 3).wrapping_mul(40_503);
        // All bits; few different keys; all the same; sorted already; the wrong way round.
        let key = |kind: u32, i: u32| match kind {
            0 => hash(i),
            1 => hash(i) % 600,
            2 => u32::MAX,
            3 => i,
            _ => u32::MAX - i,
        };
        for n in SIZES.into_iter().chain([BLOCK, 40_001]) {
            for kind in 0..5 {
                let bits = if kind == 1 { 10 } else { 32 };
                let keys: Vec<u32> = (0..n as u32).map(|i| key(kind, i)).collect();
                let values: Vec<u32> = (0..n as u32).map(|i| i + 5).collect();
                let mut pairs = Pairs {
                    keys: Buffer::upload(gpu, "keys", &keys).expect("room"),
                    values: Buffer::upload(gpu, "values", &values).expect("room"),
                };
                let mut commands = Commands::new(gpu);
                sort.run(gpu, &mut commands, &mut pairs, bits).expect("room");
                commands.submit().expect("runs");
                let mut expected: Vec<(u32, u32)> = keys.into_iter().zip(values).collect();
                expected.sort_by_key(|(key, _)| *key);
                let (keys, values) = (pairs.keys.read(gpu).expect("runs"), pairs.values.read(gpu).expect("runs"));
                assert!(keys.into_iter().zip(values).eq(expected), "{n} keys of kind {kind}");
            }
        }
    }
}
