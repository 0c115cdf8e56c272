//! Dense layers with loads of many registers at once: rows of weights are read by one instruction each.

use core::arch::asm;

use crate::portable::layer;
pub use crate::portable::layer::LANES;

/// As [`layer::rectified_units`].
pub fn rectified_units(rows: &[[f32; LANES]], rows_per_block: usize, inputs: &[f32], units: &mut [[f32; LANES]]) {
    let rows_per_block = rows_per_block.max(1);
    let n_in = inputs.len().min(rows_per_block - 1);
    let n_blocks = units.len().min(rows.len() / rows_per_block);
    if n_blocks == 0 {
        return;
    }
    // SAFETY: of each of `n_blocks` blocks of `rows_per_block` rows, which `rows` has, it reads the first `1 + n_in` rows, and for each
    // block `n_in` inputs, which `inputs` has; it writes `n_blocks` times 8 floats, which `units` has. Registers are given as
    // clobbered.
    unsafe {
        // Products are rounded before they are added. A product and a sum take a cycle each, VMLA three; none waits for the one before.
        // BIC clears what is negative.
        asm!(
            "1:",
            "vldmia {w}!, {{s0-s7}}",
            "mov {x}, {inputs}",
            "lsrs {n}, {n_in}, #2",
            "beq 3f",
            "2:",
            "vldmia {x}!, {{s8-s11}}",
            "vldmia {w}!, {{s12-s27}}",
            "vmul.f32 s12, s12, s8",
            "vmul.f32 s13, s13, s8",
            "vmul.f32 s14, s14, s8",
            "vmul.f32 s15, s15, s8",
            "vmul.f32 s16, s16, s8",
            "vmul.f32 s17, s17, s8",
            "vmul.f32 s18, s18, s8",
            "vmul.f32 s19, s19, s8",
            "vadd.f32 s0, s0, s12",
            "vadd.f32 s1, s1, s13",
            "vadd.f32 s2, s2, s14",
            "vadd.f32 s3, s3, s15",
            "vadd.f32 s4, s4, s16",
            "vadd.f32 s5, s5, s17",
            "vadd.f32 s6, s6, s18",
            "vadd.f32 s7, s7, s19",
            "vmul.f32 s20, s20, s9",
            "vmul.f32 s21, s21, s9",
            "vmul.f32 s22, s22, s9",
            "vmul.f32 s23, s23, s9",
            "vmul.f32 s24, s24, s9",
            "vmul.f32 s25, s25, s9",
            "vmul.f32 s26, s26, s9",
            "vmul.f32 s27, s27, s9",
            "vadd.f32 s0, s0, s20",
            "vadd.f32 s1, s1, s21",
            "vadd.f32 s2, s2, s22",
            "vadd.f32 s3, s3, s23",
            "vadd.f32 s4, s4, s24",
            "vadd.f32 s5, s5, s25",
            "vadd.f32 s6, s6, s26",
            "vadd.f32 s7, s7, s27",
            "vldmia {w}!, {{s12-s27}}",
            "vmul.f32 s12, s12, s10",
            "vmul.f32 s13, s13, s10",
            "vmul.f32 s14, s14, s10",
            "vmul.f32 s15, s15, s10",
            "vmul.f32 s16, s16, s10",
            "vmul.f32 s17, s17, s10",
            "vmul.f32 s18, s18, s10",
            "vmul.f32 s19, s19, s10",
            "vadd.f32 s0, s0, s12",
            "vadd.f32 s1, s1, s13",
            "vadd.f32 s2, s2, s14",
            "vadd.f32 s3, s3, s15",
            "vadd.f32 s4, s4, s16",
            "vadd.f32 s5, s5, s17",
            "vadd.f32 s6, s6, s18",
            "vadd.f32 s7, s7, s19",
            "vmul.f32 s20, s20, s11",
            "vmul.f32 s21, s21, s11",
            "vmul.f32 s22, s22, s11",
            "vmul.f32 s23, s23, s11",
            "vmul.f32 s24, s24, s11",
            "vmul.f32 s25, s25, s11",
            "vmul.f32 s26, s26, s11",
            "vmul.f32 s27, s27, s11",
            "vadd.f32 s0, s0, s20",
            "vadd.f32 s1, s1, s21",
            "vadd.f32 s2, s2, s22",
            "vadd.f32 s3, s3, s23",
            "vadd.f32 s4, s4, s24",
            "vadd.f32 s5, s5, s25",
            "vadd.f32 s6, s6, s26",
            "vadd.f32 s7, s7, s27",
            "subs {n}, {n}, #1",
            "bne 2b",
            "3:",
            "ands {n}, {n_in}, #3",
            "beq 5f",
            "4:",
            "vldmia {x}!, {{s8}}",
            "vldmia {w}!, {{s12-s19}}",
            "vmul.f32 s12, s12, s8",
            "vmul.f32 s13, s13, s8",
            "vmul.f32 s14, s14, s8",
            "vmul.f32 s15, s15, s8",
            "vmul.f32 s16, s16, s8",
            "vmul.f32 s17, s17, s8",
            "vmul.f32 s18, s18, s8",
            "vmul.f32 s19, s19, s8",
            "vadd.f32 s0, s0, s12",
            "vadd.f32 s1, s1, s13",
            "vadd.f32 s2, s2, s14",
            "vadd.f32 s3, s3, s15",
            "vadd.f32 s4, s4, s16",
            "vadd.f32 s5, s5, s17",
            "vadd.f32 s6, s6, s18",
            "vadd.f32 s7, s7, s19",
            "subs {n}, {n}, #1",
            "bne 4b",
            "5:",
            "vmov {n}, {x}, s0, s1",
            "bic {n}, {n}, {n}, asr #31",
            "bic {x}, {x}, {x}, asr #31",
            "strd {n}, {x}, [{units}], #8",
            "vmov {n}, {x}, s2, s3",
            "bic {n}, {n}, {n}, asr #31",
            "bic {x}, {x}, {x}, asr #31",
            "strd {n}, {x}, [{units}], #8",
            "vmov {n}, {x}, s4, s5",
            "bic {n}, {n}, {n}, asr #31",
            "bic {x}, {x}, {x}, asr #31",
            "strd {n}, {x}, [{units}], #8",
            "vmov {n}, {x}, s6, s7",
            "bic {n}, {n}, {n}, asr #31",
            "bic {x}, {x}, {x}, asr #31",
            "strd {n}, {x}, [{units}], #8",
            "add {w}, {w}, {skipped}",
            "subs {n_blocks}, {n_blocks}, #1",
            "bne 1b",
            w = inout(reg) rows.as_ptr() => _,
            inputs = in(reg) inputs.as_ptr(),
            n_in = in(reg) n_in,
            units = inout(reg) units.as_mut_ptr() => _,
            skipped = in(reg) (rows_per_block - 1 - n_in) * size_of::<[f32; LANES]>(),
            n_blocks = inout(reg) n_blocks => _,
            x = out(reg) _,
            n = out(reg) _,
            out("s0") _, out("s1") _, out("s2") _, out("s3") _, out("s4") _, out("s5") _, out("s6") _, out("s7") _,
            out("s8") _, out("s9") _, out("s10") _, out("s11") _, out("s12") _, out("s13") _, out("s14") _, out("s15") _,
            out("s16") _, out("s17") _, out("s18") _, out("s19") _, out("s20") _, out("s21") _, out("s22") _, out("s23") _,
            out("s24") _, out("s25") _, out("s26") _, out("s27") _,
            options(nostack)
        );
    }
}

/// As [`layer::outputs`].
#[inline(always)]
#[must_use]
pub fn outputs<const B: usize>(block: &[[f32; B]], inputs: &[f32]) -> [f32; B] {
    let Some(([biases], weights)) = block.split_first_chunk::<1>() else { return [0.0; B] };
    let n = weights.len().min(inputs.len());
    let mut sums = *biases;
    let (sums_at, weights_at) = (sums.as_mut_ptr(), weights.as_ptr().cast::<f32>());
    // SAFETY: `sums` has B floats, `weights` `n` rows of B, `inputs` `n`.
    unsafe {
        match B {
            3 => add_rows_of_3(sums_at, weights_at, inputs.as_ptr(), n),
            7 => add_rows_of_7(sums_at, weights_at, inputs.as_ptr(), n),
            _ => return layer::outputs(block, inputs),
        }
    }
    sums
}

/// Adds `n` rows of three weights times an input each to as many sums.
///
/// # Safety
/// `sums` points to 3 floats, `weights` to 3 times `n`, `inputs` to `n`.
// Not inlined: it takes all registers of the FPU.
#[inline(never)]
unsafe fn add_rows_of_3(sums: *mut f32, weights: *const f32, inputs: *const f32, n: usize) {
    // SAFETY: reads and writes what the caller vouches for. Registers are given as clobbered.
    unsafe {
        asm!(
            "vldmia {sums}, {{s0-s2}}",
            "lsrs {n}, {rows}, #2",
            "beq 3f",
            "2:",
            "vldmia {x}!, {{s3-s6}}",
            "vldmia {w}!, {{s7-s18}}",
            "vmul.f32 s7, s7, s3",
            "vmul.f32 s8, s8, s3",
            "vmul.f32 s9, s9, s3",
            "vadd.f32 s0, s0, s7",
            "vadd.f32 s1, s1, s8",
            "vadd.f32 s2, s2, s9",
            "vmul.f32 s10, s10, s4",
            "vmul.f32 s11, s11, s4",
            "vmul.f32 s12, s12, s4",
            "vadd.f32 s0, s0, s10",
            "vadd.f32 s1, s1, s11",
            "vadd.f32 s2, s2, s12",
            "vmul.f32 s13, s13, s5",
            "vmul.f32 s14, s14, s5",
            "vmul.f32 s15, s15, s5",
            "vadd.f32 s0, s0, s13",
            "vadd.f32 s1, s1, s14",
            "vadd.f32 s2, s2, s15",
            "vmul.f32 s16, s16, s6",
            "vmul.f32 s17, s17, s6",
            "vmul.f32 s18, s18, s6",
            "vadd.f32 s0, s0, s16",
            "vadd.f32 s1, s1, s17",
            "vadd.f32 s2, s2, s18",
            "subs {n}, {n}, #1",
            "bne 2b",
            "3:",
            "ands {n}, {rows}, #3",
            "beq 5f",
            "4:",
            "vldmia {x}!, {{s3}}",
            "vldmia {w}!, {{s7-s9}}",
            "vmul.f32 s7, s7, s3",
            "vmul.f32 s8, s8, s3",
            "vmul.f32 s9, s9, s3",
            "vadd.f32 s0, s0, s7",
            "vadd.f32 s1, s1, s8",
            "vadd.f32 s2, s2, s9",
            "subs {n}, {n}, #1",
            "bne 4b",
            "5:",
            "vstmia {sums}, {{s0-s2}}",
            sums = in(reg) sums,
            rows = in(reg) n,
            w = inout(reg) weights => _,
            x = inout(reg) inputs => _,
            n = out(reg) _,
            out("s0") _, out("s1") _, out("s2") _, out("s3") _, out("s4") _, out("s5") _, out("s6") _, out("s7") _,
            out("s8") _, out("s9") _, out("s10") _, out("s11") _, out("s12") _, out("s13") _, out("s14") _, out("s15") _,
            out("s16") _, out("s17") _, out("s18") _,
            options(nostack)
        );
    }
}

/// Adds `n` rows of seven weights times an input each to as many sums.
///
/// # Safety
/// `sums` points to 7 floats, `weights` to 7 times `n`, `inputs` to `n`.
// Not inlined: it takes all registers of the FPU.
#[inline(never)]
unsafe fn add_rows_of_7(sums: *mut f32, weights: *const f32, inputs: *const f32, n: usize) {
    // SAFETY: reads and writes what the caller vouches for. Registers are given as clobbered.
    unsafe {
        asm!(
            "vldmia {sums}, {{s0-s6}}",
            "lsrs {n}, {rows}, #2",
            "beq 3f",
            "2:",
            "vldmia {x}!, {{s7-s10}}",
            "vldmia {w}!, {{s11-s24}}",
            "vmul.f32 s11, s11, s7",
            "vmul.f32 s12, s12, s7",
            "vmul.f32 s13, s13, s7",
            "vmul.f32 s14, s14, s7",
            "vmul.f32 s15, s15, s7",
            "vmul.f32 s16, s16, s7",
            "vmul.f32 s17, s17, s7",
            "vadd.f32 s0, s0, s11",
            "vadd.f32 s1, s1, s12",
            "vadd.f32 s2, s2, s13",
            "vadd.f32 s3, s3, s14",
            "vadd.f32 s4, s4, s15",
            "vadd.f32 s5, s5, s16",
            "vadd.f32 s6, s6, s17",
            "vmul.f32 s18, s18, s8",
            "vmul.f32 s19, s19, s8",
            "vmul.f32 s20, s20, s8",
            "vmul.f32 s21, s21, s8",
            "vmul.f32 s22, s22, s8",
            "vmul.f32 s23, s23, s8",
            "vmul.f32 s24, s24, s8",
            "vadd.f32 s0, s0, s18",
            "vadd.f32 s1, s1, s19",
            "vadd.f32 s2, s2, s20",
            "vadd.f32 s3, s3, s21",
            "vadd.f32 s4, s4, s22",
            "vadd.f32 s5, s5, s23",
            "vadd.f32 s6, s6, s24",
            "vldmia {w}!, {{s11-s24}}",
            "vmul.f32 s11, s11, s9",
            "vmul.f32 s12, s12, s9",
            "vmul.f32 s13, s13, s9",
            "vmul.f32 s14, s14, s9",
            "vmul.f32 s15, s15, s9",
            "vmul.f32 s16, s16, s9",
            "vmul.f32 s17, s17, s9",
            "vadd.f32 s0, s0, s11",
            "vadd.f32 s1, s1, s12",
            "vadd.f32 s2, s2, s13",
            "vadd.f32 s3, s3, s14",
            "vadd.f32 s4, s4, s15",
            "vadd.f32 s5, s5, s16",
            "vadd.f32 s6, s6, s17",
            "vmul.f32 s18, s18, s10",
            "vmul.f32 s19, s19, s10",
            "vmul.f32 s20, s20, s10",
            "vmul.f32 s21, s21, s10",
            "vmul.f32 s22, s22, s10",
            "vmul.f32 s23, s23, s10",
            "vmul.f32 s24, s24, s10",
            "vadd.f32 s0, s0, s18",
            "vadd.f32 s1, s1, s19",
            "vadd.f32 s2, s2, s20",
            "vadd.f32 s3, s3, s21",
            "vadd.f32 s4, s4, s22",
            "vadd.f32 s5, s5, s23",
            "vadd.f32 s6, s6, s24",
            "subs {n}, {n}, #1",
            "bne 2b",
            "3:",
            "ands {n}, {rows}, #3",
            "beq 5f",
            "4:",
            "vldmia {x}!, {{s7}}",
            "vldmia {w}!, {{s11-s17}}",
            "vmul.f32 s11, s11, s7",
            "vmul.f32 s12, s12, s7",
            "vmul.f32 s13, s13, s7",
            "vmul.f32 s14, s14, s7",
            "vmul.f32 s15, s15, s7",
            "vmul.f32 s16, s16, s7",
            "vmul.f32 s17, s17, s7",
            "vadd.f32 s0, s0, s11",
            "vadd.f32 s1, s1, s12",
            "vadd.f32 s2, s2, s13",
            "vadd.f32 s3, s3, s14",
            "vadd.f32 s4, s4, s15",
            "vadd.f32 s5, s5, s16",
            "vadd.f32 s6, s6, s17",
            "subs {n}, {n}, #1",
            "bne 4b",
            "5:",
            "vstmia {sums}, {{s0-s6}}",
            sums = in(reg) sums,
            rows = in(reg) n,
            w = inout(reg) weights => _,
            x = inout(reg) inputs => _,
            n = out(reg) _,
            out("s0") _, out("s1") _, out("s2") _, out("s3") _, out("s4") _, out("s5") _, out("s6") _, out("s7") _,
            out("s8") _, out("s9") _, out("s10") _, out("s11") _, out("s12") _, out("s13") _, out("s14") _, out("s15") _,
            out("s16") _, out("s17") _, out("s18") _, out("s19") _, out("s20") _, out("s21") _, out("s22") _, out("s23") _,
            out("s24") _,
            options(nostack)
        );
    }
}
