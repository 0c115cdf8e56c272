//! What a Thumb instruction takes on a Cortex-M4: "Cortex-M4 Technical Reference Manual", tables 3-1 and 7-1 (ARM 100166, 100165).
//!
//! Zero wait states. A division takes 2 to 12 cycles; [`DIVIDE`] is counted.

/// Cycles of an integer division.
pub const DIVIDE: u32 = 8;

/// What matters to the instruction behind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Cycles by itself.
    pub cycles: u32,
    /// A load or store of one register, whose address phase may overlap with the data phase of one before.
    pub is_single: bool,
    /// Registers of the FPU whose arithmetic result comes a cycle later, a bit each.
    pub late: u32,
    /// Registers of the FPU that it reads, a bit each.
    pub reads: u32,
}

impl Cost {
    const fn of(cycles: u32) -> Self {
        Self { cycles, is_single: false, late: 0, reads: 0 }
    }

    const fn single(cycles: u32) -> Self {
        Self { is_single: true, ..Self::of(cycles) }
    }

    /// Cycles behind `before`.
    #[must_use]
    pub fn behind(&self, before: &Self) -> u32 {
        let overlap = u32::from(self.is_single && before.is_single && self.cycles > 1);
        let wait = u32::from(self.reads & before.late != 0);
        self.cycles - overlap + wait
    }
}

/// The cost of an instruction of one or two halfwords.
#[must_use]
pub fn cost(first: u16, second: Option<u16>) -> Cost {
    match second {
        None => narrow(first),
        Some(second) => wide(first, second),
    }
}

fn narrow(code: u16) -> Cost {
    let registers = (code & 0xFF).count_ones();
    match code >> 12 {
        0b0100 if code & 0x0800 != 0 => Cost::single(2),
        // Stores with an offset in a register are STR, STRH, STRB.
        0b0101 => Cost::single(2),
        0b0110..=0b1001 if code >> 12 != 0b0100 => Cost::single(if code & 0x0800 != 0 { 2 } else { 1 }),
        0b1011 if code & 0x0600 == 0x0400 => Cost::of(1 + registers + u32::from(code >> 8 & 1)),
        0b1100 => Cost::of(1 + registers),
        _ => Cost::of(1),
    }
}

fn wide(first: u16, second: u16) -> Cost {
    match first >> 9 {
        // 1110 100: several registers, two registers, exclusive, table branches.
        0b111_0100 if first & 0x0040 == 0 => Cost::of(1 + second.count_ones()),
        0b111_0100 if first & 0xFFF0 == 0xE8D0 && second & 0xFFE0 == 0xF000 => Cost::of(2),
        0b111_0100 if first & 0x0120 == 0 => Cost::of(2),
        0b111_0100 => Cost::of(3),
        // 1111 100: one register.
        0b111_1100 if first & 0x0010 != 0 => Cost::single(2),
        0b111_1100 => {
            let by_register = first & 0x0080 == 0 && second & 0x0FC0 == 0;
            Cost::single(if by_register { 2 } else { 1 })
        }
        0b111_1101 => multiply(first, second),
        // Coprocessor 10, and of 11, whose registers are two each, loads and stores.
        0b111_0110 | 0b111_0111 if second & 0x0F00 == 0x0A00 => vfp(first, second),
        0b111_0110 if second & 0x0F00 == 0x0B00 => {
            Cost::of(1 + u32::from(if first & 0x0120 == 0x0100 { 2 } else { second & 0xFF }))
        }
        _ => Cost::of(1),
    }
}

/// Multiplications and divisions, and what else works on two registers.
fn multiply(first: u16, second: u16) -> Cost {
    let accumulates = second >> 12 != 0xF;
    match first & 0xFFF0 {
        // MLA and MLS, which are no SMLA.
        0xFB00 if accumulates => Cost::of(2),
        0xFB90 | 0xFBB0 if second & 0x00F0 == 0x00F0 => Cost::of(DIVIDE),
        _ => Cost::of(1),
    }
}

/// Single precision.
fn vfp(first: u16, second: u16) -> Cost {
    let register = |number: u16, low: u16| 1_u32 << (number << 1 | low);
    let d = register(second >> 12 & 0xF, first >> 6 & 1);
    let n = register(first & 0xF, second >> 7 & 1);
    let m = register(second & 0xF, second >> 5 & 1);
    if first & 0xFE00 == 0xEC00 {
        let first_register = u32::from((second >> 12 & 0xF) << 1 | first >> 6 & 1);
        let is_load = first & 0x0010 != 0;
        if first & 0xFFE0 == 0xEC40 {
            // Two registers at once: to the core they are read.
            let pair = m | m << 1;
            return Cost { reads: if is_load { pair } else { 0 }, ..Cost::of(2) };
        }
        let is_one = first & 0x0120 == 0x0100;
        let n_registers = u32::from(second & 0xFF);
        let block = |n: u32| ((1_u64 << n.min(32)) - 1) as u32;
        let reads = if is_load { 0 } else { block(if is_one { 1 } else { n_registers }) << first_register };
        return Cost { reads, ..if is_one { Cost::single(2) } else { Cost::of(1 + n_registers) } };
    }
    if second & 0x0010 != 0 {
        // One register from or to the core; VMRS and VMSR.
        let to_core = first & 0x00F0 == 0x0010;
        return Cost { reads: if to_core { n } else { 0 }, ..Cost::of(1) };
    }
    let arithmetic = |cycles, reads| Cost { cycles, is_single: false, late: d, reads };
    match (first >> 4 & 0b1011, second >> 6 & 1) {
        (0b0000 | 0b0001 | 0b1001 | 0b1010, _) => arithmetic(3, d | n | m),
        (0b0010 | 0b0011, _) => arithmetic(1, n | m),
        (0b1000, _) => arithmetic(14, n | m),
        // A constant.
        (0b1011, 0) => Cost::of(1),
        _ => match (first & 0xF, second >> 7 & 1) {
            (0b0001, 1) => arithmetic(14, m),
            // VCMP writes flags.
            (0b0100, _) => Cost { reads: d | m, ..Cost::of(1) },
            (0b0101, _) => Cost { reads: d, ..Cost::of(1) },
            // A copy is no arithmetic, and neither are VABS and VNEG, which change a bit.
            (0b0000 | 0b0001, _) => Cost { reads: m, ..Cost::of(1) },
            _ => arithmetic(1, m),
        },
    }
}
