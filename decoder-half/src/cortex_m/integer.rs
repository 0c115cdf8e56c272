//! Sums of products of 8-bit and 16-bit integers, two products an instruction.

use core::arch::asm;

/// As [`crate::portable::integer::add_products_of_two_rows`].
// Not inlined: it has several callers, and takes all registers.
#[inline(never)]
#[must_use]
pub fn add_products_of_two_rows(sums: [i32; 2], [first, second]: [&[u8]; 2], inputs: &[i16]) -> [i32; 2] {
    let n = first.len().min(second.len()).min(inputs.len());
    let [mut sum_a, mut sum_b] = sums;
    // SAFETY: reads `n` bytes of each row and `n` inputs, which they have. Loads of a word may lie at any address.
    unsafe {
        // Of four weights those of even and of odd place, as halves of a word, times inputs put in the same order.
        asm!(
            "subs {n}, {n}, #4",
            "blo 3f",
            "2:",
            "ldr {even}, [{x}], #4",
            "ldr {odd}, [{x}], #4",
            "ldr {w}, [{a}], #4",
            "pkhbt {t}, {even}, {odd}, lsl #16",
            "pkhtb {odd}, {odd}, {even}, asr #16",
            "sxtb16 {even}, {w}",
            "sxtb16 {w}, {w}, ror #8",
            "smlad {sum_a}, {even}, {t}, {sum_a}",
            "smlad {sum_a}, {w}, {odd}, {sum_a}",
            "ldr {w}, [{b}], #4",
            "subs {n}, {n}, #4",
            "sxtb16 {even}, {w}",
            "sxtb16 {w}, {w}, ror #8",
            "smlad {sum_b}, {even}, {t}, {sum_b}",
            "smlad {sum_b}, {w}, {odd}, {sum_b}",
            "bhs 2b",
            "3:",
            "adds {n}, {n}, #4",
            "beq 5f",
            "4:",
            "ldrsh {t}, [{x}], #2",
            "ldrsb {w}, [{a}], #1",
            "ldrsb {even}, [{b}], #1",
            "mla {sum_a}, {w}, {t}, {sum_a}",
            "mla {sum_b}, {even}, {t}, {sum_b}",
            "subs {n}, {n}, #1",
            "bne 4b",
            "5:",
            a = inout(reg) first.as_ptr() => _,
            b = inout(reg) second.as_ptr() => _,
            x = inout(reg) inputs.as_ptr() => _,
            n = inout(reg) n => _,
            sum_a = inout(reg) sum_a,
            sum_b = inout(reg) sum_b,
            even = out(reg) _,
            odd = out(reg) _,
            w = out(reg) _,
            t = out(reg) _,
            options(nostack, readonly)
        );
    }
    [sum_a, sum_b]
}
