use glam::DVec3;

use super::*;
use crate::dataset::{LoadOptions, PointsChoice, View, load};

fn written(options: &SynthOptions) -> (tempfile::TempDir, SynthReport) {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let report = write_capture(dir.path(), options).expect("a capture");
    (dir, report)
}

#[test]
fn a_written_capture_loads_with_the_cameras_it_was_traced_from() {
    let options = SynthOptions { size_px: 16, n_train: 9, n_test: 3, samples_per_axis: 1, ..SynthOptions::default() };
    let (dir, report) = written(&options);
    let random = LoadOptions { points: Some(PointsChoice::Random), ..LoadOptions::default() };
    let (capture, load_report) = load(dir.path(), &random).expect("it loads");
    assert_eq!((report.n_train, report.n_test, report.size_px), (9, 3, 16));
    assert_eq!((capture.train.len(), capture.test.len()), (9, 3));
    assert!(load_report.skipped.is_empty() && load_report.notes.is_empty(), "{load_report}");

    let check = |views: &[View], poses: &[Pose]| {
        for (view, pose) in views.iter().zip(poses) {
            let camera = &view.camera;
            let centre = capture.normalisation.point(pose.centre);
            assert!((camera.centre_world() - centre).length() < 1e-9, "{}", view.name);
            let ahead = camera.rotation * -pose.backward;
            assert!((ahead - DVec3::Z).length() < 1e-9, "{} looks along {ahead}", view.name);
            assert!((camera.rotation * pose.up + DVec3::Y).length() < 1e-9, "{} is not upright", view.name);
            let focal_px = 8.0 / (0.5 * CAMERA_ANGLE_X).tan();
            assert!((camera.focal_px[0] - focal_px).abs() < 1e-9, "{}", view.name);
        }
    };
    check(&capture.train, &cameras::train(9, options.seed));
    check(&capture.test, &cameras::test(3, options.seed));
}

#[test]
fn the_same_options_write_the_same_bytes_and_another_seed_others() {
    let options = SynthOptions { size_px: 24, n_train: 3, n_test: 1, samples_per_axis: 2, ..SynthOptions::default() };
    let bytes = |options: &SynthOptions| {
        let (dir, _) = written(options);
        ["transforms_train.json", "transforms_test.json", "train/r_1.png", "test/r_0.png"]
            .map(|name| std::fs::read(dir.path().join(name)).expect("it was written"))
    };
    assert_eq!(bytes(&options), bytes(&options));
    assert_ne!(bytes(&options)[2], bytes(&SynthOptions { seed: 7, ..options })[2]);
}

#[test]
fn alpha_is_the_share_of_rays_that_meet_the_scene() {
    let options = SynthOptions { size_px: 48, n_train: 3, n_test: 0, ..SynthOptions::default() };
    let (dir, report) = written(&options);
    let image = image::open(dir.path().join("train/r_2.png")).expect("an image").into_rgba8();
    assert_eq!(image.get_pixel(0, 0).0, [0; 4], "corners are empty");
    assert_eq!(image.get_pixel(24, 24)[3], 255, "the middle is covered");
    assert!(image.pixels().any(|p| p[3] > 0 && p[3] < 255), "edges are between");
    assert!((0.2..0.7).contains(&report.mean_alpha), "{report:?}");
}

#[test]
fn nothing_is_overwritten_and_options_are_checked_first() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let bad = SynthOptions { n_train: 2, ..SynthOptions::default() };
    let error = write_capture(&dir.path().join("new"), &bad).expect_err("two views").to_string();
    assert_eq!(error, "`n_train` is 2, needed: 3 to 10000");
    assert!(!dir.path().join("new").exists(), "refused before anything was written");
    std::fs::write(dir.path().join("mine"), "precious").expect("a file");
    let error = write_capture(dir.path(), &SynthOptions::default()).expect_err("occupied").to_string();
    assert!(error.ends_with("is not empty: give a new folder, so that no capture is overwritten"), "{error}");
}
