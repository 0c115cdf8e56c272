//! Cortex-M, with SysTick as the counter.
#![expect(unsafe_code, reason = "cortex-m-rt wants the fault handler declared unsafe; its body is not")]

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::Peripherals;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
pub(crate) use cortex_m_rt::entry;
use cortex_m_rt::{ExceptionFrame, exception};

use crate::stop;

/// SysTick counts 24 bits down.
const RELOAD: u32 = 0x00FF_FFFF;
/// The boards' clock has 25 MHz, and QEMU with `-icount shift=0` takes a nanosecond for an instruction.
const INSTRUCTIONS_PER_TICK: u64 = 40;

static N_WRAPS: AtomicU32 = AtomicU32::new(0);

/// Starts the counter.
pub(crate) fn start() {
    let Some(mut peripherals) = Peripherals::take() else { return };
    peripherals.SYST.set_clock_source(SystClkSource::Core);
    peripherals.SYST.set_reload(RELOAD);
    peripherals.SYST.clear_current();
    peripherals.SYST.enable_interrupt();
    peripherals.SYST.enable_counter();
}

/// Instructions since the start, in steps of 40; without `-icount shift=0` time in some unit.
pub(crate) fn instructions() -> u64 {
    loop {
        let n_wraps = N_WRAPS.load(Ordering::Relaxed);
        let ticks = RELOAD - SYST::get_current();
        if N_WRAPS.load(Ordering::Relaxed) == n_wraps {
            return (u64::from(n_wraps) * u64::from(RELOAD + 1) + u64::from(ticks)) * INSTRUCTIONS_PER_TICK;
        }
    }
}

#[exception]
fn SysTick() {
    // Nobody else writes it, and a Cortex-M0+ adds no atomics.
    N_WRAPS.store(N_WRAPS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
}

/// A bus, memory or usage fault, or a stack that left RAM: the default handler would loop for ever.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    defmt::error!("hard fault at {=u32:#010x}, called from {=u32:#010x}", frame.pc(), frame.lr());
    stop::failure()
}
