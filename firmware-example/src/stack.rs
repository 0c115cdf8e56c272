//! How deep the stack went: it is painted when the program starts, and the paint that is left is counted.
#![expect(unsafe_code, reason = "reads and writes memory that only the linker knows, below everything in use")]

use core::hint::black_box;
use core::ptr;

/// Hardly ever a value that a program keeps.
const PAINT: u32 = 0xC0DE_1DEA;
/// Bytes below the marker that the painting function itself may use.
const MARGIN: usize = 256;

unsafe extern "C" {
    /// The lowest address of the stack.
    static _stack_end: u32;
    /// The address above its highest.
    static _stack_start: u32;
}

fn bounds() -> [*mut u32; 2] {
    // Only their addresses are taken.
    [&raw const _stack_end, &raw const _stack_start].map(<*const u32>::cast_mut)
}

/// Bytes there are.
pub(crate) fn len() -> usize {
    let [end, start] = bounds();
    start as usize - end as usize
}

/// Paints what is free now, and returns the bytes in use, within a few words.
#[inline(never)]
pub(crate) fn paint() -> usize {
    let marker = 0_u32;
    let [end, start] = bounds();
    let here = &raw const *black_box(&marker) as usize;
    let n_words = (here - MARGIN).saturating_sub(end as usize) / 4;
    for i in 0..n_words {
        // SAFETY: from the end of the stack up to a margin below this function's own frame nothing is in use.
        unsafe { ptr::write_volatile(end.add(i), PAINT) };
    }
    start as usize - here
}

/// Bytes that were ever in use since then.
pub(crate) fn most_used() -> usize {
    let [end, _] = bounds();
    let n_words = len() / 4;
    // SAFETY: all of it is memory of the stack, and a volatile read of any word of it is a number.
    let n_left = (0..n_words).take_while(|&i| unsafe { ptr::read_volatile(end.add(i)) } == PAINT).count();
    len() - 4 * n_left
}
