//! How many gradients no parameter may be moved by: those that are infinite, NaN, or too large for their square.

use bytemuck::{Pod, Zeroable};

use crate::{Bind, Buffer, Commands, GROUPS, Gpu, Kernel};

/// Its kernel.
#[derive(Clone, Debug)]
pub struct Sound {
    count: Kernel,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_values: u32,
    limit: f32,
    counter: u32,
}

impl Sound {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu) -> Self {
        Self { count: Kernel::new(gpu, "sound gradients", &[GROUPS, include_str!("sound/count.wgsl")]) }
    }

    /// Adds to `counters[counter]` how many of the first `n_values` numbers are not at most `limit` in magnitude.
    pub fn count(
        &self,
        commands: &mut Commands<'_>,
        values: &dyn Bind,
        n_values: usize,
        limit: f32,
        counters: &Buffer<u32>,
        counter: usize,
    ) {
        let parameters = Parameters { n_values: n_values as u32, limit, counter: counter as u32 };
        commands.run_items(&self.count, &parameters, &[values, counters], n_values);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::gpu;

    #[test]
    fn what_is_infinite_or_no_number_or_too_large_is_counted() {
        let Some(gpu) = gpu() else { return };
        let kernel = Sound::new(gpu);
        for n in [0, 1, 255, 512, 1337] {
            let mut values = vec![1e18_f32; n];
            let bad = [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.1e18, -2e18, f32::MAX];
            for (i, bad) in bad.iter().enumerate().take(n) {
                values[i * (n / 7).max(1)] = *bad;
            }
            let limit = 1e18_f32;
            let expected = values.iter().filter(|v| !(v.abs() <= limit)).count() as u32;
            assert!(n == 0 || expected > 0);
            let upload = Buffer::upload(gpu, "test", &values).expect("room");
            let counters = Buffer::upload(gpu, "test", &[0u32, 5]).expect("room");
            let mut commands = Commands::new(gpu);
            kernel.count(&mut commands, &upload, n, limit, &counters, 1);
            commands.submit().expect("runs");
            assert_eq!(counters.read(gpu).expect("runs"), [0, 5 + expected]);
        }
    }
}
