//! A seeded walk through what the fuzz targets look at: sound bundles, damaged here and there.

use conformance::bundles::{ALL_CODERS, tiered};
use conformance::frame::bundle_of;
use conformance::fuzz;
use conformance::scenes::{TINY, TINY_DETAILED, cameras, random_scene};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Damaged bundles of each kind.
const N_STEPS: usize = 20_000;

fn seeds() -> Vec<Vec<u8>> {
    let plain = bundle_of(&random_scene(&TINY), &cameras()[0].1);
    ALL_CODERS.map(|coder| tiered(&TINY_DETAILED, coder, 2)).into_iter().chain([plain]).collect()
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

fn walk(seed: u64, body: impl Fn(&[u8])) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let seeds = seeds();
    for step in 0..N_STEPS {
        let mut bytes = seeds[step % seeds.len()].clone();
        let other = &seeds[rng.random_range(0..seeds.len())];
        damage(&mut bytes, other, &mut rng);
        body(&bytes);
    }
}

#[test]
fn any_bytes_parse_or_are_refused() {
    walk(1, fuzz::parse);
    walk(2, |bytes| {
        let mut bytes = bytes.to_vec();
        conformance::seal::reseal(&mut bytes);
        fuzz::parse(&bytes);
    });
}

#[test]
fn any_bytes_draw_or_are_refused() {
    walk(3, fuzz::draw);
}

#[test]
fn any_symbols_decode_or_are_refused() {
    walk(4, fuzz::symbols);
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
