//! What differs between boards: memory (the `.x` files), entry, counter of instructions, and what happens on a fault.
//!
//! A board of your own is one more file of memory, a row in `build.rs`, and for another architecture a module like these two.

#[cfg(target_arch = "arm")]
#[path = "cortex_m.rs"]
mod processor;
#[cfg(target_arch = "riscv32")]
#[path = "riscv.rs"]
mod processor;

pub(crate) use processor::{entry, instructions, start};
