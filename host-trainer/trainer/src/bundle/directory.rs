//! The table of contents: where each tier ends, and each chunk's length, checksum and ink box.

use pocketsplat_core::bundle::crc32;

use super::ink::{InkBox, InkFrame};
use super::order::Placement;

/// The section's bytes; chunks and boxes are those of the placement, in its order.
pub(super) fn section(placement: &Placement, chunks: &[Vec<u8>], boxes: &[InkBox]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for &n_chunks in &placement.tier_chunks {
        let n_anchors: usize = placement.chunks[..n_chunks].iter().map(ExactSizeIterator::len).sum();
        let end: usize = chunks[..n_chunks].iter().map(Vec::len).sum();
        bytes.extend([n_chunks, n_anchors, end].iter().flat_map(|&x| (x as u32).to_le_bytes()));
    }
    let frame = InkFrame::around(boxes);
    bytes.extend(frame.min.iter().chain(&frame.step).flat_map(|x| x.to_le_bytes()));
    for ((anchors, chunk), ink) in placement.chunks.iter().zip(chunks).zip(boxes) {
        bytes.extend([chunk.len() as u32, crc32(chunk)].iter().flat_map(|x| x.to_le_bytes()));
        let corners = frame.quantise(ink);
        let counts = [anchors.len() as u16, 0];
        bytes.extend(counts.iter().chain(corners.as_flattened()).flat_map(|x| x.to_le_bytes()));
    }
    bytes
}
