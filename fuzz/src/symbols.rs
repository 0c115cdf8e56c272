//! Any chunks decode or are refused.

use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::AnchorSite;

use super::MOST_ANCHORS;
use super::blame::check_blame;
use super::seal::reseal;

/// Symbols decode, and to the same values however they are read.
///
/// Checksums are made right first.
pub fn symbols(bytes: &[u8]) {
    let mut bytes = bytes.to_vec();
    reseal(&mut bytes);
    let Ok(bundle) = Bundle::parse(&bytes) else { return };
    if bundle.n_anchors() > MOST_ANCHORS {
        return;
    }
    let mut scratch = vec![0; bundle.anchor_scratch_words()];
    let mut models = bundle.anchor_models(&mut scratch).expect("as many words as asked for");
    let n_channels = bundle.header().n_channels();
    for chunk in bundle.chunks() {
        let n = usize::from(chunk.n_anchors());
        let (mut sites, mut symbols) = (vec![AnchorSite::default(); n], vec![0; n * n_channels]);
        let found = chunk.decode_symbols(&mut models, &mut sites, &mut symbols);
        let (mut same_sites, mut values) = (sites.clone(), vec![0.0; n * n_channels]);
        assert_eq!(chunk.decode_values(&mut models, &mut same_sites, &mut values), found, "chunk {}", chunk.index());
        if let Err(error) = found {
            check_blame(&error);
            continue;
        }
        assert_eq!(same_sites, sites, "chunk {}", chunk.index());
        assert!(values.iter().all(|value| value.is_finite()), "values of chunk {}", chunk.index());
        // Without masks a cell cannot be listed twice; the trie has no place for it.
        assert!(sites.windows(2).all(|pair| pair[0].lattice != pair[1].lattice), "cells of chunk {}", chunk.index());
    }
}
