//! The second core of the RP2350, and what both may use by turns.
#![expect(unsafe_code, reason = "a pointer from one core to the other, and a value that one core uses at a time")]

use core::cell::UnsafeCell;
use core::ptr;
use core::sync::atomic::{AtomicBool, AtomicPtr, Ordering};

use rp235x_hal::arch::{dsb, sev, wfe};
use rp235x_hal::multicore::{Multicore, Stack};
use rp235x_hal::pac::{PPB, PSM};
use rp235x_hal::sio::SioFifo;

/// A borrowed closure.
type Task = &'static mut (dyn FnMut() + Send);

/// Of the second core: 6 KiB, guarded. On an emulated board it takes 3.2, with a sink that keeps bytes.
static STACK: Stack<1536> = Stack::new();
/// What it is to do; nothing when it has done it.
static TASK: AtomicPtr<Task> = AtomicPtr::new(ptr::null_mut());

/// The second core, which waits.
pub(crate) struct SecondCore(());

impl SecondCore {
    /// Starts it; `None` if it does not answer.
    pub(crate) fn start(psm: &mut PSM, ppb: &mut PPB, fifo: &mut SioFifo) -> Option<Self> {
        let mut multicore = Multicore::new(psm, ppb, fifo);
        let [_, second] = multicore.cores() else { return None };
        second.spawn(STACK.take()?, work).ok().map(|()| Self(()))
    }

    /// Does `there` on the second core while `here` is done on this one; returns when both are done.
    pub(crate) fn meanwhile(&mut self, here: &mut dyn FnMut(), there: &mut (dyn FnMut() + Send)) {
        // SAFETY: the other core lets go of it before this call returns, and a panic ends the program.
        let mut task = unsafe { core::mem::transmute::<&mut (dyn FnMut() + Send), Task>(there) };
        TASK.store(&raw mut task, Ordering::Release);
        wake();
        here();
        while !TASK.load(Ordering::Acquire).is_null() {
            wfe();
        }
    }
}

/// Wakes the other core, which then sees what was written before.
fn wake() {
    dsb();
    sev();
}

/// Does one task after the other.
fn work() {
    loop {
        let task = TASK.load(Ordering::Acquire);
        if task.is_null() {
            // The event of a task that came since then is kept.
            wfe();
            continue;
        }
        // SAFETY: the first core waits, and leaves it alone, until there is no task.
        unsafe { (*task)() };
        TASK.store(ptr::null_mut(), Ordering::Release);
        wake();
    }
}

/// What both cores use by turns, such as a bus.
pub(crate) struct ByTurns<T> {
    is_taken: AtomicBool,
    value: UnsafeCell<T>,
}

// SAFETY: `with` lets one core have it at a time.
unsafe impl<T: Send> Sync for ByTurns<T> {}

impl<T> ByTurns<T> {
    pub(crate) fn new(value: T) -> Self {
        Self { is_taken: AtomicBool::new(false), value: UnsafeCell::new(value) }
    }

    /// Uses it when it is this core's turn; not from within such a use, nor from an interrupt.
    pub(crate) fn with<U>(&self, use_it: impl FnOnce(&mut T) -> U) -> U {
        while self.is_taken.swap(true, Ordering::Acquire) {
            wfe();
        }
        // SAFETY: the other core waits until `is_taken` is false again.
        let used = use_it(unsafe { &mut *self.value.get() });
        self.is_taken.store(false, Ordering::Release);
        wake();
        used
    }
}
