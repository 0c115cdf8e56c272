//! Where sections, chunks and the file end: what lies between them is 0, and a cut file knows its length.

use std::vec::Vec;

use super::builder::{bundle, tiers, variants};
use super::{expected, symbols};
use crate::bundle::{Bundle, crc32, cut_after};
use crate::error::{DecodeError, Field, SectionKind};

fn u32_at(bytes: &[u8], at: usize) -> usize {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize
}

/// Makes the checksums of the sections and of the header right.
fn reseal(bytes: &mut [u8]) {
    let header_len = usize::from(u16::from_le_bytes([bytes[10], bytes[11]]));
    for row in (160..header_len - 4).step_by(16).filter(|&row| bytes[row] != 8).collect::<Vec<_>>() {
        let (offset, len) = (u32_at(bytes, row + 4), u32_at(bytes, row + 8));
        let crc = crc32(&bytes[offset..offset + len]);
        bytes[row + 12..row + 16].copy_from_slice(&crc.to_le_bytes());
    }
    let crc = crc32(&bytes[..header_len - 4]);
    bytes[header_len - 4..header_len].copy_from_slice(&crc.to_le_bytes());
}

fn chunks_at(bytes: &[u8]) -> usize {
    let bundle = Bundle::parse(bytes).expect("sound");
    bundle.sections().find(|section| section.kind == SectionKind::Chunks).expect("chunks").offset as usize
}

#[test]
fn what_lies_between_sections_is_0() {
    let mut n_padding = 0;
    for variant in variants() {
        let sound = bundle(variant);
        let sections: Vec<_> = Bundle::parse(&sound).expect("sound").sections().collect();
        for pair in sections.windows(2) {
            assert_eq!(pair[1].offset % 4, 0, "{variant:?}: {:?}", pair[1]);
            for at in pair[0].offset + pair[0].len..pair[1].offset {
                n_padding += 1;
                let mut bytes = sound.clone();
                bytes[at as usize] = 5;
                let error = DecodeError::OutOfRange { field: Field::Padding, found: 5, limit: 0 };
                assert_eq!(Bundle::parse(&bytes).err(), Some(error), "{variant:?}: byte {at}");
            }
        }
    }
    assert!(n_padding > 100, "{n_padding} bytes between sections");
}

#[test]
fn what_lies_between_chunks_is_0() {
    let mut n_padding = 0;
    for variant in variants() {
        let sound = bundle(variant);
        let first = chunks_at(&sound);
        let whole = Bundle::parse(&sound).expect("sound");
        for chunk in whole.chunks() {
            assert_eq!(chunk.offset() % 4, 0, "{variant:?}: chunk {}", chunk.index());
            let end = first + chunk.offset() as usize + chunk.n_bytes();
            for at in end..end.next_multiple_of(4) {
                n_padding += 1;
                let mut bytes = sound.clone();
                bytes[at] = 1;
                let error = DecodeError::OutOfRange { field: Field::Padding, found: 1, limit: 0 };
                assert_eq!(Bundle::parse(&bytes).err(), Some(error), "{variant:?}: byte {at}");
                // Of a chunk that the file has not any longer nothing is asked.
                let tier =
                    (0..3).map(|tier| whole.tier(tier).expect("a tier").end as usize).find(|&end| first + end < at);
                if let Some(end) = tier {
                    assert!(Bundle::parse(&bytes[..first + end]).is_ok(), "{variant:?}: cut before byte {at}");
                }
            }
        }
    }
    assert!(n_padding > 100, "{n_padding} bytes between chunks");
}

#[test]
fn a_section_that_follows_without_padding_is_misplaced() {
    for variant in variants() {
        let mut bytes = bundle(variant);
        // The second row of the table.
        let offset = u32_at(&bytes, 180);
        bytes[180..184].copy_from_slice(&(offset as u32 + 2).to_le_bytes());
        reseal(&mut bytes);
        let [expected, found] = [offset as u32, offset as u32 + 2];
        let error = DecodeError::Misplaced { section: SectionKind::Lattice, expected, found };
        assert_eq!(Bundle::parse(&bytes).err(), Some(error), "{variant:?}");
    }
}

#[test]
fn a_cut_file_is_recognised_in_a_longer_partition() {
    for variant in variants() {
        let whole = bundle(variant);
        for n_tiers in 1..=3_u8 {
            let mut bytes = whole.clone();
            let len = cut_after(&mut bytes, n_tiers).expect("a tier");
            assert_eq!(bytes[len..], whole[len..], "{variant:?}: what is behind it stays");
            let erased = [&bytes[..len], &[0xFF; 5000]].concat();
            let garbage = [&bytes[..len], &whole[..]].concat();
            // What was there before: the rest of the whole file.
            for partition in [&bytes[..len], &bytes, &erased, &garbage] {
                let bundle = Bundle::parse(partition).expect("sound");
                assert_eq!((bundle.n_tiers(), bundle.header().n_tiers), (n_tiers, 3), "{variant:?}");
                assert_eq!(bundle.header().file_len as usize, len, "{variant:?}");
                assert_eq!(symbols(&bundle), expected(&tiers(variant)[..n_tiers.into()].concat()), "{variant:?}");
            }
            // It may be cut once more, and by nothing but its end.
            let end = Bundle::parse(&whole).expect("sound").tier(0).expect("a tier").end as usize;
            let first = Bundle::parse(&bytes[..chunks_at(&whole) + end]).expect("sound").n_tiers();
            assert_eq!((first, cut_after(&mut bytes, 1)), (1, Ok(chunks_at(&whole) + end)), "{variant:?}");
        }
        for n_tiers in [0, 4] {
            let error = cut_after(&mut whole.clone(), n_tiers).err();
            assert!(matches!(error, Some(DecodeError::OutOfRange { field: Field::TiersToKeep, .. })), "{error:?}");
        }
    }
}

#[test]
fn a_file_length_that_is_no_tiers_end_is_refused() {
    for variant in variants() {
        let sound = bundle(variant);
        let (first, whole) = (chunks_at(&sound), Bundle::parse(&sound).expect("sound"));
        let ends: Vec<usize> = (0..3).map(|tier| first + whole.tier(tier).expect("a tier").end as usize).collect();
        for file_len in first.saturating_sub(9)..sound.len() + 9 {
            let mut bytes = [&sound[..], &[0; 100]].concat();
            bytes[12..16].copy_from_slice(&(file_len as u32).to_le_bytes());
            reseal(&mut bytes);
            let error = Bundle::parse(&bytes).err();
            if ends.contains(&file_len) {
                assert_eq!(error, None, "{variant:?}: {file_len}");
                continue;
            }
            let named = match error {
                Some(DecodeError::Truncated { section, .. }) => section == SectionKind::Chunks || file_len < first,
                Some(DecodeError::WrongLength { section, .. }) => {
                    section == SectionKind::Chunks && file_len > sound.len()
                }
                _ => false,
            };
            assert!(named, "{variant:?}: {file_len}: {error:?}");
        }
    }
}

#[test]
fn a_level_beyond_the_last_and_its_reserved_bytes_are_refused() {
    let sound = bundle(variants().next().expect("some"));
    let manifest = Bundle::parse(&sound).expect("sound");
    let manifest = manifest.sections().find(|section| section.kind == SectionKind::Manifest).expect("a manifest");
    for (at, value, found) in [(60, 6, 6), (60, 255, 255), (61, 1, 256), (63, 0x80, 0x8000_0000_u32)] {
        for tier in 0..3 {
            let mut bytes = sound.clone();
            bytes[manifest.offset as usize + 64 * tier + 60] = 0;
            bytes[manifest.offset as usize + 64 * tier + at] = value;
            reseal(&mut bytes);
            let expected = DecodeError::OutOfRange { field: Field::TierLevel, found, limit: 5 };
            assert_eq!(Bundle::parse(&bytes).err(), Some(expected), "tier {tier}, byte {at}");
        }
    }
}
