use std::collections::BTreeSet;

use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::cut_after;

use super::{SMALL, TABLES, camera, decoded_rows, info, options, random_scene, with_context};
use crate::bundle::{ChannelCoding, WriteError, WriteOptions, write};
use crate::render::decoder::{core_image, core_image_of_tiers};

const RATES: [f32; 3] = [0.5, 0.2, 0.0];

/// Importance of an anchor by its index in the scene: no order that positions know of.
fn importance(n: usize) -> Vec<f32> {
    (0..n).map(|i| ((i * 7919) % n) as f32).collect()
}

fn tiered(coder: ChannelCoding, chunk_anchors: u16) -> (pocketsplat_kernels::scene::Scene<f32>, Vec<u8>) {
    let mut scene = with_context(random_scene(SMALL, 400, 51), 52);
    scene.anchors.mask_logits.fill(1.0);
    let options = WriteOptions {
        importance: Some(importance(400)),
        pruning_rates: RATES.to_vec(),
        ..options(coder, chunk_anchors)
    };
    let bytes = write(&scene, &info(), &options).expect("a sound scene").bytes;
    (scene, bytes)
}

#[test]
fn tiers_hold_the_most_important_anchors() {
    let (scene, bytes) = tiered(TABLES, 64);
    let bundle = Bundle::parse(&bytes).expect("a sound bundle");
    let cells: Vec<[i32; 3]> = decoded_rows(&bundle).iter().map(|(site, _)| site.lattice).collect();
    let mut by_importance: Vec<usize> = (0..400).collect();
    by_importance.sort_by_key(|i| std::cmp::Reverse((i * 7919) % 400));
    for (tier, n_anchors) in [(0, 200), (1, 320), (2, 400)] {
        let ends = bundle.tier(tier).expect("a tier");
        assert_eq!(ends.n_anchors, n_anchors, "tiers up to {tier}");
        let kept: BTreeSet<[i32; 3]> = cells[..n_anchors as usize].iter().copied().collect();
        let most_important = &by_importance[..n_anchors as usize];
        assert!(most_important.iter().all(|&i| kept.contains(&scene.anchors.lattice[i])), "tiers up to {tier}");
    }
}

#[test]
fn a_file_cut_at_a_tiers_end_is_the_smaller_scene() {
    for coder in [TABLES, ChannelCoding::Context] {
        let (_, bytes) = tiered(coder, 32);
        let whole = Bundle::parse(&bytes).expect("a sound bundle");
        let rows = decoded_rows(&whole);
        let chunks_start = bytes.len() - whole.tier(2).expect("the last tier").end as usize;
        for tier in 0..3 {
            let ends = whole.tier(tier).expect("a tier");
            let cut = Bundle::parse(&bytes[..chunks_start + ends.end as usize]).expect("cut at a tier's end");
            assert_eq!((cut.n_tiers(), cut.header().n_tiers), (tier + 1, 3), "{coder:?}: tiers there and written");
            assert_eq!(decoded_rows(&cut), rows[..ends.n_anchors as usize], "{coder:?}: anchors up to tier {tier}");
            let small = core_image(&cut, &camera(60, 40)).expect("a frame");
            let limited = core_image_of_tiers(&whole, &camera(60, 40), tier + 1).expect("a frame");
            assert!(small.image == limited.image, "{coder:?}: the same picture as of the whole file limited to {tier}");
            // In a flash partition that held the whole file, or something else, before.
            let mut partition = bytes.clone();
            let len = cut_after(&mut partition, tier + 1).expect("a tier");
            assert_eq!(len, chunks_start + ends.end as usize, "{coder:?}: cut at a tier's end");
            for fill in [None, Some(0xFF), Some(0x5A)] {
                fill.into_iter().for_each(|fill| partition[len..].fill(fill));
                let cut = Bundle::parse(&partition).expect("a cut file in a partition");
                assert_eq!(decoded_rows(&cut), rows[..ends.n_anchors as usize], "{coder:?}: {fill:?} behind it");
            }
        }
    }
}

#[test]
fn tiers_that_do_not_nest_are_refused() {
    let scene = random_scene(SMALL, 20, 53);
    for rates in [vec![0.2, 0.4, 0.0], vec![0.3], vec![]] {
        let options =
            WriteOptions { importance: Some(importance(20)), pruning_rates: rates.clone(), ..WriteOptions::default() };
        let error = write(&scene, &info(), &options).expect_err("no nested scenes");
        assert!(matches!(error, WriteError::Tiers { .. }), "{rates:?}: {error}");
    }
    let options = WriteOptions { importance: Some(importance(19)), ..WriteOptions::default() };
    let error = write(&scene, &info(), &options).expect_err("an importance is missing");
    assert!(matches!(error, WriteError::Length { needed: 20, found: 19, .. }), "{error}");
}
