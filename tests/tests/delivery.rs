//! A sink gets every pixel exactly once, and the same ones whatever the scratch memory held and wherever it lay.

use std::convert::Infallible;

use conformance::frame::{Frame, budget_for, bundle_of, draw, to_core};
use conformance::scenes::{CASES, cameras, random_scene};
use pocketsplat_core::{Bundle, Decoder, Plan, Tile, TileSink};

/// Where tiles began, in the order in which they came.
#[derive(Default)]
struct Corners(Vec<[u16; 2]>);

impl TileSink for Corners {
    type Error = Infallible;

    fn tile(&mut self, Tile { x_px, y_px, .. }: Tile<'_>) -> Result<(), Infallible> {
        self.0.push([y_px, x_px]);
        Ok(())
    }
}

#[test]
fn every_pixel_arrives_once() {
    let cameras = cameras();
    let bytes = bundle_of(&random_scene(&CASES[1]), &cameras[0].1);
    let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
    for (view, camera) in &cameras {
        let (frame, _) = draw(&bundle, &to_core(camera)).expect("drawn");
        let wrong = frame.deliveries.iter().position(|&n| n != 1);
        assert_eq!(wrong, None, "{view}: index of the first pixel that did not arrive exactly once");
    }
}

#[test]
fn tiles_come_row_by_row_from_the_top_left() {
    let camera = to_core(&cameras()[2].1);
    let bytes = bundle_of(&random_scene(&CASES[1]), &cameras()[2].1);
    let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
    let plan = Plan::new(&bundle, &budget_for(&camera)).expect("planned");
    let mut scratch = vec![0; plan.scratch_len()];
    let mut corners = Corners::default();
    Decoder::bind(&bundle, plan, &mut scratch).expect("bound").render(&camera, &mut corners).expect("drawn");
    assert!(corners.0.is_sorted(), "tiles arrived as {:?}", corners.0);
}

#[test]
fn scratch_content_and_alignment_do_not_show() {
    let cameras = cameras();
    let bytes = bundle_of(&random_scene(&CASES[0]), &cameras[0].1);
    let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
    let camera = to_core(&cameras[0].1);
    let (expected, expected_report) = draw(&bundle, &camera).expect("drawn");
    let plan = Plan::new(&bundle, &budget_for(&camera)).expect("planned");
    for start in 0..8 {
        for fill in [0x00, 0x5a, 0xff] {
            let mut memory = vec![fill; start + plan.scratch_len()];
            let mut decoder = Decoder::bind(&bundle, plan, &mut memory[start..]).expect("bound");
            let mut frame = Frame::new(camera.width_px, camera.height_px);
            let report = decoder.render(&camera, &mut frame).expect("drawn");
            assert!(frame == expected, "another picture from scratch at offset {start} filled with {fill:#04x}");
            assert_eq!(report, expected_report, "scratch at offset {start} filled with {fill:#04x}");
        }
    }
}

#[test]
fn a_frame_does_not_depend_on_the_frames_before() {
    let cameras = cameras();
    let bytes = bundle_of(&random_scene(&CASES[0]), &cameras[0].1);
    let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
    let mut budget = budget_for(&to_core(&cameras[0].1));
    (budget.width_px, budget.height_px) = (256, 256);
    let plan = Plan::new(&bundle, &budget).expect("planned");
    let mut scratch = vec![0; plan.scratch_len()];
    let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("bound");
    for (view, camera) in cameras.iter().chain(cameras.iter().rev()) {
        let camera = to_core(camera);
        let (expected, _) = draw(&bundle, &camera).expect("drawn");
        let mut frame = Frame::new(camera.width_px, camera.height_px);
        decoder.render(&camera, &mut frame).expect("drawn");
        assert!(frame == expected, "{view} differs when other views were drawn before");
    }
}
