//! Levels: the documents' table is the code's, writers declare the least that holds, and a level that does not hold is found.

use std::path::Path;

use conformance::bundles::{ALL_CODERS, Coder, measured};
use conformance::scenes::{CASES, Case, cameras};
use conformance::seal::reseal;
use pocketsplat_codec::verify::{declared_levels, keeps_level};
use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::{HEADER_FIXED_LEN, MANIFEST_RECORD_LEN, SECTION_LEN, TierMeasures};
use pocketsplat_instructions::level::{Bound, LEVELS, Level, Need, Profile};

/// Kind of the manifest's section, and where the header has the training size.
const MANIFEST: u8 = 6;
const TRAINING_PX: usize = 40;

/// More anchors than level 3 has.
const LARGE: Case = Case { n_anchors: 19_000, ..CASES[1] };

/// A measured bundle of three tiers.
fn bundle(case: &Case, coder: Coder) -> Vec<u8> {
    measured(case, coder, &[cameras().swap_remove(0).1])
}

/// The file with the record of tier number `tier` changed.
fn changed(bytes: &[u8], tier: usize, change: impl FnOnce(&mut TierMeasures)) -> Vec<u8> {
    let bundle = Bundle::parse(bytes).expect("sound before");
    let mut measures = bundle.measures(tier as u8).expect("a tier");
    change(&mut measures);
    let rows = (HEADER_FIXED_LEN..).step_by(SECTION_LEN);
    let row = rows.into_iter().find(|row| bytes[*row] == MANIFEST).expect("there is a manifest");
    let offset = u32::from_le_bytes(bytes[row + 4..row + 8].try_into().expect("four bytes")) as usize;
    let mut bytes = bytes.to_vec();
    bytes[offset + tier * MANIFEST_RECORD_LEN..][..MANIFEST_RECORD_LEN].copy_from_slice(&measures.emit());
    reseal(&mut bytes);
    bytes
}

#[test]
fn the_table_of_the_document_is_that_of_the_code() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../decoder-format/src/bundle/MANIFEST.md");
    let text = std::fs::read_to_string(path).expect("the document");
    let mut rows =
        text.lines().skip_while(|line| !line.starts_with("| level | frame | scratch, bytes | flash, bytes |"));
    rows.next().expect("the table");
    let rows: Vec<Vec<u64>> = rows
        .skip(1)
        .take_while(|line| line.starts_with('|'))
        .map(|line| {
            let cells = line.trim_matches('|').split(['|', '×']).map(|cell| cell.trim().replace(',', ""));
            cells.map(|cell| cell.parse().expect(line)).collect()
        })
        .collect();
    let in_code = LEVELS.map(|level| {
        let [width, height] = level.frame_px.map(u64::from);
        let [_, others @ ..] = level.bounds;
        [&[level.number.into(), width, height][..], &others].concat()
    });
    assert_eq!(rows, in_code);
}

#[test]
fn every_tier_declares_the_least_level_that_it_keeps() {
    // By their frame of level 3; the last has too many anchors for it.
    let bundles = ALL_CODERS.map(|coder| bundle(&CASES[0], coder)).into_iter().chain([bundle(&LARGE, Coder::Static)]);
    let mut declared = Vec::new();
    for bytes in bundles {
        let bundle = Bundle::parse(&bytes).expect("sound");
        for tier in 0..bundle.n_tiers() {
            let number = bundle.measures(tier).expect("a tier").level;
            assert_eq!(keeps_level(&bundle, tier, number), Ok(()));
            if let Some(less) = number.checked_sub(1).and_then(Level::numbered) {
                let needs = less.needs(&bundle, tier).expect("measured");
                assert!(!needs.iter().all(Need::is_kept), "level {} would do: {needs:?}", less.number);
            }
            declared.push(number);
        }
        assert!(declared_levels(&bundle).all(|kept| kept.is_ok()));
        let profile = if bundle.context().is_some() { Profile::Full } else { Profile::Device };
        assert_eq!(Profile::of(&bundle.header().features), profile);
    }
    assert!(declared.contains(&3) && declared.last() == Some(&4), "{declared:?}");
}

#[test]
fn a_level_that_is_too_low_is_found_by_the_bound_that_it_breaks() {
    let bytes = bundle(&CASES[0], Coder::Static);
    let level_of = |bytes: &[u8]| Level::least(&Bundle::parse(bytes).expect("sound"), 2);
    assert_eq!(level_of(&bytes), 3);
    type Change = fn(&mut TierMeasures);
    let changes: [(&str, Bound, Change); 3] = [
        ("splats", Bound::Splats, |measures| measures.max_splats = 8_001),
        ("multiply-adds", Bound::HeadMacs, |measures| measures.max_head_kilo_macs = 9_766),
        ("pixels", Bound::Instructions, |measures| measures.max_kilo_pixels = 2_900),
    ];
    for (name, bound, change) in changes {
        // It says still that it is of level 3.
        let bytes = changed(&bytes, 2, change);
        let bundle = Bundle::parse(&bytes).expect("a decoder does not care");
        assert_eq!((level_of(&bytes), bundle.measures(2).map(|measures| measures.level)), (4, Some(3)), "{name}");
        let needs = LEVELS[2].needs(&bundle, 2).expect("measured");
        let broken: Vec<Bound> = needs.iter().filter(|need| !need.is_kept()).map(|need| need.bound).collect();
        assert_eq!(broken, [bound], "{name}");
        let said: Vec<String> = declared_levels(&bundle).filter_map(Result::err).collect();
        assert!(said.len() == 1 && said[0].contains(bound.name()), "{name}: {said:?}");
    }
    // A larger frame.
    let mut wide = bytes.clone();
    wide[TRAINING_PX..TRAINING_PX + 4].copy_from_slice(&[64, 1, 240, 0]);
    reseal(&mut wide);
    assert_eq!(Bundle::parse(&wide).expect("sound").header().training_px, [320, 240]);
    assert_eq!(level_of(&wide), 4);
    // More memory, flash and anchors than level 3 has.
    let large = changed(&bundle(&LARGE, Coder::Static), 2, |measures| {
        measures.level = 3;
        measures.max_strip_splats = [33_000; 4];
    });
    let said = declared_levels(&Bundle::parse(&large).expect("sound")).find_map(Result::err).expect("too low");
    for bound in [Bound::Scratch, Bound::Flash, Bound::Anchors] {
        assert!(said.contains(bound.name()), "{said}");
    }
}

#[test]
fn what_is_not_measured_has_no_level() {
    let bytes = changed(&bundle(&CASES[0], Coder::Static), 1, |measures| measures.n_cameras = 0);
    let bundle = Bundle::parse(&bytes).expect("sound");
    assert_eq!([0, 1, 2].map(|tier| Level::least(&bundle, tier)), [3, 0, 3]);
    assert_eq!(LEVELS[0].needs(&bundle, 3), None, "no such tier");
    assert_eq!(
        declared_levels(&bundle).filter(Result::is_err).count(),
        1,
        "tier 1 declares level 3 and does not keep it"
    );
}
