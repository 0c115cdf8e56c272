//! RISC-V, with the retired instructions as the counter.
#![expect(unsafe_code, reason = "the start-up code looks for its exception handler by name")]

use riscv::register::{mcause, mepc, minstret};
use riscv_rt::TrapFrame;
pub(crate) use riscv_rt::entry;

use crate::stop;

/// The counter runs from the start.
pub(crate) fn start() {}

/// Instructions since the start.
pub(crate) fn instructions() -> u64 {
    minstret::read64()
}

/// Any exception: the default handler would loop for ever.
#[unsafe(export_name = "ExceptionHandler")]
fn exception(_frame: &TrapFrame) -> ! {
    defmt::error!("exception {=usize} at {=usize:#010x}", mcause::read().code(), mepc::read());
    stop::failure()
}
