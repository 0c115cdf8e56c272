//! The second core of an SSE-200: it starts once and does what the first one hands it.
#![expect(unsafe_code, reason = "registers of the chip, and a pointer from one core to the other")]

use core::ptr;
use core::sync::atomic::{AtomicPtr, AtomicUsize, Ordering};

use cortex_m::Peripherals;
use cortex_m::register::msplim;
use cortex_m_rt::{ExceptionFrame, exception};
use static_cell::ConstStaticCell;

use crate::stop;

/// What the second core starts with, and which cores wait after reset: registers of the SSE-200's system controller, secure.
const INITSVTOR1: *mut u32 = 0x5002_1114 as *mut u32;
const CPUWAIT: *mut u32 = 0x5002_1118 as *mut u32;
/// Words of a vector table up to its last exception.
const N_VECTORS: usize = 16;

/// Hardly ever a value that a program keeps.
const PAINT: u64 = 0xC0DE_1DEA_C0DE_1DEA;

/// A borrowed closure.
type Task = &'static mut (dyn FnMut() + Send);

/// Where the core finds its stack, its first instruction and its faults.
#[repr(align(128))]
struct Vectors([u32; N_VECTORS]);

static VECTORS: ConstStaticCell<Vectors> = ConstStaticCell::new(Vectors([0; N_VECTORS]));
/// The first word of its stack, and the number of words.
static STACK: (AtomicPtr<u64>, AtomicUsize) = (AtomicPtr::new(ptr::null_mut()), AtomicUsize::new(0));
/// What the second core is to do; nothing when it has done it.
static TASK: AtomicPtr<Task> = AtomicPtr::new(ptr::null_mut());

/// The second core, which waits.
pub(crate) struct SecondCore(());

impl SecondCore {
    /// Starts it, with `stack`.
    pub(crate) fn start(stack: &'static mut [u64]) -> Self {
        stack.fill(PAINT);
        STACK.0.store(stack.as_mut_ptr(), Ordering::Relaxed);
        STACK.1.store(stack.len(), Ordering::Relaxed);
        let Vectors(vectors) = VECTORS.take();
        vectors.fill(fault as *const () as u32);
        let [end, start, ..] = vectors;
        (*end, *start) = (stack.as_ptr_range().end as u32, reset as *const () as u32);
        // The register that guards it is the core's own, so that the core sets it.
        let [.., limit] = vectors;
        *limit = stack.as_ptr() as u32;
        // SAFETY: registers of the chip, which nothing else writes; the table stays where it is.
        unsafe {
            INITSVTOR1.write_volatile(ptr::from_mut(vectors) as u32);
            // Table and stack are written before the core reads them.
            cortex_m::asm::dsb();
            CPUWAIT.write_volatile(0);
        }
        Self(())
    }

    /// Does `task` there while `own` is done here; returns when both are done.
    pub(crate) fn meanwhile<T>(&mut self, task: &mut (dyn FnMut() + Send), own: impl FnOnce() -> T) -> T {
        // SAFETY: the other core lets go of it before this call returns, and a panic ends the program.
        let mut task = unsafe { core::mem::transmute::<&mut (dyn FnMut() + Send), Task>(task) };
        TASK.store(&raw mut task, Ordering::Release);
        let done = own();
        // No hint that it waits: QEMU then leaves out what the plugin does at the next instruction.
        while !TASK.load(Ordering::Acquire).is_null() {}
        done
    }
}

/// Bytes of its stack that were ever in use.
pub(crate) fn most_used() -> usize {
    let (start, len) = (STACK.0.load(Ordering::Relaxed), STACK.1.load(Ordering::Relaxed));
    // SAFETY: all of it is memory of the stack, and a volatile read of any word of it is a number.
    let n_left = (0..len).take_while(|&i| unsafe { start.add(i).read_volatile() } == PAINT).count();
    8 * (len - n_left)
}

/// The first instruction of the second core.
extern "C" fn reset() -> ! {
    // SAFETY: the registers are the core's own; the last vector, which SysTick would have, is the end of its stack.
    unsafe {
        let mut own = Peripherals::steal();
        own.SCB.enable_fpu();
        let vectors = own.SCB.vtor.read() as *const u32;
        msplim::write(vectors.add(N_VECTORS - 1).read());
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    work()
}

/// Does one task after the other.
// Not inlined: its caller has switched the FPU on.
#[inline(never)]
fn work() -> ! {
    loop {
        let task = TASK.load(Ordering::Acquire);
        if task.is_null() {
            continue;
        }
        // SAFETY: the first core waits, and leaves it alone, until there is no task.
        unsafe { (*task)() };
        TASK.store(ptr::null_mut(), Ordering::Release);
    }
}

/// Any exception of the second core.
extern "C" fn fault() -> ! {
    stop::failure()
}

/// A fault of the first core: the default handler would loop for ever.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    defmt::error!("hard fault at {=u32:#010x}, called from {=u32:#010x}", frame.pc(), frame.lr());
    stop::failure()
}
