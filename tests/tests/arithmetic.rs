//! Frames of every arithmetic: near those of the reference arithmetic, in no more memory, and the same where nothing is rounded.

use conformance::bundles::{CODERS, tiered};
use conformance::frame::{Frame, budget_for, draw, draw_in, info_for, to_core};
use conformance::scenes::{CASES, cameras, random_scene};
use pocketsplat_codec::bundle::{self, WriteOptions};
use pocketsplat_core::arithmetic::WithoutFpu;
use pocketsplat_core::{Bundle, Decoder, HeadWeights};
use pocketsplat_trainer::cost::ArithmeticChoice;

/// Root of the mean square difference that each may have to the reference arithmetic's frame, 255ths.
fn bound(choice: ArithmeticChoice) -> f64 {
    match choice {
        ArithmeticChoice::Reference | ArithmeticChoice::F16 | ArithmeticChoice::Wide => 0.5,
        ArithmeticChoice::I16 | ArithmeticChoice::Table | ArithmeticChoice::WithoutFpu => 1.0,
    }
}

#[test]
fn every_arithmetic_stays_near_and_draws_every_pixel_once() {
    for (i, case) in CASES.iter().enumerate() {
        let bytes = tiered(case, CODERS[i % 2], 64);
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let camera = to_core(&cameras()[0].1);
        let (exact, _) = draw(&bundle, &camera).expect("the worst case is planned for");
        for &choice in ArithmeticChoice::TURNED {
            // Wider splats have fewer places than the worst case takes, and other numbers may open an offset more than the
            // exact ones that a scene's Gaussians are counted with.
            let (frame, report) = draw_in(choice, &bundle, &camera).expect("no more memory than planned");
            assert!(frame.deliveries.iter().all(|&n| n == 1), "{}, {choice:?}: every pixel once", case.name);
            if report.splats_dropped > 0 {
                let counted = bundle.n_gaussians(0).is_some() && report.splats_dropped <= 3;
                assert!(choice == ArithmeticChoice::Wide || counted, "{}, {choice:?}: {report:?}", case.name);
                continue;
            }
            let squares = frame.rgb.iter().zip(&exact.rgb).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
            let error = (squares.sum::<f64>() / frame.rgb.len() as f64).sqrt();
            assert!(error <= bound(choice), "{}, {choice:?}: {error} of {}", case.name, bound(choice));
        }
    }
}

#[test]
fn halves_kept_as_halves_change_nothing() {
    for case in CASES {
        let options = WriteOptions { head_fraction_bits: None, ..WriteOptions::default() };
        let written = bundle::write(&random_scene(&case), &info_for(&cameras()[0].1), &options);
        let bytes = written.expect("a test scene can be written").bytes;
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        assert!(bundle.heads().coded().is_none(), "{}: a bundle whose heads are halves", case.name);
        let camera = to_core(&cameras()[0].1);
        let [exact, halves] = [ArithmeticChoice::Reference, ArithmeticChoice::F16]
            .map(|choice| draw_in(choice, &bundle, &camera).expect("the worst case is planned for"));
        assert!(exact == halves, "{}: other bytes", case.name);
    }
}

#[test]
fn a_budget_without_room_for_f32_takes_halves_before_it_prunes() {
    let mut n_in_halves = 0;
    for (i, case) in CASES.iter().enumerate() {
        let bytes = tiered(case, CODERS[i % 2], 64);
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let camera = to_core(&cameras()[0].1);
        let budget = budget_for(&camera);
        let whole = bundle.plan(&budget).expect("memory without limit");
        assert_eq!((whole.head_weights(), whole.pruning_rate()), (HeadWeights::F32, 0.0), "{}", case.name);
        let plan = bundle.plan(&budget.in_bytes(whole.scratch_len() - 1)).expect("a part takes less");
        // Where other memory decides, halves save none.
        if plan.head_weights() == HeadWeights::F32 {
            continue;
        }
        n_in_halves += 1;
        assert_eq!(plan.pruning_rate(), 0.0, "{}", case.name);
        // The frames of halves whatever the memory, and of every other arithmetic in the memory of halves.
        let mut scratch = vec![0; plan.scratch_len()];
        let mut planned = Frame::new(camera.width_px, camera.height_px);
        let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("the planned bytes");
        let report = decoder.render(&camera, &mut planned).expect("a sound bundle");
        let (forced, forced_report) = draw_in(ArithmeticChoice::F16, &bundle, &camera).expect("a sound bundle");
        if report.splats_dropped == 0 && forced_report.splats_dropped == 0 {
            assert!(planned == forced, "{}: another frame", case.name);
        }
        let mut frame = Frame::new(camera.width_px, camera.height_px);
        let mut decoder = Decoder::bind_in::<WithoutFpu>(&bundle, plan, &mut scratch).expect("integers take no more");
        decoder.render(&camera, &mut frame).expect("a sound bundle");
    }
    assert!(n_in_halves >= 9, "{n_in_halves} of {} cases in halves", CASES.len());
}
