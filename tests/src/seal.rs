//! Checksums made right again after damage, so that a hostile bundle reaches the checks behind them.

use pocketsplat_core::bundle::{HEADER_LEN, crc32};

/// Rows of the section table, and the length of one.
const N_SECTIONS: usize = 4;
const SECTION_LEN: usize = 16;
/// The table ends where the header's checksum begins.
const TABLE_OFFSET: usize = HEADER_LEN - 4 - N_SECTIONS * SECTION_LEN;
/// Length of a record of the chunk directory.
const RECORD_LEN: usize = 40;

/// Recomputes every checksum that offsets and lengths still lead to: chunks, then sections, then the header.
///
/// Written from `FORMAT.md`, not with the writer, which makes only sound bundles.
pub fn reseal(bytes: &mut [u8]) {
    let sections: [_; N_SECTIONS] = std::array::from_fn(|row| {
        let at = TABLE_OFFSET + row * SECTION_LEN;
        let [offset, len] = [4, 8].map(|field| read_u32(bytes, at + field) as usize);
        (at + 12, offset, offset.saturating_add(len))
    });
    let [_, _, (_, directory, directory_end), (_, chunks, _)] = sections;
    let end = directory_end.min(bytes.len());
    for record in (directory..end.saturating_sub(RECORD_LEN - 1)).step_by(RECORD_LEN) {
        let start = chunks.saturating_add(read_u32(bytes, record) as usize);
        let end = start.saturating_add(read_u32(bytes, record + 4) as usize);
        write_crc(bytes, record + 8, start, end);
    }
    // The section of the chunks has no checksum of its own.
    for (crc_at, start, end) in sections.into_iter().take(N_SECTIONS - 1) {
        write_crc(bytes, crc_at, start, end);
    }
    write_crc(bytes, HEADER_LEN - 4, 0, HEADER_LEN - 4);
}

fn read_u32(bytes: &[u8], at: usize) -> u32 {
    let word = bytes.get(at..).and_then(|rest| rest.first_chunk());
    word.map_or(0, |word| u32::from_le_bytes(*word))
}

fn write_crc(bytes: &mut [u8], at: usize, start: usize, end: usize) {
    let Some(crc) = bytes.get(start..end).map(crc32) else { return };
    if let Some(slot) = bytes.get_mut(at..at + 4) {
        slot.copy_from_slice(&crc.to_le_bytes());
    }
}
