//! The ways in which the program ends; each hands QEMU an exit code.
#![expect(unsafe_code, reason = "cortex-m-rt wants the fault handler declared unsafe; its body is not")]

use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, exception};
use semihosting::process;

/// Ends with exit code 0.
pub fn success() -> ! {
    process::exit(0)
}

/// Ends with exit code 1.
pub fn failure() -> ! {
    process::exit(1)
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    defmt::error!("panic: {}", defmt::Display2Format(info));
    failure()
}

/// A bus, memory or usage fault: the default handler would loop for ever.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    defmt::error!("hard fault at {=u32:#010x}, called from {=u32:#010x}", frame.pc(), frame.lr());
    failure()
}
