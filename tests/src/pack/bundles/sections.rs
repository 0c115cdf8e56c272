//! Sections that a decoder may skip, the manifest, and what of the header no pixel depends on.

use glam::DVec3;
use pocketsplat_codec::manifest;
use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::Effects;

use super::{SMALL, anchors, front, in_tiers, sample, small};
use crate::pack::sample::{NO_EFFECT, Sample};
use crate::scenes::look_at;

/// Sections that a decoder may skip, and everything else of the header that no pixel depends on.
pub(super) fn samples() -> Vec<Sample> {
    let mut samples = Vec::new();
    let mut some = small(NO_EFFECT, SMALL, false, 600);
    some.protocol = Some(b"[[capture]]\nsize = [48, 36]\n".iter().copied().cycle().take(200).collect());
    some.unknown = vec![
        (0, 130, b"before the heads".to_vec()),
        (2, 255, Vec::new()),
        (4, 130, b"the same kind again".to_vec()),
        (6, 200, vec![0; 5]),
    ];
    some.optional_features = 0xFFFF_FFFF;
    some.training_px = [u16::MAX, 1];
    some.normalisation = ([-1e300, 1e-300, 0.0], f64::MIN_POSITIVE);
    let about = "Sections of unknown kinds, one of them twice and one empty, a protocol of 200 bytes, and all optional features.";
    samples.push(sample("sections-unknown", about, some, &[front()]));

    let mut most = small(NO_EFFECT, SMALL, false, 601);
    most.unknown = (0..249).map(|i| (i % 6, 131 + (i % 120) as u8, vec![i as u8; i % 2])).collect();
    most.unknown.sort_by_key(|section| section.0);
    most.protocol = None;
    samples.push(sample("sections-255", "A section table of 255 rows.", most, &[front()]));

    let mut unmeant = small(Effects { view_distance: true, ..NO_EFFECT }, SMALL, false, 602);
    unmeant.unknown = vec![(6, 128, 7_u32.to_le_bytes().to_vec())];
    unmeant.protocol = Some(Vec::new());
    let about =
        "A section gaussians in a scene whose heads see the view, where it means nothing, and an empty protocol.";
    // Before the chunks: heads, lattice, tables, manifest, directory.
    unmeant.unknown[0].0 = 5;
    samples.push(sample("gaussians-without-meaning", about, unmeant, &[front()]));
    for (level, size_px) in (1..).zip([[48, 36], [128, 128], [160, 120], [320, 240], [640, 480]]) {
        let seed = 602 + u64::from(level);
        let mut measured = small(NO_EFFECT, SMALL, false, seed);
        measured.tiers = in_tiers(&anchors(20, SMALL, NO_EFFECT, false, seed), &[10, 20], 5);
        measured.max_chunk_anchors = 5;
        measured.training_px = size_px.map(|px| px as u16);
        let file = measured.clone().file();
        let bundle = Bundle::parse(&file).expect("a sound draft");
        let eyes = [[1.7, -1.1, 0.6], [-1.2, -1.3, 0.9]];
        let views = eyes.map(|eye| look_at(eye.into(), DVec3::ZERO, 1.2, size_px));
        measured.measures = manifest::measure(&bundle, &views, &[]).expect("sound chunks");
        measured.measures.iter_mut().for_each(|of_tier| of_tier.level = level);
        (measured.measures[1].psnr_db, measured.measures[1].n_views) = (Some(-3.25), 2);
        let about = format!(
            "A manifest with measures of {}×{} pixels, level {level}, and a PSNR below 0.",
            size_px[0], size_px[1]
        );
        samples.push(sample(&format!("manifest-level-{level}"), &about, measured, &[front()]));
    }
    samples
}
