//! A seeded walk through what the fuzz targets look at: sound bundles, damaged here and there.

use std::fs;
use std::path::Path;

use conformance::bundles::{ALL_CODERS, tiered};
use conformance::frame::bundle_of;
use conformance::fuzz;
use conformance::scenes::{TINY, TINY_DETAILED, cameras, random_scene};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Damaged bundles of each kind.
const N_STEPS: usize = 20_000;

/// The bundles in a folder that is given from here.
fn bundles_in(folder: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let paths = fs::read_dir(&folder).expect("a committed folder").map(|entry| entry.expect("a file of it").path());
    let mut paths: Vec<_> = paths.filter(|path| path.extension().is_some_and(|ending| ending == "psb")).collect();
    paths.sort();
    assert!(!paths.is_empty(), "no bundles in {}", folder.display());
    paths.iter().map(|path| fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))).collect()
}

/// Bundles of all coders, and those of the conformance pack.
fn seeds() -> Vec<Vec<u8>> {
    let plain = bundle_of(&random_scene(&TINY), &cameras()[0].1);
    ALL_CODERS
        .map(|coder| tiered(&TINY_DETAILED, coder, 2))
        .into_iter()
        .chain([plain])
        .chain(bundles_in("pack/bundles"))
        .collect()
}

/// Any setting to draw with; half of those with a camera of their own have a usual one.
fn setting(rng: &mut ChaCha8Rng) -> [u8; fuzz::SETTING_LEN] {
    let mut bytes = [0; fuzz::SETTING_LEN];
    bytes.fill_with(|| rng.random_range(0..=u8::MAX));
    if rng.random_range(0..2) == 0 {
        // Translation, focal lengths and principal point are the last.
        let ranges = [-2.0..2.0, -2.0..2.0, -0.5..4.0, 10.0..200.0, 10.0..200.0, -10.0..70.0, -10.0..70.0];
        let camera = ranges.map(|range| rng.random_range::<f32, _>(range).to_le_bytes());
        let (_, end) = bytes.split_last_chunk_mut::<28>().expect("longer than a camera");
        end.copy_from_slice(camera.as_flattened());
    }
    bytes
}

/// One of the ways in which a fuzzer changes bytes, a few times over.
fn damage(bytes: &mut Vec<u8>, other: &[u8], rng: &mut ChaCha8Rng) {
    for _ in 0..rng.random_range(1..4) {
        let at = rng.random_range(0..bytes.len().max(1));
        let end = (at + rng.random_range(1..32)).min(bytes.len());
        let Some(byte) = bytes.get_mut(at) else { return };
        match rng.random_range(0..8) {
            0 => *byte ^= 1 << rng.random_range(0..8),
            1 => *byte = rng.random_range(0..=u8::MAX),
            2 => *byte = [0, 1, 0x7F, 0x80, 0xFF][rng.random_range(0..5)],
            3 => bytes[at..end].fill_with(|| rng.random_range(0..=u8::MAX)),
            4 => bytes.truncate(at),
            5 => bytes.splice(at..at, other.iter().take(end - at).copied()).for_each(drop),
            6 => bytes.drain(at..end).for_each(drop),
            _ => bytes.splice(at..end, other.iter().skip(at).take(end - at).copied()).for_each(drop),
        }
    }
}

fn walk(seed: u64, body: impl Fn(&[u8], &mut ChaCha8Rng)) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let seeds = seeds();
    for step in 0..N_STEPS {
        let mut bytes = seeds[step % seeds.len()].clone();
        let other = &seeds[rng.random_range(0..seeds.len())];
        damage(&mut bytes, other, &mut rng);
        body(&bytes, &mut rng);
    }
}

/// The seeds that a fuzzer starts from: among the pack's words are escapes that spell a symbol out which has slots of its own.
#[test]
fn the_pack_and_what_was_found_keep_every_law() {
    for bytes in ["pack/bundles", "pack/refused", "../fuzz/finds"].into_iter().flat_map(bundles_in) {
        for law in [fuzz::parse, fuzz::draw, fuzz::symbols, fuzz::normal] {
            law(&bytes);
        }
    }
}

#[test]
fn any_bytes_parse_or_are_refused() {
    walk(1, |bytes, _| fuzz::parse(bytes));
}

#[test]
fn any_bytes_draw_or_are_refused() {
    walk(3, |bytes, rng| {
        let mut bytes = bytes.to_vec();
        if rng.random_range(0..4) > 0 {
            bytes.extend(setting(rng));
        }
        fuzz::draw(&bytes);
    });
}

#[test]
fn any_symbols_decode_or_are_refused() {
    walk(4, |bytes, _| fuzz::symbols(bytes));
}

#[test]
fn any_words_are_symbols_of_a_gaussian() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for _ in 0..N_STEPS {
        let mut bytes = vec![0; rng.random_range(0..200)];
        bytes.fill_with(|| rng.random_range(0..=u8::MAX));
        fuzz::normal(&bytes);
    }
}
