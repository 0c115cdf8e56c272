//! Dense layers with loads of many registers at once: rows of weights are read by one instruction each.

use core::arch::asm;

use crate::portable::layer;
pub use crate::portable::layer::LANES;

/// Assembly that adds to each first register the second one times an input. The product takes the place of the weight.
///
/// Products are rounded before they are added. A product and a sum take a cycle each, VMLA three; none waits for the one before.
macro_rules! add_products {
    ($input:literal: $($sum:literal $weight:literal),+) => {
        concat!(
            $("vmul.f32 ", $weight, ", ", $weight, ", ", $input, "\n",)+
            $("vadd.f32 ", $sum, ", ", $sum, ", ", $weight, "\n",)+
        )
    };
}

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
            add_products!("s8": "s0" "s12", "s1" "s13", "s2" "s14", "s3" "s15", "s4" "s16", "s5" "s17", "s6" "s18", "s7" "s19"),
            add_products!("s9": "s0" "s20", "s1" "s21", "s2" "s22", "s3" "s23", "s4" "s24", "s5" "s25", "s6" "s26", "s7" "s27"),
            "vldmia {w}!, {{s12-s27}}",
            add_products!("s10": "s0" "s12", "s1" "s13", "s2" "s14", "s3" "s15", "s4" "s16", "s5" "s17", "s6" "s18", "s7" "s19"),
            add_products!("s11": "s0" "s20", "s1" "s21", "s2" "s22", "s3" "s23", "s4" "s24", "s5" "s25", "s6" "s26", "s7" "s27"),
            "subs {n}, {n}, #1",
            "bne 2b",
            "3:",
            "ands {n}, {n_in}, #3",
            "beq 5f",
            "4:",
            "vldmia {x}!, {{s8}}",
            "vldmia {w}!, {{s12-s19}}",
            add_products!("s8": "s0" "s12", "s1" "s13", "s2" "s14", "s3" "s15", "s4" "s16", "s5" "s17", "s6" "s18", "s7" "s19"),
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
            add_products!("s3": "s0" "s7", "s1" "s8", "s2" "s9"),
            add_products!("s4": "s0" "s10", "s1" "s11", "s2" "s12"),
            add_products!("s5": "s0" "s13", "s1" "s14", "s2" "s15"),
            add_products!("s6": "s0" "s16", "s1" "s17", "s2" "s18"),
            "subs {n}, {n}, #1",
            "bne 2b",
            "3:",
            "ands {n}, {rows}, #3",
            "beq 5f",
            "4:",
            "vldmia {x}!, {{s3}}",
            "vldmia {w}!, {{s7-s9}}",
            add_products!("s3": "s0" "s7", "s1" "s8", "s2" "s9"),
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
            add_products!("s7": "s0" "s11", "s1" "s12", "s2" "s13", "s3" "s14", "s4" "s15", "s5" "s16", "s6" "s17"),
            add_products!("s8": "s0" "s18", "s1" "s19", "s2" "s20", "s3" "s21", "s4" "s22", "s5" "s23", "s6" "s24"),
            "vldmia {w}!, {{s11-s24}}",
            add_products!("s9": "s0" "s11", "s1" "s12", "s2" "s13", "s3" "s14", "s4" "s15", "s5" "s16", "s6" "s17"),
            add_products!("s10": "s0" "s18", "s1" "s19", "s2" "s20", "s3" "s21", "s4" "s22", "s5" "s23", "s6" "s24"),
            "subs {n}, {n}, #1",
            "bne 2b",
            "3:",
            "ands {n}, {rows}, #3",
            "beq 5f",
            "4:",
            "vldmia {x}!, {{s7}}",
            "vldmia {w}!, {{s11-s17}}",
            add_products!("s7": "s0" "s11", "s1" "s12", "s2" "s13", "s3" "s14", "s4" "s15", "s5" "s16", "s6" "s17"),
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
