//! Less exact frames stay near the exact ones and take less work; levels beyond their limits are refused.

use conformance::bundles::{CODERS, tiered};
use conformance::frame::{budget_for, to_core};
use conformance::scenes::{CASES, cameras};
use pocketsplat_codec::verify::Trial;
use pocketsplat_core::{Bundle, DecodeError, Field, Plan, Quality};

/// Mean square difference of two frames, 255ths.
fn mean_square(a: &[u8], b: &[u8]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum();
    sum / a.len() as f64
}

#[test]
fn coarser_levels_take_less_work_and_stay_near() {
    for (i, case) in CASES.iter().enumerate() {
        let bytes = tiered(case, CODERS[i % 2], 64);
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let camera = to_core(&cameras()[0].1);
        let draw = |quality: Quality| {
            let plan = Plan::new(&bundle, &budget_for(&camera).with_quality(quality)).expect("planned");
            Trial::run(&bundle, plan, &camera, 0, 0).unwrap_or_else(|breach| panic!("{breach}"))
        };
        let [exact, balanced, draft] = [Quality::EXACT, Quality::BALANCED, Quality::DRAFT].map(draw);
        for [coarser, finer] in [[&balanced, &exact], [&draft, &balanced]].map(|pair| pair.map(|trial| trial.report)) {
            assert!(coarser.pixel_splats <= finer.pixel_splats, "{}: {coarser:?}", case.name);
            assert!(coarser.head_macs <= finer.head_macs, "{}: {coarser:?}", case.name);
        }
        assert!(balanced.report.pixel_splats < exact.report.pixel_splats, "{}: smaller splats", case.name);
        // Alpha changes by 1/255 at most where a splat's rim was, and by as much in its middle.
        let error = mean_square(&balanced.rgb, &exact.rgb);
        assert!(error < 2.0 * 2.0, "{}: {error}", case.name);
        // Twice as coarse; colours lack what a detail head adds, whatever that is.
        if !bundle.header().features.effects.detail {
            let error = mean_square(&draft.rgb, &exact.rgb);
            assert!(error < 3.0 * 3.0, "{}, draft: {error}", case.name);
        }
    }
}

#[test]
fn levels_beyond_their_limits_are_refused_by_number() {
    let bytes = tiered(&CASES[0], CODERS[0], 64);
    let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
    let budget = budget_for(&to_core(&cameras()[0].1));
    for (quality, field, found) in [
        (Quality { alpha_cut: 0, ..Quality::EXACT }, Field::AlphaCut, 0),
        (Quality { alpha_cut: 65, ..Quality::EXACT }, Field::AlphaCut, 65),
    ] {
        match Plan::new(&bundle, &budget.with_quality(quality)) {
            Err(DecodeError::OutOfRange { field: f, found: n, .. }) => assert_eq!((f, n), (field, found)),
            other => panic!("{other:?}"),
        }
    }
}
