use pocketsplat_capture::dataset::Capture;
use pocketsplat_format::Bundle;
use pocketsplat_instructions::Processor;

use super::sizes::{DevicePlans, frame_of};
use super::{CoderChoice, EncodeError, Encoding, Fitted};
use crate::device::Limits;
use crate::train::config::Backbone;
use crate::train::limits::Finished;
use crate::train::modules::{Modules, Rdo};
use crate::train::test_capture::{tiny_capture, tiny_hac_config};
use crate::train::{TrainConfig, Trainer};
use pocketsplat_codec::bundle::WriteError;
use pocketsplat_kernels::scene::QuantisationSteps;

fn finished(capture: &Capture) -> Finished {
    let mut trainer = Trainer::new(capture, tiny_hac_config(80)).expect("a sound capture");
    while !trainer.is_done() {
        trainer.advance().expect("a sound step");
    }
    trainer.finish().expect("the context has an integer form")
}

/// The step of the first feature, where tables code it.
fn feature_step(fitted: &Fitted) -> Option<f32> {
    let bundle = Bundle::parse(&fitted.written.bytes).expect("a sound bundle");
    bundle.tables().and_then(|tables| tables.of_channels().next().map(|table| table.step))
}

#[test]
fn a_device_gets_the_finest_tables_that_its_flash_holds() {
    let capture = tiny_capture();
    let finished = finished(&capture);
    let encode = |coder, limits| {
        let encoding = Encoding { coder, limits, ..Encoding::default() };
        encoding.encode(finished.clone(), &capture, &[]).expect("a bundle")
    };
    assert_eq!(feature_step(&encode(CoderChoice::Context, Limits::default())), None);
    let coarse = encode(CoderChoice::Static, Limits::default());
    let device = Limits { processor: Some(Processor::CortexM4), ..Limits::default() };
    let fine = encode(CoderChoice::Auto, device);
    let steps = [&fine, &coarse].map(|fitted| feature_step(fitted).expect("tables"));
    assert!((steps[0] - 0.5 * steps[1]).abs() < 1e-6 * steps[1], "half of the mean steps: {steps:?}");
    let flash_bytes = Some(fine.written.bytes.len() as u64 - 1);
    let tight = encode(CoderChoice::Auto, Limits { flash_bytes, ..device });
    assert!(feature_step(&tight) > Some(steps[0]), "the next coarser steps");
    assert_eq!(tight.cut, None, "before anchors are left out");
}

#[test]
fn anchors_are_left_out_until_the_bundle_fits() {
    let capture = tiny_capture();
    let finished = finished(&capture);
    let encode = |flash_bytes| {
        let encoding = Encoding { limits: Limits { flash_bytes, ..Limits::default() }, ..Encoding::default() };
        encoding.encode(finished.clone(), &capture, &[])
    };
    let whole = encode(None).expect("a bundle");
    assert_eq!(whole.cut, None);
    let flash_bytes = whole.written.bytes.len() as u64 * 7 / 10;
    let cut = encode(Some(flash_bytes)).expect("a smaller bundle");
    let len = cut.written.bytes.len() as u64;
    assert!(len <= flash_bytes && len * 100 >= flash_bytes * 95, "{len} of {flash_bytes} bytes");
    let lost = cut.cut.expect("something was left out");
    // Coded as coarsely as the limit asks for.
    assert!((flash_bytes + 1..=whole.written.bytes.len() as u64).contains(&lost.flash_bytes), "{lost:?}");
    assert!(lost.n_anchors > 0, "{lost:?}");
    let error = encode(Some(100)).expect_err("less than a header");
    assert!(matches!(error, EncodeError::TooLarge { limit: "bytes of flash", available: 100, .. }), "{error}");
}

#[test]
fn anchors_are_left_out_until_a_frame_takes_no_more_than_the_processor_has() {
    let capture = tiny_capture();
    let finished = finished(&capture);
    let encode = |size_px, processor| {
        let mut capture = capture.clone();
        capture.train.iter_mut().for_each(|view| view.camera = view.camera.resized(size_px, size_px));
        let encoding = Encoding { limits: Limits { processor, ..Limits::default() }, ..Encoding::default() };
        encoding.encode(finished.clone(), &capture, &[]).expect("a bundle")
    };
    let (m4, m7) = (Processor::CortexM4, Processor::CortexM7);
    let most = m4.frame_instructions();
    // A Cortex-M7 has the same instructions and more of them, so it says what the whole scene takes.
    let whole_at = |size_px| encode(size_px, Some(m7)).instructions.expect("a processor");
    let sizes_px = (100..800).step_by(20).map(|size_px| (size_px, whole_at(size_px)));
    let (size_px, whole) = sizes_px.into_iter().find(|(_, whole)| *whole > most).expect("large frames take long");
    let cut = encode(size_px, Some(m4));
    let lost = cut.cut.expect("something was left out");
    assert_eq!(lost.instructions, Some(whole));
    assert!(lost.n_anchors > 0 && cut.instructions <= Some(most), "{:?} of {most} instructions", cut.instructions);
    let hopeless = encode(4 * size_px, Some(m4));
    assert_eq!(hopeless.cut, None, "no half of the scene would do");
    assert!(hopeless.instructions > Some(most), "{:?}", hopeless.instructions);
}

/// A run on the capture that is trained for the limits of its bundle.
fn trained_for(limits: Limits, capture: &Capture) -> Fitted {
    let encoding = Encoding { limits, tiers: vec![0.3, 0.0], ..Encoding::default() };
    let modules = Modules { rdo: Some(Rdo::default()), ..Modules::default() };
    let mut config = TrainConfig { modules, ..tiny_hac_config(150) };
    config.densification.until = 0.45;
    let sizes = encoding.sizes(capture).expect("limits");
    let measure = sizes.measure();
    let mut trainer = Trainer::new(capture, config).expect("a sound capture").fitting(Some(sizes.probe(&measure)));
    while !trainer.is_done() {
        trainer.advance().expect("a sound step");
    }
    encoding.encode(trainer.finish().expect("a scene"), capture, &[]).expect("a bundle")
}

#[test]
fn a_run_ends_within_its_limits_and_fills_them() {
    let capture = tiny_capture();
    let free = trained_for(Limits { ram_bytes: Some(1 << 30), ..Limits::default() }, &capture);
    assert_eq!(free.cut, None, "a gigabyte is enough");
    let len = free.written.bytes.len() as u64;
    let bundle = Bundle::parse(&free.written.bytes).expect("a sound bundle");
    let plans = DevicePlans::of(&bundle, frame_of(&capture), None).expect("a plan");
    let scratch_len = plans.in_two_strips.scratch_len() as u64;
    for share in [0.75, 0.9] {
        let part = |whole: u64| Some((whole as f64 * share) as u64);
        let limits = Limits { flash_bytes: part(len), ..Limits::default() };
        let used = trained_for(limits, &capture).written.bytes.len() as u64;
        // So few iterations are too few for values to follow a new weight of their bits.
        assert!(Some(used) <= limits.flash_bytes && Some(used) > part(len * 6 / 10), "{used} bytes of {limits:?}");
        let limits = Limits { ram_bytes: part(scratch_len), ..Limits::default() };
        let fitted = trained_for(limits, &capture);
        let bundle = Bundle::parse(&fitted.written.bytes).expect("a sound bundle");
        let plan = fitted.plan.expect("the whole scene is drawn");
        assert_eq!(plan.n_tiers(), bundle.n_tiers());
        let used = plan.scratch_len() as u64;
        assert!(
            Some(used) <= limits.ram_bytes && Some(used) > part(scratch_len * 17 / 20),
            "{used} bytes of {limits:?}"
        );
    }
}

#[test]
fn every_tier_of_the_file_is_measured() {
    let capture = tiny_capture();
    let fitted = Encoding::default().encode(finished(&capture), &capture, &capture.train[..1]).expect("a bundle");
    let bundle = Bundle::parse(&fitted.written.bytes).expect("a sound bundle");
    for tier in 0..bundle.n_tiers() {
        let measures = bundle.measures(tier).expect("measured");
        assert!(measures.psnr_db.is_some_and(|psnr_db| psnr_db > 10.0), "tier {tier}: {measures:?}");
        assert!(measures.max_splats > 0, "tier {tier}: {measures:?}");
    }
}

#[test]
fn what_the_writer_would_refuse_is_refused_before_training() {
    let sound = Encoding::default();
    assert_eq!(sound.check(Backbone::Scaffold), Ok(()));
    let steps = Encoding { quantisation: QuantisationSteps { offset: 0.0, ..Default::default() }, ..sound.clone() };
    assert!(matches!(steps.check(Backbone::Hac), Err(WriteError::NotPositive { what: "offset step", .. })));
    let tiers = Encoding { tiers: vec![0.4, 0.4, 0.0], ..sound.clone() };
    assert!(matches!(tiers.check(Backbone::Hac), Err(WriteError::Tiers { .. })));
    let context = Encoding { coder: CoderChoice::Context, ..sound };
    assert_eq!(context.check(Backbone::Scaffold), Err(WriteError::NoContext));
    assert_eq!(context.check(Backbone::Hac), Ok(()));
}
