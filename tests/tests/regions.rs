//! Memory in two regions: the same pixels as in one, the bytes of each told exactly, one fewer of either refused by name.

use conformance::bundles::{ALL_CODERS, tiered};
use conformance::frame::{Frame, budget_for, to_core};
use conformance::scenes::{CASES, cameras};
use pocketsplat_core::{
    Budget, Bundle, Camera, DecodeError, Decoder, ErrorClass, FrameReport, MaxSplats, Overflow, Part, Plan, Region,
    Residency,
};

/// A bundle for each case, of each coder in turn.
fn files() -> impl Iterator<Item = (&'static str, Vec<u8>)> {
    CASES.iter().enumerate().map(|(i, case)| (case.name, tiered(case, ALL_CODERS[i % 3], 64)))
}

fn view() -> Camera {
    to_core(&cameras()[0].1)
}

/// The frame that a plan draws in memory of so many bytes fewer than it says, filled with `fill` before.
fn drawn(bundle: &Bundle<'_>, plan: Plan, fill: u8, fewer: [usize; 2]) -> Result<Frame, DecodeError> {
    reported(bundle, plan, fill, fewer).map(|(frame, _)| frame)
}

/// As [`drawn`], and what the frame consisted of.
fn reported(bundle: &Bundle<'_>, plan: Plan, fill: u8, fewer: [usize; 2]) -> Result<(Frame, FrameReport), DecodeError> {
    let [mut fast, mut slow] =
        [plan.scratch_len() - fewer[0], plan.slow_scratch_len() - fewer[1]].map(|len| vec![fill; len]);
    let camera = view();
    let mut frame = Frame::new(camera.width_px, camera.height_px);
    let mut decoder = Decoder::bind(bundle, plan, [&mut fast, &mut slow])?;
    let report = decoder.render(&camera, &mut frame)?;
    Ok((frame, report))
}

/// Budgets with as many fast bytes as each part of a plan's memory takes alone, and with shares of all of them.
fn split(budget: Budget, plan: &Plan) -> impl Iterator<Item = Budget> + use<'_> {
    let shares = [0, 10, 30, 60, 90, 100].map(|percent| plan.scratch_len() * percent / 100);
    let parts = plan.memory().map(|part| part.n_bytes + 3);
    parts.chain(shares).map(move |fast| budget.in_bytes(fast).with_slow_bytes(plan.scratch_len() + 3))
}

#[test]
fn where_memory_lies_changes_no_pixel_and_its_bytes_are_exact() {
    let mut n_split = 0;
    for (name, bytes) in files() {
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let free = budget_for(&view());
        for residency in [Residency::Resident, Residency::Streamed] {
            let budget = free.with_residency(residency);
            let whole = Plan::new(&bundle, &budget).expect("memory without limit");
            let expected = drawn(&bundle, whole, 0, [0, 0]).expect("drawn in one region");
            for budget in split(budget, &whole) {
                let plan = Plan::new(&bundle, &budget).expect("slow memory for all of it");
                let lens = [plan.scratch_len(), plan.slow_scratch_len()];
                assert!(lens[0] <= budget.ram_bytes && lens[1] <= budget.slow_bytes, "{name}: {lens:?} of {budget:?}");
                assert_eq!(plan.pruning_rate(), 0.0, "{name}: the whole scene, {budget:?}");
                for fill in [0, 0xA5] {
                    let frame = drawn(&bundle, plan, fill, [0, 0]).expect("its own bytes do");
                    assert!(frame.rgb == expected.rgb, "{name}, {residency:?}, {budget:?}: other pixels");
                }
                for (region, len, fewer) in [(Region::Fast, lens[0], [1, 0]), (Region::Slow, lens[1], [0, 1])] {
                    if len > 0 {
                        let [needed, available] = [len, len - 1].map(|n| n as u32);
                        let error = drawn(&bundle, plan, 0, fewer).map(|_| ()).expect_err("one byte fewer");
                        assert_eq!(
                            error,
                            DecodeError::ScratchTooSmall { region, needed, available },
                            "{name}: {error}"
                        );
                    }
                }
                n_split += usize::from(lens.iter().all(|len| *len > 0));
            }
        }
    }
    assert!(n_split > 100, "only {n_split} plans used both regions");
}

/// What a frame reports as used are the bytes of both regions in a plan with places for just its splats, which draws it.
#[test]
fn the_bytes_that_a_frame_used_are_those_of_both_regions() {
    let mut n_split = 0;
    for (name, bytes) in files() {
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let budget = budget_for(&view()).with_max_splats(MaxSplats::Worst).with_residency(Residency::Streamed);
        let whole = Plan::new(&bundle, &budget).expect("memory without limit");
        for budget in split(budget, &whole) {
            let plan = Plan::new(&bundle, &budget).expect("slow memory for all of it");
            let (frame, report) = reported(&bundle, plan, 0xA5, [0, 0]).expect("its own bytes do");
            let most = MaxSplats::AtMost(report.max_splats);
            let just = Plan::new(&bundle, &budget.with_max_splats(most)).expect("no more memory than before");
            // Fewer splats may fit into the fast memory as a whole; the bytes are compared where they lie as before.
            if just.memory().map(|part| part.region).eq(plan.memory().map(|part| part.region)) {
                let len = just.scratch_len() + just.slow_scratch_len();
                assert_eq!(len, report.scratch_used as usize, "{name}, {budget:?}: {report:?}");
                let again = drawn(&bundle, just, 0, [0, 0]).expect("its own bytes do");
                assert!(again.rgb == frame.rgb, "{name}, {budget:?}: other pixels");
                n_split += usize::from(just.scratch_len() > 0 && just.slow_scratch_len() > 0);
            }
        }
    }
    assert!(n_split > 20, "only {n_split} plans used both regions");
}

#[test]
fn the_parts_make_up_the_lengths() {
    for (name, bytes) in files() {
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let whole = Plan::new(&bundle, &budget_for(&view())).expect("memory without limit");
        for budget in split(budget_for(&view()), &whole) {
            let plan = Plan::new(&bundle, &budget).expect("slow memory for all of it");
            assert_eq!(plan.memory().map(|memory| memory.part).collect::<Vec<_>>(), Part::ALL, "{name}: each once");
            for (region, len) in [(Region::Fast, plan.scratch_len()), (Region::Slow, plan.slow_scratch_len())] {
                let parts = plan.memory().filter(|memory| memory.region == region);
                let sum: usize = parts.map(|memory| memory.n_bytes).sum();
                let (exact, bound) = (sum + 3 == len, sum + 3 < len);
                assert!(
                    exact || bound && plan.is_resident() || (sum, len) == (0, 0),
                    "{name}: {sum} of {len} bytes, {plan:?}"
                );
            }
        }
    }
}

#[test]
fn too_little_slow_memory_is_refused_by_the_number_that_would_do() {
    let (name, bytes) = files().next().expect("a case");
    let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
    for fast in [0, 500, 3000] {
        let budget = budget_for(&view()).in_bytes(fast).with_slow_bytes(1);
        let error = Plan::new(&bundle, &budget).expect_err("one slow byte holds nothing");
        assert_eq!(error.class(), ErrorClass::OverBudget, "{name}: {error}");
        let DecodeError::BudgetTooSmall { region: Region::Slow, needed, available: 1, .. } = error else {
            panic!("{error}")
        };
        let just = budget.with_slow_bytes(needed as usize);
        assert_eq!(
            Plan::new(&bundle, &just).map(|plan| plan.slow_scratch_len()),
            Ok(needed as usize),
            "{name}: {error}"
        );
        assert!(
            Plan::new(&bundle, &just.with_slow_bytes(needed as usize - 1)).is_err(),
            "{name}: one fewer than {needed}"
        );
    }
}

#[test]
fn slabs_take_their_splats_from_either_region() {
    let mut n_compared = 0;
    for (name, bytes) in files() {
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let budget = budget_for(&view()).with_max_splats(MaxSplats::Worst).with_overflow(Overflow::Slabs);
        let whole = Plan::new(&bundle, &budget).expect("memory without limit");
        // Two fifths of what the slabs would like in each region, and nearly all of it in one.
        for (fast, slow) in [(40, 40), (2, 78), (70, 5)] {
            let least = match Plan::new(&bundle, &budget.in_bytes(0)) {
                Err(DecodeError::BudgetTooSmall { needed, .. }) => needed as usize,
                other => panic!("{name}: no memory suffices: {other:?}"),
            };
            let [fast, slow] = [fast, slow].map(|percent| least + (whole.scratch_len() - least) * percent / 100);
            let plan = Plan::new(&bundle, &budget.in_bytes(fast).with_slow_bytes(slow));
            let plan = plan.unwrap_or_else(|error| panic!("{name}: {error}"));
            let one = Plan::new(&bundle, &budget.in_bytes(whole.scratch_len()).with_tiers(plan.n_tiers()));
            let one = one.unwrap_or_else(|error| panic!("{name}: {error}"));
            if plan.head_weights() == one.head_weights() {
                let expected = drawn(&bundle, one, 0, [0, 0]).expect("drawn in one region");
                let frame = drawn(&bundle, plan, 0xA5, [0, 0]).expect("its own bytes do");
                assert!(frame.rgb == expected.rgb, "{name}, {fast} and {slow} bytes: other pixels");
                n_compared += 1;
            }
        }
    }
    assert!(n_compared > 10, "only {n_compared} frames compared");
}
