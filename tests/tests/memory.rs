//! The memory contract: a plan's bytes suffice, one fewer is refused by number, nothing else is touched, and neither where
//! anchors wait nor in how many strips a frame is drawn changes a pixel.

use conformance::bundles::{ALL_CODERS, measured, tiered};
use conformance::frame::{budget_for, to_core};
use conformance::scenes::{CASES, cameras, orbit};
use pocketsplat_codec::verify::{
    Touched, Trial, Violation, exact_bytes, halves, memory_does_not_show, plan_variants, variants_match,
};
use pocketsplat_core::{
    Budget, Bundle, Camera, DecodeError, ErrorClass, MaxSplats, Plan, Residency, ScratchShape, Strips,
};

/// A bundle for each case, of each coder in turn, with masks and three tiers.
fn files() -> impl Iterator<Item = (&'static str, Vec<u8>)> {
    CASES.iter().enumerate().map(|(i, case)| (case.name, tiered(case, ALL_CODERS[i % 3], 64)))
}

/// Views of the test scenes: from outside, with a skewed lens, from within.
fn views() -> [Camera; 3] {
    let cameras = cameras();
    [0, 2, 3].map(|view: usize| to_core(&cameras[view].1))
}

fn draw(bundle: &Bundle<'_>, plan: Plan, camera: &Camera) -> Trial {
    Trial::run(bundle, plan, camera, 0, 0).unwrap_or_else(|breach| panic!("{breach}: {plan:?}"))
}

/// Panics with the law's name and the violation.
fn holds<T>(law: &str, result: Result<T, Violation>) -> T {
    result.unwrap_or_else(|violation| panic!("{law}: {violation}"))
}

#[test]
fn residency_and_strips_change_no_pixel() {
    for (name, bytes) in files() {
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        for camera in views() {
            for tiers in 1..=3 {
                holds(name, variants_match(&bundle, budget_for(&camera).with_tiers(tiers), &camera));
            }
        }
    }
}

#[test]
fn the_planned_bytes_suffice_and_fewer_are_refused_by_number() {
    for (name, bytes) in files() {
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let budget = budget_for(&views()[0]);
        for max_splats in [MaxSplats::Worst, MaxSplats::AtMost(100), MaxSplats::AtMost(0)] {
            for way in plan_variants(&bundle, budget.with_max_splats(max_splats)) {
                holds(name, exact_bytes(&bundle, Plan::new(&bundle, &way).expect("planned")));
                if let Some(plan) = halves(&bundle, &way) {
                    holds(name, exact_bytes(&bundle, plan));
                }
            }
        }
    }
}

#[test]
fn memory_content_and_alignment_do_not_show_and_the_mark_covers_what_was_touched() {
    for (name, bytes) in files() {
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let camera = views()[0];
        for way in plan_variants(&bundle, budget_for(&camera)) {
            let plan = Plan::new(&bundle, &way).expect("planned");
            let Touched { bytes, mark } = holds(name, memory_does_not_show(&bundle, plan, &camera));
            assert!(bytes * 10 >= mark * 9, "{name}: {bytes} of {mark} bytes: {plan:?}");
        }
    }
}

#[test]
fn measured_plans_hold_the_views_measured_and_waste_little() {
    for (case, coder) in CASES.iter().zip(ALL_CODERS.into_iter().cycle()) {
        let views = orbit(12);
        let bytes = measured(case, coder, &views);
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let views: Vec<Camera> = views.iter().map(to_core).collect();
        for tiers in [1, 3] {
            let budget = budget_for(&views[0]).with_max_splats(MaxSplats::Measured).with_tiers(tiers);
            for way in plan_variants(&bundle, budget) {
                let plan = Plan::new(&bundle, &way).expect("planned");
                let reports: Vec<_> = views.iter().map(|camera| draw(&bundle, plan, camera).report).collect();
                let most = reports.iter().map(|report| report.scratch_used as usize).max().unwrap_or(0);
                let worst = Plan::new(&bundle, &way.with_max_splats(MaxSplats::Worst)).expect("planned").max_splats();
                assert!(reports.iter().all(|report| report.splats_dropped == 0), "{}: {plan:?}", case.name);
                assert!(plan.max_splats() <= worst, "{}: never above the worst case", case.name);
                assert!(most * 10 >= plan.scratch_len() * 9, "{}: {most} bytes of {plan:?}", case.name);
            }
        }
    }
}

#[test]
fn predicted_work_bounds_the_work_of_the_views_measured_closely() {
    for (case, coder) in CASES.iter().zip(ALL_CODERS.into_iter().cycle()) {
        let views = orbit(12);
        let bytes = measured(case, coder, &views);
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        for way in plan_variants(&bundle, budget_for(&to_core(&views[0]))) {
            let plan = Plan::new(&bundle, &way).expect("planned");
            let bound = plan.work().expect("measured");
            let work: Vec<_> = views.iter().map(|view| draw(&bundle, plan, &to_core(view)).report.work()).collect();
            let most = |count: fn(&pocketsplat_core::Work) -> u64| work.iter().map(count).max().unwrap_or(0);
            for (what, most, bound) in [
                ("multiply-adds", most(|w| w.head_macs), bound.head_macs),
                ("anchors", most(|w| w.decoded_anchors), bound.decoded_anchors),
                ("pixels", most(|w| w.pixel_splats), bound.pixel_splats),
            ] {
                assert!(most <= bound, "{}: {most} {what} of {bound}: {plan:?}", case.name);
                let closely = plan.n_strips() == 1 && what != "pixels";
                // The manifest says how many they are without sums, of which an anchor saves more or less.
                let least = if plan.keeps_sums() { bound / 2 } else { bound * 9 / 10 };
                assert!(!closely || most >= least, "{}: {most} {what} of {bound}: {plan:?}", case.name);
            }
        }
    }
}

/// What is drawn of a view that needs more than there is memory for are the file's first splats: of one strip with memory
/// for just as many they are the whole frame.
#[test]
fn too_many_splats_leave_out_the_last_of_the_file_in_all_strips_alike() {
    for (name, bytes) in files() {
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        for camera in views() {
            let whole_plan = Plan::new(&bundle, &budget_for(&camera)).expect("planned");
            let Trial { rgb: whole_frame, report: whole, .. } = draw(&bundle, whole_plan, &camera);
            for most in [0, 1, whole.splats / 7, whole.splats / 2, whole.splats.saturating_sub(1)] {
                for way in plan_variants(&bundle, budget_for(&camera).with_max_splats(MaxSplats::AtMost(most))) {
                    let plan = Plan::new(&bundle, &way).expect("planned");
                    let Trial { rgb: frame, report, .. } = draw(&bundle, plan, &camera);
                    assert_eq!(report.splats + report.splats_dropped, whole.splats, "{name}, {most}: {report:?}");
                    assert_eq!(report.splats_dropped > 0, report.max_splats > most, "{name}, {most}: {report:?}");
                    assert!(report.scratch_used as usize <= plan.scratch_len(), "{name}, {most}: {report:?}");
                    let first = budget_for(&camera).with_max_splats(MaxSplats::AtMost(report.splats));
                    let first = draw(&bundle, Plan::new(&bundle, &first).expect("planned"), &camera);
                    assert_eq!(first.report.splats, report.splats, "{name}, {most}: as many");
                    assert!(frame == first.rgb, "{name}, {most}: {plan:?}");
                    let enough = way.with_max_splats(MaxSplats::AtMost(report.max_splats));
                    let enough = Plan::new(&bundle, &enough).expect("planned");
                    let saves = plan.scratch_len() < enough.scratch_len();
                    assert!(saves || report.splats_dropped == 0, "{name}, {most}: fewer splats take less memory");
                    let Trial { rgb: frame, report, .. } = draw(&bundle, enough, &camera);
                    assert_eq!(report.splats_dropped, 0, "{name}, {most}: the number to plan for");
                    assert!(frame == whole_frame, "{name}, {most}: the picture of the worst case's memory");
                }
            }
        }
    }
}

#[test]
fn memory_that_is_left_gives_splats_places_and_saves_passes() {
    let views = orbit(6);
    let bytes = measured(&CASES[0], ALL_CODERS[0], &views);
    let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
    let views: Vec<Camera> = views.iter().map(to_core).collect();
    let free = Budget::for_frame(views[0].width_px, views[0].height_px).with_residency(Residency::Streamed);
    let in_one = Plan::new(&bundle, &free.with_strips(Strips::Exactly(1))).expect("planned");
    let whole = in_one.scratch_len();
    let (mut n_shared, mut n_saved) = (0, 0);
    for budget in (1..=24).map(|part| free.in_bytes(whole * part / 24)) {
        let Ok(plan) = Plan::new(&bundle, &budget) else { continue };
        let least = Plan::new(&bundle, &budget.in_bytes(plan.least_len())).expect("the bytes that would do");
        let variant = |plan: &Plan| (plan.n_tiers(), plan.n_strips(), plan.is_resident(), plan.head_weights());
        assert_eq!((variant(&least), least.scratch_len()), (variant(&plan), plan.least_len()), "{plan:?}");
        let fewer = Plan::new(&bundle, &budget.in_bytes(plan.least_len() - 1)).ok();
        assert!(fewer.is_none_or(|fewer| variant(&fewer) != variant(&plan)), "a byte less does not: {plan:?}");
        if plan.n_strips() == 1 {
            assert_eq!(plan.scratch_len(), plan.least_len(), "{plan:?}");
            continue;
        }
        n_shared += 1;
        assert!((0..40).contains(&(budget.ram_bytes - plan.scratch_len())), "all of the budget: {plan:?}");
        let by_hand = budget.with_tiers(plan.n_tiers()).with_strips(Strips::Exactly(plan.n_strips()));
        let by_hand = Plan::new(&bundle, &by_hand).map(|plan| plan.scratch_len());
        assert_eq!(by_hand, Ok(plan.least_len()), "who asks for strips gets what they need: {plan:?}");
        for camera in &views {
            let [few, many] = [least, plan].map(|plan| draw(&bundle, plan, camera));
            assert_eq!((few.report.splats_dropped, many.report.splats_dropped), (0, 0), "{plan:?}");
            assert!(many.rgb == few.rgb, "the same frame: {plan:?}");
            assert!(many.report.anchors_decoded <= few.report.anchors_decoded, "{plan:?}");
            n_saved += usize::from(many.report.anchors_decoded < few.report.anchors_decoded);
        }
    }
    assert!(n_shared > 3 && n_saved > 0, "{n_shared} plans share passes, {n_saved} of their frames save some");
}

#[test]
fn the_most_tiers_that_fit_are_planned() {
    for coder in ALL_CODERS {
        let bytes = measured(&CASES[0], coder, &orbit(4));
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let free = Budget::for_frame(160, 120);
        let largest = Plan::new(&bundle, &free).expect("planned");
        assert_eq!(
            (largest.n_tiers(), largest.n_strips(), largest.pruning_rate()),
            (3, 1, 0.0),
            "with memory to spare"
        );
        assert!(largest.is_resident(), "decoding once is less work");
        let mut tiers_planned = Vec::new();
        for ram_bytes in (0..largest.scratch_len() + 500).step_by(500) {
            // By hand: all there is, one at a time.
            let by_hand = |tiers: u8| {
                let plans = plan_variants(&bundle, free.with_tiers(tiers)).flat_map(|way| {
                    [Some(Plan::new(&bundle, &way).expect("planned")), halves(&bundle, &way)].into_iter().flatten()
                });
                plans.filter(|plan| plan.scratch_len() <= ram_bytes).map(|plan| plan.n_tiers()).max()
            };
            let expected = (1..=3).rev().find_map(by_hand);
            match Plan::new(&bundle, &free.in_bytes(ram_bytes)) {
                Ok(plan) => {
                    assert!(plan.scratch_len() <= ram_bytes, "{ram_bytes} bytes: {plan:?}");
                    assert_eq!(Some(plan.n_tiers()), expected, "{ram_bytes} bytes: {plan:?}");
                    let [all, drawn] =
                        [bundle.header().n_anchors, bundle.tier(plan.n_tiers() - 1).expect("a tier").n_anchors];
                    let rate = (all - drawn) as f32 / all as f32;
                    assert_eq!(plan.pruning_rate(), rate, "{ram_bytes} bytes: {plan:?}");
                    let again = Plan::new(&bundle, &free.in_bytes(plan.scratch_len())).map(|plan| plan.n_tiers());
                    assert_eq!(again, Ok(plan.n_tiers()), "its own bytes do: {plan:?}");
                    tiers_planned.push(plan.n_tiers());
                }
                Err(error) => {
                    assert_eq!((expected, error.class()), (None, ErrorClass::OverBudget), "{ram_bytes} bytes: {error}");
                    let DecodeError::BudgetTooSmall { needed, available, .. } = error else { panic!("{error}") };
                    assert_eq!(available as usize, ram_bytes, "{error}");
                    let just = free.in_bytes(needed as usize);
                    assert_eq!(
                        Plan::new(&bundle, &just).map(|plan| plan.scratch_len()),
                        Ok(needed as usize),
                        "{error}"
                    );
                    assert!(
                        Plan::new(&bundle, &just.in_bytes(needed as usize - 1)).is_err(),
                        "one byte less than {needed}"
                    );
                }
            }
        }
        assert!(tiers_planned.is_sorted() && tiers_planned.first() == Some(&1), "{coder:?}: {tiers_planned:?}");
    }
}

#[test]
fn a_constant_bounds_every_plan() {
    for (name, bytes) in files() {
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        for max_splats in [MaxSplats::Worst, MaxSplats::AtMost(321)] {
            for way in plan_variants(&bundle, budget_for(&views()[0]).with_max_splats(max_splats)) {
                let plan = Plan::new(&bundle, &way).expect("planned");
                let shape = *plan.shape();
                let ScratchShape { model, coder, resident, frame, .. } = shape;
                let most = ScratchShape { resident, frame, ..ScratchShape::most(model.feature_dim, model.n_offsets) };
                assert!(most.scratch_len() >= plan.scratch_len(), "{name}: {plan:?}");
                let mut widths = most;
                widths.model.colour_hidden = model.colour_hidden;
                widths.model.detail_hidden = model.detail_hidden;
                widths.coder.n_tables = coder.n_tables;
                assert!(widths.scratch_len() >= plan.scratch_len(), "{name}: with the widths known: {plan:?}");
                assert!(widths.scratch_len() <= most.scratch_len(), "{name}: knowing more takes no more");
                assert_eq!(plan.shape().scratch_len(), plan.scratch_len(), "{name}: knowing all takes just that");
            }
        }
    }
}
