//! Two painters, each in a thread of its own: the tiles of one decoder, in memory that the plan tells exactly.

use std::convert::Infallible;
use std::fs;
use std::path::Path;
use std::thread;

use pocketsplat_core::{
    Arithmetic, Budget, Bundle, Camera, DecodeError, Decoder, ErrorClass, FrameReport, HeadWeights, MaxSplats,
    Overflow, Part, Plan, ReferenceArithmetic, Region, Residency, Strips, Tile, TileSink, WithoutFpu,
};

/// Every tile in the order in which it comes: its place and size, and its pixels.
#[derive(Default, PartialEq)]
struct Tiles(Vec<([u16; 4], Vec<[u8; 3]>)>);

impl TileSink for Tiles {
    type Error = Infallible;

    fn tile(&mut self, tile: Tile<'_>) -> Result<(), Infallible> {
        self.0.push(([tile.x_px, tile.y_px, tile.width, tile.height], tile.rgb.to_vec()));
        Ok(())
    }
}

type Drawn = Result<(Tiles, FrameReport), DecodeError>;

fn draw<A: Arithmetic>(mut decoder: Decoder<'_, '_, A>, camera: &Camera) -> Drawn {
    let mut tiles = Tiles::default();
    let report = decoder.render(camera, &mut tiles)?;
    Ok((tiles, report))
}

fn by_one<A: Arithmetic>(bundle: &Bundle<'_>, budget: &Budget, camera: &Camera) -> Drawn {
    let plan = Plan::new(bundle, budget)?;
    draw(Decoder::bind_in::<A>(bundle, plan, &mut vec![0; plan.scratch_len()])?, camera)
}

/// Both in memory of so many bytes fewer than the plan says.
fn by_two<A: Arithmetic>(
    bundle: &Bundle<'_>,
    plan: Plan,
    camera: &Camera,
    fewer: [usize; 2],
) -> Result<(Tiles, [FrameReport; 2]), DecodeError> {
    let lens = [plan.scratch_len() - fewer[0], plan.slow_scratch_len() - fewer[1]];
    let [mut fast, mut slow] = lens.map(|len| vec![0xA5; len]);
    let mut painters = Decoder::bind_two::<A>(bundle, plan, [&mut fast, &mut slow])?;
    // A frame before, which leaves its splats behind.
    together(&mut painters, &camera.orbited(1.0))?;
    together(&mut painters, camera)
}

/// The tiles of both, the first one's before the second one's, and what each reports.
fn together<A: Arithmetic>(
    painters: &mut [Decoder<'_, '_, A>; 2],
    camera: &Camera,
) -> Result<(Tiles, [FrameReport; 2]), DecodeError> {
    let [mut above, mut below] = [(); 2].map(|()| Tiles::default());
    let reports = Decoder::render_by_two(painters, camera, [&mut above, &mut below], |here, there| {
        thread::scope(|scope| {
            scope.spawn(there);
            here();
        });
    })?;
    above.0.append(&mut below.0);
    Ok((above, reports))
}

/// The golden bundles and those of the conformance pack.
fn files() -> impl Iterator<Item = (String, Vec<u8>)> {
    let folders = ["golden", "pack/bundles"].map(|folder| Path::new(env!("CARGO_MANIFEST_DIR")).join(folder));
    let mut files: Vec<_> = folders
        .iter()
        .flat_map(|folder| fs::read_dir(folder).expect("a folder of the repository"))
        .map(|entry| entry.expect("readable").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "psb"))
        .collect();
    files.sort();
    assert!(files.len() > 50, "{} bundles", files.len());
    files.into_iter().map(|path| (path.display().to_string(), fs::read(&path).expect("readable")))
}

fn golden(name: &str) -> Vec<u8> {
    fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("golden").join(name)).expect("a committed bundle")
}

/// The preview, and from elsewhere a frame with a row of tiles in the middle and one of a single row.
fn cameras(bundle: &Bundle<'_>) -> [Camera; 3] {
    let preview = bundle.header().preview;
    [preview, preview.orbited(2.0).resized(40, 72), preview.orbited(4.0).resized(50, 16)]
}

fn budget_for(camera: &Camera) -> Budget {
    Budget::for_frame(camera.width_px, camera.height_px).with_max_splats(MaxSplats::Worst)
}

/// Every residency of a bundle.
fn ways(bundle: &Bundle<'_>, camera: &Camera) -> Vec<Budget> {
    let residencies = [Residency::Streamed, Residency::Resident, Residency::AutoWithSums, Residency::Baked];
    let possible = residencies.into_iter().filter(|way| *way != Residency::Baked || bundle.n_gaussians(0).is_some());
    let one_strip = budget_for(camera).with_strips(Strips::Exactly(1));
    possible.map(|residency| one_strip.with_residency(residency)).collect()
}

fn compare<A: Arithmetic>(name: &str, bundle: &Bundle<'_>, camera: &Camera, budget: &Budget) -> [u32; 2] {
    let (expected, of_one) = by_one::<A>(bundle, budget, camera).expect("drawn by one");
    let plan = Plan::new(bundle, &budget.with_two_painters()).expect("memory without limit");
    let (tiles, of_two) = by_two::<A>(bundle, plan, camera, [0, 0]).expect("drawn by two");
    assert!(tiles == expected, "{name}: other pixels, {budget:?}");
    let sums = |reports: &[FrameReport]| {
        let sum = |count: fn(&FrameReport) -> u32| reports.iter().map(count).sum::<u32>();
        let macs: u64 = reports.iter().map(|report| report.head_macs).sum();
        let scene = [sum(|r| r.anchors_read), sum(|r| r.anchors_decoded), sum(|r| r.anchors_visible)];
        let splats = [sum(|r| r.gaussians), sum(|r| r.splats), sum(|r| r.splats_dropped)];
        (macs, scene, splats, [sum(|r| r.tile_splats), sum(|r| r.row_splats), sum(|r| r.pixel_splats)])
    };
    assert_eq!(sums(&of_two), sums(&[of_one]), "{name}: nothing is done twice, {budget:?}");
    of_two.map(|report| report.splats)
}

#[test]
fn two_painters_draw_what_one_draws() {
    let [mut n_frames, mut n_shared] = [0; 2];
    for (name, bytes) in files() {
        let Ok(bundle) = Bundle::parse(&bytes) else { continue };
        for camera in &cameras(&bundle) {
            for budget in ways(&bundle, camera) {
                let drawn = [
                    compare::<ReferenceArithmetic>(&name, &bundle, camera, &budget),
                    compare::<WithoutFpu>(&name, &bundle, camera, &budget),
                ];
                for splats in drawn {
                    n_frames += 1;
                    n_shared += u32::from(splats.iter().all(|n| *n > 0));
                }
            }
        }
    }
    assert!(n_frames > 1000 && n_shared > 500, "{n_shared} of {n_frames} frames had work for both");
}

#[test]
fn heads_in_halves_draw_what_one_draws_with_them() {
    for name in ["static.psb", "context.psb"] {
        let bytes = golden(name);
        let bundle = Bundle::parse(&bytes).expect("a committed bundle is sound");
        for camera in &cameras(&bundle) {
            let free = budget_for(camera).with_residency(Residency::Streamed).with_strips(Strips::Exactly(1));
            let [one, two] = [free, free.with_two_painters()].map(|budget| {
                let whole = Plan::new(&bundle, &budget).expect("memory without limit");
                let halves = budget.in_bytes(whole.scratch_len() - 1);
                let plan = Plan::new(&bundle, &halves).expect("halves do");
                assert_eq!(plan.head_weights(), HeadWeights::F16, "{name}");
                (halves, plan)
            });
            let (expected, _) = by_one::<ReferenceArithmetic>(&bundle, &one.0, camera).expect("drawn by one");
            let (tiles, _) = by_two::<ReferenceArithmetic>(&bundle, two.1, camera, [0, 0]).expect("drawn by two");
            assert!(tiles == expected, "{name}: other pixels");
        }
    }
}

/// Either decoder draws frames by itself as well, of as many splats as it has places for.
#[test]
fn each_painter_draws_by_itself() {
    let bytes = golden("context.psb");
    let bundle = Bundle::parse(&bytes).expect("a committed bundle is sound");
    let [camera, ..] = cameras(&bundle);
    let plan = Plan::new(&bundle, &budget_for(&camera).with_two_painters()).expect("memory without limit");
    let mut scratch = vec![0; plan.scratch_len()];
    let mut painters = Decoder::bind_two::<ReferenceArithmetic>(&bundle, plan, &mut scratch).expect("its own bytes do");
    let (expected, _) = by_one::<ReferenceArithmetic>(&bundle, &budget_for(&camera), &camera).expect("drawn");
    for _ in 0..2 {
        for painter in &mut painters {
            let mut tiles = Tiles::default();
            painter.render(&camera, &mut tiles).expect("drawn");
            assert!(tiles == expected, "other pixels");
        }
        assert!(together(&mut painters, &camera).expect("drawn").0 == expected, "other pixels");
    }
}

/// What two painters report of a frame that may take so many model instructions.
fn with_most_work(bundle: &Bundle<'_>, camera: &Camera, most_work: u64) -> Result<[FrameReport; 2], DecodeError> {
    let budget = budget_for(camera).with_most_work(most_work).with_two_painters();
    let plan = Plan::new(bundle, &budget).expect("memory without limit");
    let mut scratch = vec![0; plan.scratch_len()];
    let mut painters = Decoder::bind_two::<ReferenceArithmetic>(bundle, plan, &mut scratch).expect("its own bytes");
    together(&mut painters, camera).map(|(_, reports)| reports)
}

#[test]
fn an_error_of_either_painter_ends_the_frame() {
    let bytes = golden("context.psb");
    let bundle = Bundle::parse(&bytes).expect("a committed bundle is sound");
    let [camera, ..] = cameras(&bundle);
    let (_, of_one) = by_one::<ReferenceArithmetic>(&bundle, &budget_for(&camera), &camera).expect("drawn");
    let all = of_one.instructions(bundle.model_cost());
    let drawn = |most_work| with_most_work(&bundle, &camera, most_work);
    assert!(drawn(all).is_ok(), "each takes less than one decoder");
    for share in [0, 1, 4, 6] {
        let error = drawn(all * share / 16).expect_err("each takes about half");
        assert!(matches!(error, DecodeError::TooMuchWork { .. }), "{error}");
    }
}

/// The second painter blends the only tile of the frame; the limit of work is checked for the first one too.
#[test]
fn a_painter_without_tiles_keeps_the_limit_of_work_too() {
    let bytes = golden("context.psb");
    let bundle = Bundle::parse(&bytes).expect("a committed bundle is sound");
    let camera = bundle.header().preview.resized(16, 16);
    let drawn = |most_work| with_most_work(&bundle, &camera, most_work);
    let spent = drawn(u64::MAX).expect("drawn").map(|report| report.instructions(bundle.model_cost()));
    let most = spent.into_iter().max().expect("two");
    assert!(drawn(most).is_ok(), "{spent:?}");
    let error = drawn(most - 1).expect_err("one less than either takes");
    assert!(matches!(error, DecodeError::TooMuchWork { .. }), "{error}");
}

#[test]
fn two_decoders_that_are_no_pair_are_refused() {
    let bytes = golden("static.psb");
    let bundle = Bundle::parse(&bytes).expect("a committed bundle is sound");
    let camera = bundle.header().preview;
    let plan = Plan::new(&bundle, &budget_for(&camera)).expect("memory without limit");
    let [mut first, mut second] = [(); 2].map(|()| vec![0; plan.scratch_len()]);
    let mut both = [&mut first, &mut second]
        .map(|scratch| Decoder::bind_in::<ReferenceArithmetic>(&bundle, plan, scratch).expect("its own bytes"));
    let error = together(&mut both, &camera).err();
    assert!(matches!(error, Some(DecodeError::PlanMismatch { .. })), "{error:?}");
}

#[test]
fn the_second_painters_memory_is_a_part_of_the_plan_and_exact() {
    let [mut n_plans, mut n_slow] = [0; 2];
    for (name, bytes) in files() {
        let Ok(bundle) = Bundle::parse(&bytes) else { continue };
        let [camera, ..] = cameras(&bundle);
        for budget in ways(&bundle, &camera) {
            let one = Plan::new(&bundle, &budget).expect("memory without limit");
            let budget = budget.with_two_painters();
            let plan = Plan::new(&bundle, &budget).expect("memory without limit");
            let bytes_of = |plan: &Plan, part| {
                let found = plan.memory().find(|memory| memory.part == part);
                found.expect("every part is told").n_bytes
            };
            assert_eq!(bytes_of(&one, Part::SecondPainter), 0, "{name}: {budget:?}");
            assert!(bytes_of(&plan, Part::SecondPainter) > 0, "{name}: {budget:?}");
            for part in [Part::Heads, Part::Scene] {
                assert_eq!(bytes_of(&plan, part), bytes_of(&one, part), "{name}: what is shared is there once");
            }
            let sum: usize = plan.memory().map(|memory| memory.n_bytes).sum();
            assert!(sum + 3 <= plan.scratch_len(), "{name}: {sum} of {}", plan.scratch_len());
            // As much in the fast memory as all but the second painter takes.
            let fast = plan.scratch_len() - bytes_of(&plan, Part::SecondPainter);
            let split = Plan::new(&bundle, &budget.in_bytes(fast).with_slow_bytes(plan.scratch_len()));
            let (expected, _) =
                by_two::<ReferenceArithmetic>(&bundle, plan, &camera, [0, 0]).expect("its own bytes do");
            for plan in [plan].into_iter().chain(split) {
                let lens = [plan.scratch_len(), plan.slow_scratch_len()];
                for (region, len, fewer) in [(Region::Fast, lens[0], [1, 0]), (Region::Slow, lens[1], [0, 1])] {
                    if len > 0 {
                        let [needed, available] = [len, len - 1].map(|n| n as u32);
                        let error = by_two::<ReferenceArithmetic>(&bundle, plan, &camera, fewer);
                        let expected = DecodeError::ScratchTooSmall { region, needed, available };
                        assert_eq!(error.map(|_| ()), Err(expected), "{name}: {budget:?}");
                    }
                }
                n_slow += u32::from(lens[1] > 0);
                n_plans += 1;
            }
            if let Ok(split) = split {
                let (tiles, _) =
                    by_two::<ReferenceArithmetic>(&bundle, split, &camera, [0, 0]).expect("its own bytes do");
                assert!(
                    tiles == expected || split.head_weights() != plan.head_weights(),
                    "{name}: other pixels, {split:?}"
                );
            }
        }
    }
    assert!(n_plans > 300 && n_slow > 150, "{n_slow} of {n_plans} plans used slow memory");
}

#[test]
fn too_little_memory_is_refused_by_the_number_that_would_do() {
    for name in ["static.psb", "context.psb", "isotropic.psb", "matte.psb"] {
        let bytes = golden(name);
        let bundle = Bundle::parse(&bytes).expect("a committed bundle is sound");
        let [camera, ..] = cameras(&bundle);
        let budget = Budget::for_frame(camera.width_px, camera.height_px);
        let needed = |budget: Budget| match Plan::new(&bundle, &budget.in_bytes(1)) {
            Err(DecodeError::BudgetTooSmall { needed, available: 1, .. }) => needed as usize,
            other => panic!("{name}: {other:?}"),
        };
        let (one, two) = (needed(budget), needed(budget.with_two_painters()));
        assert!(one < two, "{name}: {one} for one, {two} for two");
        let plan = Plan::new(&bundle, &budget.with_two_painters().in_bytes(two)).expect("so many do");
        assert_eq!(plan.scratch_len(), two, "{name}");
        let error = Plan::new(&bundle, &budget.with_two_painters().in_bytes(two - 1)).expect_err("one fewer");
        assert_eq!(error.class(), ErrorClass::OverBudget, "{name}: {error}");
    }
}

#[test]
fn two_are_bound_with_a_plan_of_two_in_one_strip() {
    let bytes = golden("static.psb");
    let bundle = Bundle::parse(&bytes).expect("a committed bundle is sound");
    let [camera, ..] = cameras(&bundle);
    let one = budget_for(&camera).with_strips(Strips::Exactly(8)).with_overflow(Overflow::Slabs);
    let two = one.with_two_painters();
    let plan = |budget: &Budget| Plan::new(&bundle, budget).expect("memory without limit");
    let of_two = plan(&two);
    assert_eq!((of_two.n_strips(), of_two.n_slabs()), (1, 1), "whatever was asked for before");
    let mut scratch = vec![0; 1 << 20];
    for other in
        [one, two.with_strips(Strips::Auto), two.with_strips(Strips::Exactly(2)), two.with_overflow(Overflow::Slabs)]
    {
        let planned = plan(&other);
        let error =
            Decoder::bind_two::<ReferenceArithmetic>(&bundle, planned, &mut scratch).map(|_| ()).expect_err("no");
        let [needed, planned] = [of_two, planned].map(|plan| plan.scratch_len() as u32);
        assert_eq!(error, DecodeError::PlanMismatch { needed, planned }, "{other:?}");
    }
    assert!(Decoder::bind(&bundle, of_two, &mut scratch).is_ok(), "the first painter alone");
}

#[test]
fn damage_is_left_out_as_one_leaves_it_out() {
    let mut n_damaged = 0;
    for name in ["static.psb", "context.psb", "matte.psb"] {
        let sound = golden(name);
        let chunks = Bundle::parse(&sound).expect("a committed bundle is sound");
        let section = chunks.sections().last().expect("chunks come last").offset as usize;
        for chunk in 0..chunks.n_chunks() {
            let mut bytes = sound.clone();
            bytes[section + chunks.chunk(chunk).expect("in the file").offset() as usize + 8] ^= 0x55;
            let bundle = Bundle::parse(&bytes).expect("chunks are not looked at");
            let [camera, ..] = cameras(&bundle);
            for budget in ways(&bundle, &camera) {
                let two = budget.with_two_painters();
                let plan = Plan::new(&bundle, &two).expect("memory without limit");
                let error = by_two::<ReferenceArithmetic>(&bundle, plan, &camera, [0, 0]).map(|_| ());
                assert!(matches!(error, Err(DecodeError::ChunkChecksum { .. })), "{name}: {error:?}");
                let (expected, of_one) =
                    by_one::<ReferenceArithmetic>(&bundle, &budget.skipping_damage(), &camera).expect("left out");
                let plan = Plan::new(&bundle, &two.skipping_damage()).expect("memory without limit");
                let (tiles, of_two) = by_two::<ReferenceArithmetic>(&bundle, plan, &camera, [0, 0]).expect("left out");
                assert!(tiles == expected, "{name}, chunk {chunk}: other pixels, {budget:?}");
                let sum: u32 = of_two.iter().map(|report| report.chunks_damaged).sum();
                assert_eq!(sum, of_one.chunks_damaged, "{name}, chunk {chunk}: {of_two:?}");
                let first = of_two.iter().filter_map(|report| report.first_damaged).min();
                assert_eq!(first, of_one.first_damaged, "{name}, chunk {chunk}: {of_two:?}");
                n_damaged += sum;
            }
        }
    }
    assert!(n_damaged > 50, "{n_damaged} frames lacked a chunk");
}

#[test]
fn each_painter_leaves_out_what_it_has_no_place_for() {
    let bytes = golden("static.psb");
    let bundle = Bundle::parse(&bytes).expect("a committed bundle is sound");
    let [camera, ..] = cameras(&bundle);
    let budget = budget_for(&camera).with_residency(Residency::Resident);
    let free = Plan::new(&bundle, &budget.with_two_painters()).expect("memory without limit");
    let (_, all) = by_two::<ReferenceArithmetic>(&bundle, free, &camera, [0, 0]).expect("drawn");
    let n_places = all[0].splats - 75;
    let places = MaxSplats::AtMost(n_places);
    let few = Plan::new(&bundle, &budget.with_max_splats(places).with_two_painters()).expect("memory without limit");
    let (_, reports) = by_two::<ReferenceArithmetic>(&bundle, few, &camera, [0, 0]).expect("drawn");
    for (report, all) in reports.into_iter().zip(all) {
        let dropped = all.splats.saturating_sub(n_places);
        assert!(dropped > 0, "as many splats for each, more or less");
        assert_eq!((report.splats, report.splats_dropped), (n_places, dropped), "{report:?}");
        assert_eq!(report.max_splats, all.splats, "the number to plan for");
    }
}

/// Those of the measured views have places, whole chunks or halves; and all where nothing was measured.
#[test]
fn measured_views_have_places() {
    for (name, bytes) in files() {
        let Ok(bundle) = Bundle::parse(&bytes) else { continue };
        let [camera, ..] = cameras(&bundle);
        for residency in [Residency::Auto, Residency::Resident, Residency::Streamed] {
            let budget = Budget::for_frame(camera.width_px, camera.height_px).with_residency(residency);
            let [one, two] = [budget, budget.with_two_painters()]
                .map(|budget| Plan::new(&bundle, &budget).expect("memory without limit"));
            assert!(two.max_splats() <= one.max_splats(), "{name}: each needs fewer places");
            for angle in 0..8 {
                let camera = camera.orbited(angle as f32 * 0.785);
                let (_, of_one) = by_one::<ReferenceArithmetic>(&bundle, &budget, &camera).expect("drawn by one");
                let (_, reports) = by_two::<ReferenceArithmetic>(&bundle, two, &camera, [0, 0]).expect("drawn");
                let n_dropped: u32 = reports.iter().map(|report| report.splats_dropped).sum();
                // Of a view that was not measured, one may leave out some.
                assert!(n_dropped <= of_one.splats_dropped, "{name}, {residency:?}: {reports:?}, {of_one:?}");
            }
        }
    }
}
