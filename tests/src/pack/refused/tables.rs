//! Section 6.

use super::{Good, List, read_u32, section};

pub(super) fn add(list: &mut List, good: &Good) {
    let file = good.tables.clone().file();
    let out = |field: &str, found: u32| format!("OutOfRange {{ field: {field}, found: {found},");
    let n_channels = good.tables.n_channels();
    list.file("no-tables", "There are no tables.", &out("NTables", 0)).in_section((&file, 4, 0), &[0, 0]);
    list.file("361-tables", "There are 361 tables.", &out("NTables", 361))
        .in_section((&file, 4, 0), &361_u16.to_le_bytes());
    let other = n_channels as u16 - 1;
    list.file("channels-of-tables", "The tables are of a channel less than C.", &out("NChannels", other.into()))
        .in_section((&file, 4, 2), &other.to_le_bytes());
    list.file("no-such-table", "Channel 1 has table 3 of 3.", "NoSuchTable { channel: 1, table: 3")
        .in_section((&file, 4, 6), &[3, 0]);
    let index = 4 + 2 * n_channels;
    let first = read_u32(&file, section(&file, 4).1.start + index);
    let second = read_u32(&file, section(&file, 4).1.start + index + 4);
    list.file("table-gap", "The second table begins 2 bytes too late.", &out("TableOffset", second + 2))
        .in_section((&file, 4, index + 4), &(second + 2).to_le_bytes());
    list.file("table-overlaps", "The first table begins inside the index.", &out("TableOffset", first - 4))
        .in_section((&file, 4, index), &(first - 4).to_le_bytes());
    let table = first as usize;
    let scale = "BadFloat { field: TableScale, index: 0";
    for (name, reason, at, value) in [
        ("table-step-0", "The step of a table is 0.", 4, 0.0_f32),
        ("table-step-negative", "The step of a table is negative.", 4, -1.0),
        ("table-step-nan", "The step of a table is not a number.", 4, f32::NAN),
        ("table-step-infinite", "The step of a table is infinite.", 4, f32::INFINITY),
        ("table-step-too-large", "32768 steps of a table are above 10¹⁸.", 4, 1e14),
        ("table-origin-nan", "The origin of a table is not a number.", 0, f32::NAN),
        ("table-origin-too-large", "The origin of a table is −10¹⁸.", 0, -1e18),
    ] {
        list.file(name, reason, scale).in_section((&file, 4, table + at), &f32::to_le_bytes(value));
    }
    let reason = "The last symbol of a table is 32768.";
    let n_symbols = u16::from_le_bytes(*file[section(&file, 4).1.start + table + 10..].first_chunk().expect("a table"));
    let min_symbol = (32769 - i32::from(n_symbols)) as i16;
    list.file("table-symbols", reason, "OutOfRange { field: TableSymbols")
        .in_section((&file, 4, table + 8), &min_symbol.to_le_bytes());
    let bound = |entry: u16| format!("BadBound {{ section: Tables, table: 0, entry: {entry}");
    let last = n_symbols + 1;
    for (name, reason, entry, value, blamed) in [
        ("bounds-begin", "The first bound of a table is 1.", 0, 1_u16, 0),
        ("bounds-fall", "A bound is below the one before it.", 2, 0, 2),
        ("bounds-reach-4096-early", "The escape has no slots.", last - 1, 4096, last - 1),
        ("bounds-beyond-4096", "A bound is 4097.", last - 1, 4097, last - 1),
        ("bounds-end", "The last bound is 4095.", last, 4095, last),
    ] {
        list.file(name, reason, &bound(blamed))
            .in_section((&file, 4, table + 12 + 2 * usize::from(entry)), &value.to_le_bytes());
    }
    let long = good.tables.clone().with_section(4, |bytes| bytes.extend([0, 0]));
    list.file("tables-long", "Bytes are left behind the last table.", "WrongLength { section: Tables").of(long);
    let short = good.tables.clone().with_section(4, |bytes| bytes.truncate(bytes.len() - 2));
    list.file("tables-short", "The last table lacks its last bound.", "Truncated { section: Tables").of(short);
}
