use super::*;
use crate::train::test_capture::{tiny_capture, tiny_config};
use crate::train::{DroppedStep, TrainError, Trainer};

/// Parameters, moments and statistics of a run.
fn learned(trainer: &Trainer<'_>) -> String {
    format!(
        "{:?} {:?} {:?}",
        trainer.state.learned.scene, trainer.state.learned.optimiser, trainer.state.learned.statistics
    )
}

/// Breaks one parameter for one step of a run in full swing.
fn with_broken(break_one: fn(&mut Scene<f32>, f32), value: f32) -> DroppedStep {
    let capture = tiny_capture();
    let mut trainer = Trainer::new(&capture, tiny_config(40)).unwrap();
    for _ in 0..12 {
        assert_eq!(trainer.advance().unwrap().dropped, None);
    }
    let sound = trainer.state.learned.scene.clone();
    break_one(&mut trainer.state.learned.scene, value);
    let before = learned(&trainer);
    let dropped = trainer.advance().unwrap().dropped.expect("the step must be dropped");
    assert_eq!(learned(&trainer), before, "a dropped step changes nothing");
    assert_eq!((trainer.state.iteration, trainer.n_dropped()), (13, 1));
    trainer.state.learned.scene = sound;
    while !trainer.is_done() {
        assert_eq!(trainer.advance().unwrap().dropped, None);
    }
    let mut all =
        groups(&trainer.state.learned.scene.heads).flatten().chain(&trainer.state.learned.scene.anchors.features);
    assert!(all.all(|v| v.is_finite()));
    dropped
}

#[test]
fn a_step_from_a_broken_parameter_is_dropped_and_says_which() {
    let dropped = with_broken(|scene, v| scene.heads.colour.b2[0] = v, f32::NAN);
    assert_eq!(dropped.cause.array, "a weight of the heads");
    let dropped = with_broken(|scene, v| scene.heads.covariance.w1.fill(v), f32::NAN);
    assert_eq!(dropped.cause.array, "a weight of the heads");
    let dropped = with_broken(|scene, v| scene.anchors.features.fill(v), f32::NAN);
    assert_eq!((dropped.cause.array, dropped.cause.anchor), ("a feature", Some(0)));
    assert!(dropped.to_string().starts_with("iteration 13 dropped: with view `view_"), "{dropped}");
    assert!(dropped.to_string().ends_with("`, a feature of anchor 0 became NaN"), "{dropped}");
}

#[test]
fn a_value_that_grows_beyond_all_bounds_is_found_where_it_first_shows() {
    // Parameter and sizes are finite; their product is not.
    let dropped = with_broken(|scene, v| scene.anchors.log_scales[3..6].fill(v), 200.0);
    assert_eq!(dropped.cause.array, "the volume of a Gaussian");
    assert_eq!(dropped.cause.anchor, Some(0));
}

#[test]
fn a_background_that_is_no_colour_ends_the_run_with_the_scene_it_had() {
    let mut capture = tiny_capture();
    capture.background = [f32::NAN; 3];
    let mut trainer = Trainer::new(&capture, tiny_config(1000)).unwrap();
    let before = learned(&trainer);
    for i in 1..=MAX_DROPPED_IN_A_ROW {
        assert_eq!(trainer.advance().unwrap().dropped.unwrap().cause.array, "the background", "{i}");
    }
    let error = trainer.advance().unwrap_err();
    assert!(matches!(error, TrainError::Diverged { n: 101, .. }), "{error}");
    assert!(error.to_string().contains("101 steps in a row"), "{error}");
    assert_eq!(learned(&trainer), before);
}

#[test]
fn every_gradient_is_looked_at() {
    let mut values = vec![1.0f32; 5000];
    assert!(sound(&values));
    for at in [0, 1, 1023, 1024, 4999] {
        for bad in [f32::NAN, f32::INFINITY, -f32::INFINITY, 2e18, -2e18] {
            let good = std::mem::replace(&mut values[at], bad);
            assert!(!sound(&values), "{bad} at {at}");
            values[at] = good;
        }
    }
}
