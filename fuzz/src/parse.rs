//! Any bytes parse or are refused.

use pocketsplat_format::bundle::Section;
use pocketsplat_format::{Bundle, SectionKind};

use super::blame::check_blame;
use super::seal::reseal;

/// Everything that can be asked of a bundle without decoding has an answer or an error, as the bytes are and with right checksums.
pub fn parse(bytes: &[u8]) {
    parse_as_is(bytes);
    let mut bytes = bytes.to_vec();
    reseal(&mut bytes);
    parse_as_is(&bytes);
}

fn parse_as_is(bytes: &[u8]) {
    let bundle = match Bundle::parse(bytes) {
        Ok(bundle) => bundle,
        Err(error) => return check_blame(&error),
    };
    let header = bundle.header();
    let in_file = |section: Section| section.offset + section.len <= header.file_len;
    // A file that was cut has not all chunks.
    assert!(
        bundle.sections().all(|section| section.kind == SectionKind::Chunks || in_file(section)),
        "sections in the file"
    );
    assert!(bundle.sections().all(|section| section.offset.is_multiple_of(4)), "sections are aligned");
    assert!(bundle.n_tiers() >= 1 && bundle.n_tiers() <= header.n_tiers, "{} tiers", bundle.n_tiers());
    let chunks: Vec<_> = bundle.chunks().collect();
    assert_eq!(chunks.len(), bundle.n_chunks() as usize, "the directory holds what the tiers say");
    assert_eq!(chunks.iter().map(|chunk| u32::from(chunk.n_anchors())).sum::<u32>(), bundle.n_anchors(), "anchors");
    // To find one takes as long as all before it.
    for (index, chunk) in (0..).zip(&chunks).step_by(chunks.len() / 8 + 1) {
        assert_eq!(bundle.chunk(index).map(|found| found.offset()), Ok(chunk.offset()), "chunk {index}");
    }
    for (index, chunk) in chunks.iter().enumerate() {
        let (low, high) = chunk.ink_box();
        assert!(low.iter().zip(high).all(|(low, high)| *low <= high), "ink box of chunk {index}");
    }
    for tier in 0..header.n_tiers {
        assert!(bundle.tier(tier).is_some() && bundle.measures(tier).is_some(), "tier {tier}");
    }
    let mut weights = bundle.heads().weights();
    assert!((0..10).all(|_| weights.next_layer().all(f32::is_finite)), "weights are finite");
}
