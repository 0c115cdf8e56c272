//! The planned bytes suffice; one byte less fails and says how many are needed. Splats beyond the planned ones are left
//! out and counted.

use conformance::frame::{Frame, budget_for, bundle_of, draw, to_core};
use conformance::scenes::{CASES, cameras, random_scene};
use pocketsplat_core::{Bundle, Camera, DecodeError, Decoder, ErrorClass, MaxSplats};

fn camera() -> Camera {
    to_core(&cameras()[0].1)
}

#[test]
fn the_planned_bytes_suffice_and_one_less_is_refused_by_number() {
    for case in CASES {
        let bytes = bundle_of(&random_scene(&case), &cameras()[0].1);
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let camera = camera();
        let plan = bundle.plan(&budget_for(&camera)).expect("planned");
        let needed = plan.scratch_len();
        let mut scratch = vec![0; needed];
        assert!(Decoder::bind(&bundle, plan, &mut scratch).is_ok(), "{}: {needed} bytes suffice", case.name);
        for available in [needed - 1, needed / 2, 0] {
            let error = Decoder::bind(&bundle, plan, &mut scratch[..available]).err();
            let expected = DecodeError::ScratchTooSmall { needed: needed as u32, available: available as u32 };
            assert_eq!(error, Some(expected), "{}: {available} bytes are refused", case.name);
        }
    }
}

#[test]
fn the_planned_splats_suffice_and_of_one_more_the_last_is_left_out_and_reported() {
    let bytes = bundle_of(&random_scene(&CASES[0]), &cameras()[0].1);
    let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
    let camera = camera();
    let (expected, report) = draw(&bundle, &camera).expect("drawn");
    let with = |max_splats: u32| {
        let budget = budget_for(&camera).with_max_splats(MaxSplats::AtMost(max_splats));
        let plan = bundle.plan(&budget).expect("planned");
        let mut scratch = vec![0; plan.scratch_len()];
        let mut frame = Frame::new(camera.width_px, camera.height_px);
        let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("bound");
        (decoder.render(&camera, &mut frame).expect("drawn"), frame, plan.scratch_len())
    };
    let (enough, frame, enough_bytes) = with(report.splats);
    assert_eq!(enough, report, "as many splats as the view has");
    assert!(frame == expected, "the same picture as with memory for the worst case");

    let (fewer, _, fewer_bytes) = with(report.splats - 1);
    let counts = (fewer.splats, fewer.splats_dropped, fewer.max_splats);
    assert_eq!(counts, (report.splats - 1, 1, report.splats), "one splat less");
    assert!(fewer_bytes < enough_bytes, "fewer splats take less memory: {fewer_bytes} and {enough_bytes} bytes");
}

#[test]
fn a_larger_frame_than_planned_is_refused() {
    let bytes = bundle_of(&random_scene(&CASES[1]), &cameras()[0].1);
    let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
    let camera = camera();
    let plan = bundle.plan(&budget_for(&camera)).expect("planned");
    let mut scratch = vec![0; plan.scratch_len()];
    let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("bound");
    for larger in
        [Camera { width_px: camera.width_px + 1, ..camera }, Camera { height_px: camera.height_px + 1, ..camera }]
    {
        let error = decoder.render(&larger, &mut Frame::new(larger.width_px, larger.height_px)).err();
        assert_eq!(error.map(|e| e.class()), Some(ErrorClass::Misuse), "{} x {}", larger.width_px, larger.height_px);
    }
}

#[test]
fn a_plan_is_refused_by_another_bundle() {
    let [one, other] = [0, 1].map(|case| bundle_of(&random_scene(&CASES[case]), &cameras()[0].1));
    let [one, other] = [&one, &other].map(|bytes| Bundle::parse(bytes).expect("the writer's bundle is sound"));
    let plan = one.plan(&budget_for(&camera())).expect("planned");
    let mut scratch = vec![0; plan.scratch_len()];
    let error = Decoder::bind(&other, plan, &mut scratch).err();
    assert_eq!(error.map(|e| e.class()), Some(ErrorClass::Misuse), "a plan belongs to its bundle");
}

#[test]
fn an_unusable_camera_is_refused() {
    let bytes = bundle_of(&random_scene(&CASES[1]), &cameras()[0].1);
    let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
    let good = camera();
    let bad = [
        Camera { focal_px: [0.0, 100.0], ..good },
        Camera { focal_px: [100.0, f32::NAN], ..good },
        Camera { translation: [f32::INFINITY, 0.0, 0.0], ..good },
        Camera { rotation: [f32::NAN; 9], ..good },
        Camera { principal_px: [f32::NEG_INFINITY, 0.0], ..good },
    ];
    for camera in bad {
        let error = draw(&bundle, &camera).err();
        assert_eq!(error.map(|e| e.class()), Some(ErrorClass::Misuse), "{camera:?}");
    }
}
