//! Conversions by the FPU of a Cortex-M.
//!
//! Values come and go in core registers, because stable Rust does not let assembly name those of the FPU as operands. It does let it
//! name them as clobbered.
#![expect(unsafe_code, reason = "stable Rust has no other way to these instructions")]

#[cfg(cortex_m_dsp)]
pub(crate) mod integer;
pub(crate) mod layer;
pub(crate) mod root;
pub(crate) mod rows;
pub(crate) mod symbols;

use core::arch::asm;

#[cfg(not(cortex_m_dsp))]
pub(crate) use crate::portable::integer;

use crate::portable;

/// Whether the processor converts halves itself.
pub const IN_HARDWARE: bool = true;

/// The bits of the half nearest to `x`, ties to even; what is larger than 65,504 in magnitude becomes that, NaN too.
#[inline(always)]
#[must_use]
pub fn to_half(x: f32) -> u16 {
    let mut bits = x.to_bits();
    // SAFETY: moves a number to a register that is given as clobbered, converts it there, and moves it back.
    unsafe {
        asm!(
            "vmov s0, {bits}",
            "vcvtb.f16.f32 s0, s0",
            "vmov {bits}, s0",
            bits = inout(reg) bits,
            out("s0") _,
            options(pure, nomem, nostack)
        );
    }
    let bits = bits as u16;
    if portable::is_finite_half(bits) { bits } else { bits & 0x8000 | 0x7BFF }
}

/// The value of the bits of a finite half, exactly.
///
/// Of other bits it is at least 65,536 in magnitude, or NaN, and not the same on every target.
#[inline(always)]
#[must_use]
pub fn from_half(bits: u16) -> f32 {
    let mut value = u32::from(bits);
    // SAFETY: as in `to_half`.
    unsafe {
        asm!(
            "vmov s0, {value}",
            "vcvtb.f32.f16 s0, s0",
            "vmov {value}, s0",
            value = inout(reg) value,
            out("s0") _,
            options(pure, nomem, nostack)
        );
    }
    f32::from_bits(value)
}

/// The values of four, as [`from_half`].
#[inline(always)]
#[must_use]
pub fn from_halves([a, b, c, d]: [u16; 4]) -> [f32; 4] {
    let pair = |low, high| u32::from(low) | u32::from(high) << 16;
    let [mut first, mut second] = [pair(a, b), pair(c, d)];
    let (third, fourth): (u32, u32);
    // SAFETY: as in `to_half`.
    unsafe {
        asm!(
            "vmov s1, s2, {first}, {second}",
            "vcvtb.f32.f16 s0, s1",
            "vcvtt.f32.f16 s1, s1",
            "vcvtt.f32.f16 s3, s2",
            "vcvtb.f32.f16 s2, s2",
            "vmov {first}, {second}, s0, s1",
            "vmov {third}, {fourth}, s2, s3",
            first = inout(reg) first,
            second = inout(reg) second,
            third = lateout(reg) third,
            fourth = lateout(reg) fourth,
            out("s0") _, out("s1") _, out("s2") _, out("s3") _,
            options(pure, nomem, nostack)
        );
    }
    [first, second, third, fourth].map(f32::from_bits)
}

/// Adds to two rows of eight sums each: `sums[i][lane] += weights[row][lane]·inputs[i][row]`, rows in order.
///
/// Weights are finite halves. Every product and every sum is rounded to f32. It ends with the shortest of the slices.
///
/// # Budget
/// 29 instructions for 16 products. More where `weights` do not lie at a multiple of four bytes.
pub fn add_products(sums: &mut [[f32; 8]; 2], weights: &[[u16; 8]], inputs: [&[f32]; 2]) {
    let [first, second] = inputs;
    let n_rows = weights.len().min(first.len()).min(second.len());
    let pairs = weights.as_ptr().cast::<u32>();
    // Loads of several words fault elsewhere.
    if !pairs.is_aligned() {
        return portable::add_products(sums, weights, inputs);
    }
    if n_rows == 0 {
        return;
    }
    // SAFETY: reads `n_rows` rows of four words of `weights`, which has as many and begins at a word, and as many floats of each
    // input, which has as many; reads and writes the 16 floats of `sums`. Registers are given as clobbered.
    unsafe {
        // The product is rounded before it is added: VMLA is not fused, VFMA is.
        asm!(
            "vldmia {sums}, {{s0-s15}}",
            "2:",
            "vldmia {pairs}!, {{s16-s19}}",
            "vldmia {first}!, {{s20}}",
            "vldmia {second}!, {{s21}}",
            "vcvtb.f32.f16 s22, s16",
            "vcvtt.f32.f16 s23, s16",
            "vmla.f32 s0, s22, s20",
            "vmla.f32 s8, s22, s21",
            "vmla.f32 s1, s23, s20",
            "vmla.f32 s9, s23, s21",
            "vcvtb.f32.f16 s22, s17",
            "vcvtt.f32.f16 s23, s17",
            "vmla.f32 s2, s22, s20",
            "vmla.f32 s10, s22, s21",
            "vmla.f32 s3, s23, s20",
            "vmla.f32 s11, s23, s21",
            "vcvtb.f32.f16 s22, s18",
            "vcvtt.f32.f16 s23, s18",
            "vmla.f32 s4, s22, s20",
            "vmla.f32 s12, s22, s21",
            "vmla.f32 s5, s23, s20",
            "vmla.f32 s13, s23, s21",
            "vcvtb.f32.f16 s22, s19",
            "vcvtt.f32.f16 s23, s19",
            "vmla.f32 s6, s22, s20",
            "vmla.f32 s14, s22, s21",
            "vmla.f32 s7, s23, s20",
            "vmla.f32 s15, s23, s21",
            "subs {n}, {n}, #1",
            "bne 2b",
            "vstmia {sums}, {{s0-s15}}",
            sums = in(reg) sums.as_mut_ptr(),
            pairs = inout(reg) pairs => _,
            first = inout(reg) first.as_ptr() => _,
            second = inout(reg) second.as_ptr() => _,
            n = inout(reg) n_rows => _,
            out("s0") _, out("s1") _, out("s2") _, out("s3") _, out("s4") _, out("s5") _, out("s6") _, out("s7") _,
            out("s8") _, out("s9") _, out("s10") _, out("s11") _, out("s12") _, out("s13") _, out("s14") _, out("s15") _,
            out("s16") _, out("s17") _, out("s18") _, out("s19") _, out("s20") _, out("s21") _, out("s22") _, out("s23") _,
            options(nostack)
        );
    }
}
