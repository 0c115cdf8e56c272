//! Section 3.

use super::{Good, List, section};

/// The bytes of a half.
const HALF_INFINITE: [u8; 2] = 0x7C00_u16.to_le_bytes();

const HALF_NAN: [u8; 2] = 0xFE01_u16.to_le_bytes();

pub(super) fn add(list: &mut List, good: &Good) {
    let file = good.tables.clone().file();
    list.file("weight-infinite", "A weight of the opacity head is infinite.", "BadFloat { field: HeadWeight, index: 1")
        .in_section((&file, 1, 2), &HALF_INFINITE);
    let len = section(&file, 1).1.len();
    list.file("bias-nan", "The last bias of the colour head is not a number.", "BadFloat { field: HeadWeight")
        .in_section((&file, 1, len - 2), &HALF_NAN);
    for (name, reason, n, expected) in [
        ("heads-short", "The heads lack a number.", len - 2, "Truncated { section: Heads"),
        ("heads-long", "The heads have a number too many.", len + 2, "WrongLength { section: Heads"),
    ] {
        let resized = good.tables.clone().with_section(1, |bytes| bytes.resize(n, 0));
        list.file(name, reason, expected).of(resized);
    }
    let coded = good.coded_heads.clone().file();
    let step = "BadFloat { field: HeadStep, index: 0";
    for (name, reason, at, value) in [
        ("head-origin", "The table of W1 has an origin.", 0, 0.5_f32),
        ("head-step-0.75", "The step of W1 is not a power of two.", 4, 0.75),
        ("head-step-2", "The step of W1 is above 1.", 4, 2.0),
        ("head-step-2^-25", "The step of W1 is below 2⁻²⁴.", 4, 1.0 / 33_554_432.0),
    ] {
        list.file(name, reason, step).in_section((&coded, 1, at), &f32::to_le_bytes(value));
    }
    list.file("head-step-negative", "The step of W1 is negative.", "BadFloat")
        .in_section((&coded, 1, 4), &(-0.5_f32).to_le_bytes());
    let reason = "The first bound of the table of W1 is not 0.";
    list.file("head-bounds", reason, "BadBound { section: Heads, table: 0, entry: 0")
        .in_section((&coded, 1, 12), &[1, 0]);
    let edited = |edit: fn(&mut Vec<u8>)| good.coded_heads.clone().with_section(1, edit);
    for (name, reason, edit) in [
        ("head-stream-odd", "The heads end in half a word.", (|bytes| bytes.push(0)) as fn(&mut Vec<u8>)),
        ("head-stream-short", "The stream of the heads lacks its last word.", |bytes| bytes.truncate(bytes.len() - 2)),
        ("head-stream-long", "Words are left behind the last weight.", |bytes| bytes.extend([1, 0])),
    ] {
        list.file(name, reason, "HeadStream").of(edited(edit));
    }
}
