//! The conformance pack: bundles with everything that the format has, what a reader must find in them, and files that it must refuse.
//!
//! `numbers`, `stream` → `positions`, `models` → `heads`, `contexts`, `ink` → `draft` → `sample` → `splats`, `bundles` → `expected` →
//! `coverage`, `refused`. Drafts are put together number by number with the decoder's own `emit`s, not with the trainer's writer, which makes
//! only what a training ends in. Of a machine's own functions only the exponential decides about bytes, of ink boxes, which are rounded outwards.

pub mod bundles;
pub mod contexts;
pub mod coverage;
pub mod draft;
pub mod expected;
pub mod heads;
pub mod ink;
pub mod models;
pub mod numbers;
pub mod positions;
pub mod refused;
pub mod sample;
pub mod splats;
pub mod stream;

use std::collections::BTreeMap;

use sample::Sample;

/// Its folders.
pub const FOLDERS: [&str; 3] = ["bundles", "frames", "refused"];

/// The files of the pack but its README: paths from its folder, and what is in them.
///
/// * `samples`: [`bundles::samples`].
pub fn files(samples: &[Sample]) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for sample in samples {
        let (name, frames) = (&sample.name, sample.frames());
        files.insert(format!("bundles/{name}.json"), sample.json(&frames).into_bytes());
        for (index, frame) in frames.iter().enumerate() {
            files.insert(format!("frames/{name}-{index}.png"), expected::png(frame));
        }
        files.insert(format!("bundles/{name}.psb"), sample.bytes.clone());
    }
    let refused = refused::files();
    files.insert("refused.json".to_owned(), refused::json(&refused).into_bytes());
    files.extend(refused.into_iter().map(|file| (format!("refused/{}.psb", file.name), file.bytes)));
    files
}
