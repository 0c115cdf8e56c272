#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(test)]
extern crate std;

// Cortex-M: Cortex-A and Cortex-R, whose FPUs may lack the conversions, have 64-bit atomics.
#[cfg(all(target_arch = "arm", target_abi = "eabihf", target_os = "none", not(target_has_atomic = "64")))]
#[path = "cortex_m.rs"]
mod chosen;
pub mod portable;
#[cfg(not(all(target_arch = "arm", target_abi = "eabihf", target_os = "none", not(target_has_atomic = "64"))))]
use portable as chosen;

pub use chosen::{IN_HARDWARE, add_products, from_half, from_halves, to_half};
pub use portable::is_finite_half;
