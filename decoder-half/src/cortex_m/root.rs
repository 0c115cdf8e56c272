//! The square root by the FPU, which rounds it correctly.

use core::arch::asm;

/// As [`crate::portable::root::sqrt`].
#[inline(always)]
#[must_use]
pub fn sqrt(x: f32) -> f32 {
    let mut bits = x.to_bits();
    // SAFETY: moves a number to a register that is given as clobbered, takes its root there, and moves it back.
    unsafe {
        asm!(
            "vmov s0, {bits}",
            "vsqrt.f32 s0, s0",
            "vmov {bits}, s0",
            bits = inout(reg) bits,
            out("s0") _,
            options(pure, nomem, nostack)
        );
    }
    f32::from_bits(bits)
}
