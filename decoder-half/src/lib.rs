#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(test)]
extern crate std;

// Cortex-M: Cortex-A and Cortex-R, whose FPUs may lack the conversions, have 64-bit atomics.
#[cfg(all(target_arch = "arm", target_abi = "eabihf", target_os = "none", not(target_has_atomic = "64")))]
mod cortex_m;
#[cfg(all(target_arch = "arm", target_abi = "eabihf", target_os = "none", not(target_has_atomic = "64")))]
use cortex_m as chosen;
pub mod portable;
#[cfg(not(all(target_arch = "arm", target_abi = "eabihf", target_os = "none", not(target_has_atomic = "64"))))]
use portable as chosen;

pub use chosen::integer::add_products_of_two_rows;
pub use chosen::layer::{LANES, outputs, rectified_units};
pub use chosen::root::sqrt;
pub use chosen::rows::{
    BlendConstants, Exponential, ROW_LEN, RowSplat, RowsWork, SLACK_PX, blend_rows, span, sqrt_above,
};
pub use chosen::symbols::{
    ChannelTables, Entries, FREQUENCY_TOTAL, LEVELS_AT_ONCE, LevelFrequencies, NODE_CONTEXTS, PRECISION_BITS,
    STATE_MIN, Stream, TABLE_WORDS, descend, read_values,
};
pub use chosen::{IN_HARDWARE, add_products, from_half, from_halves, to_half};
pub use portable::is_finite_half;
