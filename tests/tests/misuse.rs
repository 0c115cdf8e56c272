//! A frame, a bundle or a camera that a decoder was not planned for, or cannot draw with, is refused as misuse.

use conformance::frame::{Frame, budget_for, bundle_of, draw, to_core};
use conformance::scenes::{CASES, cameras, random_scene};
use pocketsplat_core::{Bundle, Camera, DecodeError, Decoder, ErrorClass, Plan, Rotation};

fn camera() -> Camera {
    to_core(&cameras()[0].1)
}

#[test]
fn a_larger_frame_than_planned_is_refused() {
    let bytes = bundle_of(&random_scene(&CASES[1]), &cameras()[0].1);
    let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
    let camera = camera();
    let plan = Plan::new(&bundle, &budget_for(&camera)).expect("planned");
    let mut scratch = vec![0; plan.scratch_len()];
    let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("bound");
    for larger in
        [Camera { width_px: camera.width_px + 1, ..camera }, Camera { height_px: camera.height_px + 1, ..camera }]
    {
        let error = decoder
            .render(&larger, &mut Frame::new(larger.width_px, larger.height_px))
            .map_err(DecodeError::from)
            .err();
        assert_eq!(error.map(|e| e.class()), Some(ErrorClass::Misuse), "{} x {}", larger.width_px, larger.height_px);
    }
}

#[test]
fn a_plan_is_refused_by_another_bundle() {
    let [one, other] = [0, 1].map(|case| bundle_of(&random_scene(&CASES[case]), &cameras()[0].1));
    let [one, other] = [&one, &other].map(|bytes| Bundle::parse(bytes).expect("the writer's bundle is sound"));
    let plan = Plan::new(&one, &budget_for(&camera())).expect("planned");
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
        Camera { rotation: Rotation::new_unchecked([f32::NAN; 9]), ..good },
        Camera { principal_px: [f32::NEG_INFINITY, 0.0], ..good },
    ];
    for camera in bad {
        let error = draw(&bundle, &camera).err();
        assert_eq!(error.map(|e| e.class()), Some(ErrorClass::Misuse), "{camera:?}");
    }
}
