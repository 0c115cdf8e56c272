//! For tests: the device that they run on, and how near it must come to the CPU.

use std::sync::OnceLock;

use crate::{Gpu, choose};

/// Set where the tests of kernels must run; elsewhere they pass, and say so, when there is no adapter.
const NEEDED: &str = "POCKETSPLAT_NEEDS_GPU";

/// The device of this process: the first of the best kind.
pub fn gpu() -> Option<&'static Gpu> {
    static GPU: OnceLock<Option<Gpu>> = OnceLock::new();
    let gpu = GPU.get_or_init(|| match choose(None).and_then(|adapter| Gpu::open(&adapter)) {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            assert!(std::env::var_os(NEEDED).is_none(), "{NEEDED} is set: {error}");
            eprintln!("skipped, which {NEEDED}=1 forbids: {error}");
            None
        }
    });
    gpu.as_ref()
}

/// How far a value may be from the CPU's.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    /// Of the CPU's value.
    pub relative: f64,
    /// Besides.
    pub absolute: f64,
}

/// Asserts that `found` is within the bound of `expected`, value by value.
pub fn assert_close(name: &str, found: &[f32], expected: &[f32], bound: Bound) {
    assert_eq!(found.len(), expected.len(), "{name}: number of values");
    let mut worst = (0.0, 0);
    for (i, (a, b)) in found.iter().zip(expected).enumerate() {
        let (a, b) = (f64::from(*a), f64::from(*b));
        let share = if a == b { 0.0 } else { (a - b).abs() / (bound.absolute + bound.relative * b.abs()) };
        // Not `>`: NaN is the worst of all.
        if !(share <= worst.0) {
            worst = (share, i);
        }
    }
    let (share, i) = worst;
    assert!(
        share <= 1.0,
        "{name}[{i}]: {} on the device, {} on the CPU: {share:.2} of {bound:?}",
        found[i],
        expected[i]
    );
}

/// The largest magnitude.
pub fn largest(values: &[f32]) -> f64 {
    values.iter().fold(0.0, |m, v| f64::max(m, f64::from(v.abs())))
}

/// Sizes that are no multiple of a workgroup, and a multiple.
pub const SIZES: [usize; 5] = [0, 1, 255, 512, 1337];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{AdapterKind, Buffer, adapters};

    #[test]
    fn adapters_of_real_hardware_come_first() {
        assert!(AdapterKind::Discrete < AdapterKind::Integrated && AdapterKind::Other < AdapterKind::Software);
        for adapter in adapters() {
            assert!(!adapter.name.is_empty() && adapter.max_buffer_bytes > 0, "{adapter:?}");
        }
        let n = adapters().len();
        let error = choose(Some(n)).map(|adapter| adapter.name).expect_err("one more than there are");
        assert!(n == 0 || error.to_string().contains(&format!("no adapter {n}: {n} were found")), "{error}");
    }

    #[test]
    fn a_buffer_larger_than_the_adapter_allows_is_refused_with_the_numbers() {
        let Some(gpu) = gpu() else { return };
        let words = gpu.max_buffer_bytes as usize / 4 + 1;
        let error = Buffer::<f32>::zeros(gpu, "numbers", words).map(|b| b.len()).expect_err("too large");
        let said = error.to_string();
        assert!(said.contains(&(4 * words).to_string()) && said.contains(&gpu.max_buffer_bytes.to_string()), "{said}");
        assert_eq!(gpu.check(), Ok(()), "the device is none the worse");
    }
}
