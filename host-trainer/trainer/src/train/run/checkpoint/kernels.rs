//! What this machine computes with, as far as it can change the bits of a run.

use std::fmt;

use serde::{Deserialize, Serialize};

use pocketsplat_kernels::ops::heads::matmul::{Matrix, multiply};
use pocketsplat_kernels::ops::simd::Level;
use pocketsplat_kernels::real::Real;

/// The program, the instruction sets, and what a small calculation gave.
///
/// Sums of matrix products and the system's exponentials may differ in the last bit from one CPU or C library to
/// another; two machines with equal kernels train the same bits.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Kernels {
    /// In words: program version, system, instruction sets.
    pub description: String,
    /// CRC-32 of the bits of a matrix product and of the elementary functions at some points.
    pub probe: u32,
}

impl Kernels {
    /// Those of this machine, with loops at `level`.
    pub fn of_this_machine(level: Level) -> Self {
        let description = format!(
            "pocketsplat {}, {} {}, loops {level}, matrix products {}",
            env!("CARGO_PKG_VERSION"),
            std::env::consts::ARCH,
            std::env::consts::OS,
            matrix_instructions()
        );
        Self { description, probe: probe() }
    }
}

impl fmt::Display for Kernels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, probe {:08x}", self.description, self.probe)
    }
}

/// The instruction sets among which `matrixmultiply` chooses its kernels, as far as this CPU has them.
fn matrix_instructions() -> String {
    #[cfg(target_arch = "x86_64")]
    let found = [
        (is_x86_feature_detected!("avx512f"), "AVX-512"),
        (is_x86_feature_detected!("fma"), "FMA"),
        (is_x86_feature_detected!("avx2"), "AVX2"),
        (is_x86_feature_detected!("avx"), "AVX"),
    ];
    #[cfg(not(target_arch = "x86_64"))]
    let found = [(true, "baseline")];
    let names: Vec<&str> = found.into_iter().filter(|(has, _)| *has).map(|(_, name)| name).collect();
    if names.is_empty() { "baseline".to_owned() } else { names.join("+") }
}

/// Long enough sums for every kernel to take its main loop and its remainder.
fn probe() -> u32 {
    let [m, k, n] = [33, 71, 19];
    let values = |n: usize, step: f64| (0..n).map(|i| f32::real((i as f64 * step) % 1.7 - 0.8)).collect::<Vec<_>>();
    let (a, b, mut product) = (values(m * k, 0.377), values(k * n, 0.711), vec![0.0f32; m * n]);
    multiply(Matrix::new(&a, m, k), Matrix::new(&b, k, n), false, &mut product);
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(bytemuck::cast_slice(&product));
    for i in 1..500 {
        let x = f64::from(i) * 0.0137;
        let wide = [x.exp(), x.ln(), x.powf(1.3), x.tan(), x.sqrt(), x.cbrt()];
        let narrow = f32::real(x);
        hasher.update(bytemuck::cast_slice(&wide));
        hasher.update(bytemuck::cast_slice(&[Real::exp(-narrow), Real::ln(narrow), Real::sqrt(narrow), narrow.tanh()]));
    }
    hasher.finalize()
}
