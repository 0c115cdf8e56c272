//! The ways in which the program ends; each hands QEMU an exit code.

use core::panic::PanicInfo;

use semihosting::process;

/// Ends with exit code 0.
pub(crate) fn success() -> ! {
    process::exit(0)
}

/// Ends with exit code 1.
pub(crate) fn failure() -> ! {
    process::exit(1)
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    defmt::error!("panic: {}", defmt::Display2Format(info));
    failure()
}
