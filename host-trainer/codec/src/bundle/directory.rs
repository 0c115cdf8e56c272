//! The chunks one after the other, and their table of contents: where each tier ends, and each chunk's length, checksum and ink box.

use pocketsplat_format::bundle::{ALIGNMENT, ChunkRecord, Tier, crc32};

use super::ink::{InkBox, frame_around, quantised};
use super::order::Placement;

/// The section's bytes; chunks and boxes are those of the placement, in its order.
pub(super) fn section(placement: &Placement, chunks: &[Vec<u8>], boxes: &[InkBox]) -> Vec<u8> {
    let tiers = placement.tier_chunks.iter().flat_map(|&n_chunks| {
        let n_anchors: usize = placement.chunks[..n_chunks].iter().map(ExactSizeIterator::len).sum();
        let end: usize = chunks[..n_chunks].iter().map(|chunk| padded_len(chunk)).sum();
        Tier { n_chunks: n_chunks as u32, n_anchors: n_anchors as u32, end: end as u32 }.emit()
    });
    let frame = frame_around(boxes);
    let records = placement.chunks.iter().zip(chunks).zip(boxes).flat_map(|((anchors, chunk), ink)| {
        let [low, high] = quantised(ink, &frame);
        let (len, n_anchors) = (chunk.len() as u32, anchors.len() as u16);
        ChunkRecord { len, crc: crc32(chunk), n_anchors, low, high }.emit()
    });
    tiers.chain(frame.emit()).chain(records).collect()
}

/// The bytes of the chunks section: each chunk at a multiple of [`ALIGNMENT`].
pub(super) fn joined(chunks: &[Vec<u8>]) -> Vec<u8> {
    let mut joined = Vec::with_capacity(chunks.iter().map(|chunk| padded_len(chunk)).sum());
    for chunk in chunks {
        joined.extend(chunk);
        joined.resize(joined.len().next_multiple_of(ALIGNMENT as usize), 0);
    }
    joined
}

fn padded_len(chunk: &[u8]) -> usize {
    chunk.len().next_multiple_of(ALIGNMENT as usize)
}
