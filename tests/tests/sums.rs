//! Sums of features in memory: the same pixels for fewer multiply-adds, as many as the widths say.

use conformance::bundles::{CODERS, tiered};
use conformance::frame::{Frame, budget_for, to_core};
use conformance::scenes::{CASES, cameras};
use pocketsplat_codec::verify::Trial;
use pocketsplat_core::{Bundle, Decoder, HeadWeights, Plan, Residency, Strips, WithoutFpu};

#[test]
fn sums_change_no_pixel_and_save_what_the_widths_say() {
    let mut n_compared = 0;
    for (i, case) in CASES.iter().enumerate() {
        let bytes = tiered(case, CODERS[i % 2], 64);
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        if bundle.n_gaussians(0).is_some() {
            continue;
        }
        n_compared += 1;
        let header = bundle.header();
        let [f, c, d] = [header.feature_dim, header.colour_hidden, header.detail_hidden].map(u64::from);
        for (_, camera) in cameras() {
            let camera = to_core(&camera);
            let [summed, resident] = [Residency::AutoWithSums, Residency::Resident].map(|residency| {
                let plan = Plan::new(&bundle, &budget_for(&camera).with_residency(residency)).expect("planned");
                assert_eq!((plan.keeps_sums(), plan.is_resident()), (residency != Residency::Resident, true));
                let trial = Trial::run(&bundle, plan, &camera, 0, 0).expect("drawn");
                let most = plan.work().map_or(u64::MAX, |work| work.head_macs);
                assert!(trial.report.head_macs <= most, "{}: {} of {most} planned", case.name, trial.report.head_macs);
                trial
            });
            assert!(summed.rgb == resident.rgb, "{}: other pixels", case.name);
            let saved = resident.report.head_macs - summed.report.head_macs;
            let visible = u64::from(resident.report.anchors_visible);
            assert!(saved >= visible * f * f, "{}: the opacity head's of {visible} anchors, {saved}", case.name);
            assert!(saved <= visible * f * (2 * f + c + d), "{}: all heads' of {visible} anchors, {saved}", case.name);
            assert_eq!((saved - visible * f * f) % (f * (f + c + d)), 0, "{}: of whole anchors", case.name);
        }
    }
    assert!(n_compared >= 9, "{n_compared} of {} cases keep sums", CASES.len());
}

#[test]
fn where_sums_have_no_room_the_plan_is_the_usual_one() {
    let bytes = tiered(&CASES[0], CODERS[0], 64);
    let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
    let usual = budget_for(&to_core(&cameras()[0].1)).with_residency(Residency::Auto);
    let ample = usual.with_residency(Residency::AutoWithSums);
    let [whole, with_sums] = [usual, ample].map(|budget| Plan::new(&bundle, &budget).expect("planned"));
    assert!(with_sums.keeps_sums() && with_sums.scratch_len() > whole.scratch_len(), "{with_sums:?}");
    let (mut n_with, mut n_in_halves) = (0, 0);
    for ram_bytes in (0..with_sums.scratch_len() + 200).step_by(200) {
        let [plan, without] = [ample, usual].map(|budget| Plan::new(&bundle, &budget.in_bytes(ram_bytes)).ok());
        let (Some(plan), Some(without)) = (plan, without) else {
            assert_eq!(plan.is_some(), without.is_some(), "{ram_bytes} bytes do for both or neither");
            continue;
        };
        n_with += usize::from(plan.keeps_sums());
        n_in_halves += usize::from(plan.head_weights() == HeadWeights::F16);
        assert_eq!(plan.pruning_rate(), without.pruning_rate(), "{ram_bytes} bytes: sums cost no anchor");
        assert_eq!(plan.head_weights(), without.head_weights(), "{ram_bytes} bytes: and no weight");
        assert!(!plan.keeps_sums() || plan.head_weights() == HeadWeights::F32, "{plan:?}");
        if !plan.keeps_sums() {
            assert_eq!((plan.scratch_len(), plan.n_strips()), (without.scratch_len(), without.n_strips()));
        }
    }
    assert!(n_with > 0 && n_in_halves > 0, "{n_with} plans with sums, {n_in_halves} in halves");
}

#[test]
fn sums_go_before_one_strip() {
    let bytes = tiered(&CASES[0], CODERS[0], 64);
    let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
    let one_strip = budget_for(&to_core(&cameras()[0].1)).with_residency(Residency::AutoWithSums);
    let any_strips = one_strip.with_strips(Strips::Auto);
    let whole = Plan::new(&bundle, &any_strips).expect("planned");
    let plans = (0..whole.scratch_len()).step_by(200).filter_map(|n| Plan::new(&bundle, &any_strips.in_bytes(n)).ok());
    assert!(whole.keeps_sums() && plans.filter(Plan::keeps_sums).all(|plan| plan.n_strips() == 1), "of its own accord");
    let asked = Plan::new(&bundle, &one_strip.with_strips(Strips::Exactly(4))).expect("planned");
    assert!(asked.keeps_sums(), "strips that are asked for have sums");
}

#[test]
fn integers_do_without() {
    let bytes = tiered(&CASES[0], CODERS[0], 64);
    let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
    let camera = to_core(&cameras()[0].1);
    let [summed, resident] = [Residency::AutoWithSums, Residency::Resident].map(|residency| {
        let plan = Plan::new(&bundle, &budget_for(&camera).with_residency(residency)).expect("planned");
        let mut scratch = vec![0; plan.scratch_len()];
        let mut frame = Frame::new(camera.width_px, camera.height_px);
        let mut decoder = Decoder::bind_in::<WithoutFpu>(&bundle, plan, &mut scratch).expect("bound");
        let report = decoder.render(&camera, &mut frame).expect("drawn");
        (frame.rgb, report.head_macs)
    });
    assert!(summed == resident, "the same frame for the same work");
}
