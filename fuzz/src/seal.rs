//! Checksums made right again after damage, so that a hostile bundle reaches the checks behind them.

use pocketsplat_format::bundle::{
    CHUNK_RECORD_LEN, HEADER_FIXED_LEN, INK_FRAME_LEN, SECTION_LEN, TIER_RECORD_LEN, crc32,
};

/// Where the header has the number of sections, of tiers, and its own length.
const N_SECTIONS: usize = 39;
const N_TIERS: usize = 47;
const HEADER_LEN: usize = 10;
/// Kinds of the two last sections.
const DIRECTORY: u8 = 7;
const CHUNKS: u8 = 8;

/// Recomputes every checksum that offsets and lengths still lead to: chunks, then sections, then the header.
///
/// Written from `FORMAT.md`, not with the writer, which makes only sound bundles.
pub fn reseal(bytes: &mut [u8]) {
    let byte = |at: usize| bytes.get(at).copied().unwrap_or(0);
    let (n_sections, n_tiers) = (usize::from(byte(N_SECTIONS)), usize::from(byte(N_TIERS)));
    let header_len = usize::from(u16::from_le_bytes([byte(HEADER_LEN), byte(HEADER_LEN + 1)]));
    let sections: Vec<(u8, usize, usize, usize)> = (0..n_sections)
        .map(|row| {
            let at = HEADER_FIXED_LEN + row * SECTION_LEN;
            let [offset, len] = [4, 8].map(|field| read_u32(bytes, at + field) as usize);
            (byte(at), at + 12, offset, offset.saturating_add(len))
        })
        .collect();
    let place = |kind: u8| sections.iter().find(|section| section.0 == kind);
    if let (Some(&(_, _, directory, end)), Some(&(_, _, mut start, _))) = (place(DIRECTORY), place(CHUNKS)) {
        let first = directory.saturating_add(n_tiers * TIER_RECORD_LEN + INK_FRAME_LEN);
        let end = end.min(bytes.len());
        for record in (first..end.saturating_sub(CHUNK_RECORD_LEN - 1)).step_by(CHUNK_RECORD_LEN) {
            let end = start.saturating_add(read_u32(bytes, record) as usize);
            write_crc(bytes, record + 4, start, end);
            // The next chunk begins at a multiple of four.
            start = end.saturating_add(3) / 4 * 4;
        }
    }
    for (kind, crc_at, start, end) in sections {
        // The section of the chunks has no checksum of its own.
        if kind != CHUNKS {
            write_crc(bytes, crc_at, start, end);
        }
    }
    if let Some(crc_at) = header_len.checked_sub(4) {
        write_crc(bytes, crc_at, 0, crc_at);
    }
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
