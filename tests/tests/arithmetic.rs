//! Frames of other arithmetics: near those of the reference arithmetic, in no more memory, and the same where nothing is rounded.

use conformance::bundles::{CODERS, tiered};
use conformance::frame::{Frame, budget_for, draw, draw_in, info_for, to_core};
use conformance::scenes::{CASES, cameras, random_scene};
use pocketsplat_codec::bundle::{self, WriteOptions};
use pocketsplat_codec::verify::{Trial, halves};
use pocketsplat_core::{Bundle, Camera, Decoder, HeadWeights, Plan, WithoutFpu};
use pocketsplat_trainer::cost::ArithmeticChoice;

/// Root of the mean square difference that a frame of halves may have to the reference arithmetic's, 255ths.
const MOST_OF_HALVES: f64 = 0.5;
/// That of a frame without an FPU.
const MOST_WITHOUT_FPU: f64 = 1.0;

/// Root of the mean square difference of two frames, 255ths.
fn error(rgb: &[u8], exact: &[u8]) -> f64 {
    let squares = rgb.iter().zip(exact).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
    (squares.sum::<f64>() / rgb.len() as f64).sqrt()
}

fn camera() -> Camera {
    to_core(&cameras()[0].1)
}

/// The plan of the usual budget with heads in halves, if they save memory.
fn plan_of_halves(bundle: &Bundle<'_>) -> Option<Plan> {
    halves(bundle, &budget_for(&camera()))
}

fn drawn(bundle: &Bundle<'_>, plan: Plan) -> Trial {
    Trial::run(bundle, plan, &camera(), 0, 0).unwrap_or_else(|breach| panic!("{breach}: {plan:?}"))
}

#[test]
fn every_arithmetic_stays_near_and_draws_every_pixel_once() {
    for (i, case) in CASES.iter().enumerate() {
        let bytes = tiered(case, CODERS[i % 2], 64);
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let (exact, _) = draw(&bundle, &camera()).expect("the worst case is planned for");
        let (frame, report) =
            draw_in(ArithmeticChoice::WithoutFpu, &bundle, &camera()).expect("no more memory than planned");
        assert!(frame.deliveries.iter().all(|&n| n == 1), "{}: every pixel once", case.name);
        if report.splats_dropped > 0 {
            // Other numbers may open an offset more than the exact ones that a scene's Gaussians are counted with.
            assert!(bundle.n_gaussians(0).is_some() && report.splats_dropped <= 3, "{}: {report:?}", case.name);
        } else {
            let error = error(&frame.rgb, &exact.rgb);
            assert!(error <= MOST_WITHOUT_FPU, "{}, without an FPU: {error}", case.name);
        }
        let Some(plan) = plan_of_halves(&bundle) else { continue };
        let error = error(&drawn(&bundle, plan).rgb, &exact.rgb);
        assert!(error <= MOST_OF_HALVES, "{}, in halves: {error}", case.name);
    }
}

#[test]
fn halves_kept_as_halves_change_nothing() {
    let mut n_compared = 0;
    for case in CASES {
        let options = WriteOptions { head_fraction_bits: None, ..WriteOptions::default() };
        let written = bundle::write(&random_scene(&case), &info_for(&cameras()[0].1), &options);
        let bytes = written.expect("a test scene can be written").bytes;
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        assert!(bundle.heads().coded().is_none(), "{}: a bundle whose heads are halves", case.name);
        let Some(plan) = plan_of_halves(&bundle) else { continue };
        let (exact, _) = draw(&bundle, &camera()).expect("the worst case is planned for");
        assert!(drawn(&bundle, plan).rgb == exact.rgb, "{}: other bytes", case.name);
        n_compared += 1;
    }
    assert!(n_compared >= 9, "{n_compared} of {} cases in halves", CASES.len());
}

#[test]
fn a_budget_without_room_for_f32_takes_halves_before_it_prunes() {
    let mut n_in_halves = 0;
    for (i, case) in CASES.iter().enumerate() {
        let bytes = tiered(case, CODERS[i % 2], 64);
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let camera = camera();
        let budget = budget_for(&camera);
        let whole = Plan::new(&bundle, &budget).expect("memory without limit");
        assert_eq!((whole.head_weights(), whole.pruning_rate()), (HeadWeights::F32, 0.0), "{}", case.name);
        let plan = Plan::new(&bundle, &budget.in_bytes(whole.scratch_len() - 1)).expect("a part takes less");
        // Where other memory decides, halves save none.
        if plan.head_weights() == HeadWeights::F32 {
            continue;
        }
        n_in_halves += 1;
        assert_eq!(plan.pruning_rate(), 0.0, "{}", case.name);
        // Frames of halves, and of the other arithmetic in the memory of halves.
        drawn(&bundle, plan);
        let mut scratch = vec![0; plan.scratch_len()];
        let mut frame = Frame::new(camera.width_px, camera.height_px);
        let mut decoder = Decoder::bind_in::<WithoutFpu>(&bundle, plan, &mut scratch).expect("integers take no more");
        decoder.render(&camera, &mut frame).expect("a sound bundle");
    }
    assert!(n_in_halves >= 9, "{n_in_halves} of {} cases in halves", CASES.len());
}
