//! Symbols and values do not depend on which thread decodes a chunk, or on the chunks decoded before.

use conformance::bundles::{CODERS, tiered};
use conformance::digest::digests;
use conformance::scenes::CASES;
use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::AnchorSite;
use rayon::prelude::*;

/// Everything that a chunk decodes to, from memory of its own.
fn decode(bundle: &Bundle<'_>, index: u32) -> (Vec<AnchorSite>, Vec<i16>, Vec<u32>) {
    let mut scratch = vec![u32::MAX; bundle.anchor_scratch_words()];
    let mut models = bundle.anchor_models(&mut scratch).expect("as many words as asked for");
    let chunk = bundle.chunk(index).expect("a chunk");
    let n = usize::from(chunk.n_anchors());
    let n_values = n * bundle.header().n_channels();
    let (mut sites, mut symbols, mut values) = (vec![AnchorSite::default(); n], vec![0; n_values], vec![0.0; n_values]);
    chunk.decode_symbols(&mut models, &mut sites, &mut symbols).expect("a sound chunk");
    chunk.decode_values(&mut models, &mut sites, &mut values).expect("a sound chunk");
    (sites, symbols, values.into_iter().map(f32::to_bits).collect())
}

#[test]
fn one_thread_and_many_decode_the_same() {
    for coder in CODERS {
        let bytes = tiered(&CASES[0], coder, 32);
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let with = |n_threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().expect("threads start");
            pool.install(|| (0..bundle.n_chunks()).into_par_iter().map(|index| decode(&bundle, index)).collect())
        };
        let one: Vec<_> = with(1);
        for n_threads in [2, 3, 8] {
            assert!(with(n_threads) == one, "{coder:?}: {n_threads} threads decode something else");
        }
        let backwards: Vec<_> = (0..bundle.n_chunks()).rev().map(|index| decode(&bundle, index)).collect();
        assert!(backwards.iter().rev().eq(&one), "{coder:?}: the order of the chunks shows");
    }
}

#[test]
fn a_digest_tells_bundles_apart() {
    let digest = |bytes: &[u8]| {
        let bundle = Bundle::parse(bytes).expect("the writer's bundle is sound");
        digests(&bundle, &mut vec![0; bundle.anchor_scratch_words()]).expect("sound chunks")
    };
    let [tables, context] = CODERS.map(|coder| digest(&tiered(&CASES[1], coder, 64)));
    assert_eq!(tables, digest(&tiered(&CASES[1], CODERS[0], 64)), "the same bundle, the same digest");
    assert!(tables[0] != context[0] && tables[1] != context[1], "other steps, other symbols and values");
    assert_ne!(tables, digest(&tiered(&CASES[3], CODERS[0], 64)), "another scene, another digest");
}
