//! Costs of assembled instructions. Beside each stands what `arm-none-eabi-as` makes its halfwords of.

#[path = "../src/thumb.rs"]
mod thumb;

use thumb::{DIVIDE, cost};

fn cycles(halfwords: &[u16]) -> u32 {
    cost(halfwords[0], halfwords.get(1).copied()).cycles
}

#[test]
fn instructions_take_what_the_manual_says() {
    for (name, halfwords, expected) in [
        ("adds r0, r1, r2", &[0x1888][..], 1),
        ("muls r0, r1", &[0x4348], 1),
        ("bx lr", &[0x4770], 1),
        ("ldr r0, [pc, #4]", &[0x4801], 2),
        ("ldr r0, [r1, r2]", &[0x5888], 2),
        ("str r0, [r1, r2]", &[0x5088], 2),
        ("str r0, [r1, #4]", &[0x6048], 1),
        ("ldrb r0, [r1, #4]", &[0x7908], 2),
        ("ldr r0, [sp, #4]", &[0x9801], 2),
        ("push {r4, r5, lr}", &[0xB530], 4),
        ("pop {r4, pc}", &[0xBD10], 3),
        ("stmia r0!, {r1, r2, r3}", &[0xC00E], 4),
        ("beq", &[0xD0FE], 1),
        ("it eq", &[0xBF08], 1),
        ("ldmia.w r0, {r4-r9}", &[0xE890, 0x03F0], 7),
        ("ldrd r0, r1, [r2]", &[0xE9D2, 0x0100], 3),
        ("strd r0, r1, [r2], #8", &[0xE8E2, 0x0102], 3),
        ("tbb [pc, r0]", &[0xE8DF, 0xF000], 2),
        ("ldr.w r0, [r1, #100]", &[0xF8D1, 0x0064], 2),
        ("str.w r0, [r1, #100]", &[0xF8C1, 0x0064], 1),
        ("str.w r0, [r1, r2, lsl #2]", &[0xF841, 0x0022], 2),
        ("add.w r0, r1, r2, lsl #2", &[0xEB01, 0x0082], 1),
        ("mla r0, r1, r2, r3", &[0xFB01, 0x3002], 2),
        ("mul.w r0, r1, r2", &[0xFB01, 0xF002], 1),
        ("smlad r0, r1, r2, r3", &[0xFB21, 0x3002], 1),
        ("umull r0, r1, r2, r3", &[0xFBA2, 0x0103], 1),
        ("udiv r0, r1, r2", &[0xFBB1, 0xF0F2], DIVIDE),
        ("bl", &[0xF7FF, 0xFFFE], 1),
        ("vmla.f32 s0, s1, s2", &[0xEE00, 0x0A81], 3),
        ("vmls.f32 s0, s1, s2", &[0xEE00, 0x0AC1], 3),
        ("vmul.f32 s0, s1, s2", &[0xEE20, 0x0A81], 1),
        ("vadd.f32 s0, s1, s2", &[0xEE30, 0x0A81], 1),
        ("vdiv.f32 s0, s1, s2", &[0xEE80, 0x0A81], 14),
        ("vsqrt.f32 s0, s1", &[0xEEB1, 0x0AE0], 14),
        ("vfma.f32 s0, s1, s2", &[0xEEA0, 0x0A81], 3),
        ("vmov.f32 s0, s1", &[0xEEB0, 0x0A60], 1),
        ("vcmp.f32 s0, #0", &[0xEEB5, 0x0A40], 1),
        ("vmrs APSR_nzcv, fpscr", &[0xEEF1, 0xFA10], 1),
        ("vcvt.u32.f32 s0, s1", &[0xEEBC, 0x0AE0], 1),
        ("vmov r0, s1", &[0xEE10, 0x0A90], 1),
        ("vmov r0, r1, s2, s3", &[0xEC51, 0x0A11], 2),
        ("vpush {d8-d15}", &[0xED2D, 0x8B10], 17),
        ("vldr d0, [r0]", &[0xED90, 0x0B00], 3),
        ("vldr s0, [r0]", &[0xED90, 0x0A00], 2),
        ("vldmia r0!, {s8-s11}", &[0xECB0, 0x4A04], 5),
        ("vstmia r0!, {s4-s7}", &[0xECA0, 0x2A04], 5),
    ] {
        assert_eq!(cycles(halfwords), expected, "{name}");
    }
}

#[test]
fn what_an_instruction_waits_for_is_the_result_before_it() {
    let of = |halfwords: [u16; 2]| cost(halfwords[0], Some(halfwords[1]));
    let multiply = of([0xEE20, 0x0A81]); // vmul.f32 s0, s1, s2
    let uses = of([0xEE30, 0x1A01]); // vadd.f32 s2, s0, s2
    let other = of([0xEE31, 0x1A01]); // vadd.f32 s2, s2, s2
    let stores = of([0xED80, 0x0A00]); // vstr s0, [r0]
    assert_eq!([uses, other, stores].map(|next| next.behind(&multiply)), [2, 1, 3]);
    let load = cost(0x6848, None); // ldr r0, [r1, #4]
    assert_eq!((load.behind(&load), load.behind(&multiply)), (1, 2), "neighbouring loads overlap");
}
