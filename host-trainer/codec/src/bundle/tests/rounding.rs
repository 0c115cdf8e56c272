//! Values are rounded once, and by one rule: the bundle holds the symbols that the last phase of training drew.

use pocketsplat_format::Bundle;
use pocketsplat_format::context::Group;

use super::{SMALL, options, random_scene, with_context, write_bytes};
use crate::bundle::channels::ContextWork;
use crate::bundle::{ChannelCoding, WriteOptions, decoded_scene};
use pocketsplat_kernels::integer_model;
use pocketsplat_kernels::ops::rate::perturb;
use pocketsplat_kernels::scene::Scene;

/// The bundle of a scene under its context model.
fn coded_by_context(scene: &Scene<f32>, importance: Option<Vec<f32>>) -> Vec<u8> {
    write_bytes(scene, &WriteOptions { importance, ..options(ChannelCoding::Context, 256) })
}

#[test]
fn quotients_that_round_to_a_tie_round_as_in_training() {
    let mut scene = with_context(random_scene(SMALL, 400, 4), 5);
    scene.anchors.mask_logits.fill(1.0);
    let section = integer_model::section(scene.context.as_ref().expect("given one"), SMALL.values_per_anchor());
    let section = section.expect("a sound model");
    let integers = integer_model::parse(&section, &SMALL).expect("a sound section");
    let f = SMALL.feature_dim;
    let (mut expected, mut n_apart) = (Vec::new(), 0);
    for (a, cell) in scene.anchors.lattice.iter().enumerate() {
        let step = ContextWork::default().enter(&integers, *cell).value(Group::ALL[0]);
        let features = &mut scene.anchors.features[a * f..][..f];
        for (i, feature) in features.iter_mut().enumerate() {
            // Next to the middle between two symbols.
            let middle = ((a + i) as f32 + 0.5) * step;
            *feature = [middle.next_down(), middle, middle.next_up()][i % 3];
            let in_f64 = (f64::from(*feature) / f64::from(step)).round_ties_even();
            n_apart += usize::from(f64::from(perturb::symbol(*feature, step)) != in_f64);
        }
        let mut trained = features.to_vec();
        perturb::rounded(step, &mut trained, &mut vec![0.0; f]);
        expected.push((*cell, trained));
    }
    assert!(n_apart > 0, "values at which another precision rounds otherwise");
    let bytes = coded_by_context(&scene, None);
    let decoded = decoded_scene(&Bundle::parse(&bytes).expect("sound")).expect("sound");
    let mut found: Vec<_> = decoded.anchors.lattice.into_iter().zip(decoded.anchors.features.chunks(f)).collect();
    found.sort_by_key(|(cell, _)| *cell);
    expected.sort_by_key(|(cell, _)| *cell);
    assert!(found.into_iter().eq(expected.iter().map(|(cell, row)| (*cell, row.as_slice()))));
}
