//! Symbols of tables and of tries: the state of the stream stays in a register, and a table's bounds are read without a comparison.

use core::arch::asm;
use core::mem::offset_of;

use crate::portable::symbols::SymbolTable;
pub use crate::portable::symbols::{
    ChannelTables, Entries, FREQUENCY_TOTAL, LEVELS_AT_ONCE, LevelFrequencies, NODE_CONTEXTS, PRECISION_BITS,
    STATE_MIN, Stream, TABLE_WORDS,
};

// The assembly multiplies by it with shifts.
const _: () = assert!(size_of::<SymbolTable>() == 9 * 16);

/// As [`read_values`](crate::portable::symbols::read_values).
///
/// # Budget
/// 33 instructions a value, 3 for each entry walked past, and 6 for a word of the stream.
// Not inlined: it takes all registers.
#[inline(never)]
pub fn read_values(tables: &ChannelTables<'_, '_>, first: usize, values: &mut [f32], stream: &mut Stream<'_>) -> usize {
    let numbers = tables.numbers.get(first..).unwrap_or_default();
    let n = numbers.len().min(values.len());
    if n == 0 {
        return 0;
    }
    let Stream { mut state, words } = *stream;
    let range = words.as_ptr_range();
    let (mut word, start) = (range.start, values.as_mut_ptr());
    let mut value = start;
    // SAFETY: reads `n` numbers, which there are, and the tables that they name, which there are, as `ChannelTables::new` made
    // sure; of a table short cuts by 6 bits of the state, and in the section bounds from one of them on up to the first that is larger
    // than a number of 12 bits: the last is, and no short cut lies beyond the pair of the last two. Reads words up to the end of `words`.
    // Writes at most `n` values. Loads may lie at any address. Registers are given as clobbered.
    unsafe {
        // A pair holds where an entry begins and, above, where it ends. A table has nine times 16 bytes.
        asm!(
            "vmov s3, {end}",
            "2:",
            "ldrh {table}, [{number}], #2",
            "ubfx {q}, {state}, #0, #12",
            "add {table}, {table}, {table}, lsl #3",
            "add {table}, {tables}, {table}, lsl #4",
            "lsr {pair}, {q}, #6",
            "ldr {base}, [{table}, #{bounds}]",
            "add {pair}, {table}, {pair}, lsl #1",
            "ldrh {pair}, [{pair}, #-{origin}]",
            "add {base}, {section}, {base}",
            "add {at}, {base}, {pair}, lsl #1",
            "ldr {pair}, [{at}]",
            "cmp {q}, {pair}, lsr #16",
            "bhs 5f",
            "3:",
            "cmp {pair}, #0x10000000",
            "bhs 9f",
            "uxth {end}, {pair}",
            "sub {at}, {at}, {base}",
            "sub {q}, {q}, {end}",
            "rsb {end}, {end}, {pair}, lsr #16",
            "lsr {state}, {state}, #12",
            "mla {state}, {state}, {end}, {q}",
            "ldr {q}, [{table}, #-4]",
            "vldmia {table}, {{s1-s2}}",
            "add {q}, {q}, {at}, lsr #1",
            "vmov s0, {q}",
            "lsrs {q}, {state}, #16",
            "vcvt.f32.s32 s0, s0",
            "beq 6f",
            "4:",
            "vmul.f32 s0, s0, s2",
            "subs {n}, {n}, #1",
            "vadd.f32 s1, s1, s0",
            "vstmia {value}!, {{s1}}",
            "bne 2b",
            "b 9f",
            "5:",
            "ldr {pair}, [{at}, #2]!",
            "cmp {q}, {pair}, lsr #16",
            "bhs 5b",
            "b 3b",
            "6:",
            "vmov {q}, s3",
            "cmp {word}, {q}",
            "beq 4b",
            "ldrh {q}, [{word}], #2",
            "orr {state}, {q}, {state}, lsl #16",
            "b 4b",
            "9:",
            state = inout(reg) state,
            word = inout(reg) word,
            number = inout(reg) numbers.as_ptr() => _,
            n = inout(reg) n => _,
            value = inout(reg) value,
            tables = in(reg) tables.tables.as_ptr().wrapping_byte_add(offset_of!(SymbolTable, origin)),
            section = in(reg) tables.section.as_ptr(),
            base = out(reg) _,
            end = inout(reg) range.end => _,
            table = out(reg) _,
            q = out(reg) _,
            pair = out(reg) _,
            at = out(reg) _,
            origin = const offset_of!(SymbolTable, origin),
            bounds = const offset_of!(SymbolTable, bounds) - offset_of!(SymbolTable, origin),
            out("s0") _, out("s1") _, out("s2") _, out("s3") _,
            options(nostack)
        );
    }
    let n_words = (word.addr().wrapping_sub(range.start.addr())) / 2;
    *stream = Stream { state, words: words.get(n_words..).unwrap_or_default() };
    value.addr().wrapping_sub(start.addr()) / 4
}

/// As [`descend`](crate::portable::symbols::descend).
// Not inlined: it takes all registers.
#[inline(never)]
#[must_use]
pub fn descend(levels: &[LevelFrequencies], both: u32, stream: &mut Stream<'_>) -> [u32; 2] {
    let levels = levels.get(..levels.len().min(LEVELS_AT_ONCE)).unwrap_or_default();
    if levels.is_empty() {
        return [0, both];
    }
    let Stream { mut state, words } = *stream;
    let range = words.as_ptr_range();
    let mut word = range.start;
    let (mut code, mut both) = (0_u32, both);
    // SAFETY: reads the pairs of numbers of all `levels`, of three each: a context is 0 to 2. Reads words up to the end of `words`.
    // Loads may lie at any address. A register is given as clobbered.
    unsafe {
        asm!(
            "vmov s0, {end}",
            "mov {end}, #14",
            "2:",
            "and {t}, {end}, {both}, lsl #1",
            "ubfx {q}, {state}, #0, #12",
            "lsr {t}, {contexts}, {t}",
            "lsr {state}, {state}, #12",
            "and {t}, {t}, #3",
            "ldr {ends}, [{level}, {t}, lsl #2]",
            "lsl {code}, {code}, #1",
            "lsl {both}, {both}, #1",
            "uxth {t}, {ends}",
            "cmp {q}, {t}",
            "bhs 5f",
            "add {both}, {both}, #1",
            "3:",
            "mla {state}, {state}, {t}, {q}",
            "add {level}, {level}, #12",
            "lsrs {t}, {state}, #16",
            "beq 7f",
            "4:",
            "cmp {level}, {last}",
            "bne 2b",
            "b 9f",
            "5:",
            "cmp {q}, {ends}, lsr #16",
            "bhs 6f",
            "sub {q}, {q}, {t}",
            "rsb {t}, {t}, {ends}, lsr #16",
            "b 3b",
            "6:",
            "lsr {t}, {ends}, #16",
            "sub {q}, {q}, {t}",
            "rsb {t}, {t}, #4096",
            "add {code}, {code}, #1",
            "b 3b",
            "7:",
            "vmov {t}, s0",
            "cmp {word}, {t}",
            "beq 4b",
            "ldrh {t}, [{word}], #2",
            "orr {state}, {t}, {state}, lsl #16",
            "b 4b",
            "9:",
            state = inout(reg) state,
            word = inout(reg) word,
            level = inout(reg) levels.as_ptr() => _,
            last = in(reg) levels.as_ptr_range().end,
            code = inout(reg) code,
            both = inout(reg) both,
            contexts = in(reg) NODE_CONTEXTS,
            end = inout(reg) range.end => _,
            t = out(reg) _,
            q = out(reg) _,
            ends = out(reg) _,
            out("s0") _,
            options(nostack, readonly)
        );
    }
    let n_words = (word.addr().wrapping_sub(range.start.addr())) / 2;
    *stream = Stream { state, words: words.get(n_words..).unwrap_or_default() };
    [code, both]
}
