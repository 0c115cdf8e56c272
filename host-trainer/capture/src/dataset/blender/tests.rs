use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use glam::{DMat3, DVec3};

use super::*;
use crate::dataset::{Background, Capture, LoadOptions, LoadReport, View, load};

/// A capture of 6×4 px images from `n` cameras on a circle of radius 4, looking at the origin.
struct Fixture {
    folder: tempfile::TempDir,
    frames: Vec<String>,
}

impl Fixture {
    fn new(n: usize) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::create_dir(folder.path().join("train")).expect("a folder for images");
        let fixture = Self { frames: (0..n).map(|i| frame(&format!("./train/r_{i}"), i)).collect(), folder };
        (0..n).for_each(|i| fixture.write_image(&format!("train/r_{i}.png"), 6, 4));
        fixture
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn write_image(&self, name: &str, width_px: u32, height_px: u32) {
        let rgba: Vec<u8> = (0..width_px * height_px).flat_map(|i| [200, 100, (i * 10) as u8, 128]).collect();
        ::image::save_buffer(self.path().join(name), &rgba, width_px, height_px, ::image::ExtendedColorType::Rgba8)
            .expect("an image");
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path().join(name), text).expect("a file");
    }

    fn write_transforms(&self) {
        self.write(TRAIN_FILE, &transforms("0.7", &self.frames));
    }

    fn load(&self) -> Result<(Capture, LoadReport), DatasetError> {
        load(self.path(), &LoadOptions { test_every: 0, ..LoadOptions::default() })
    }

    fn error(&self) -> String {
        self.load().expect_err("this capture is broken").to_string()
    }
}

/// Of a view in memory.
fn pixels(view: &View) -> Vec<u8> {
    view.photograph().expect("in memory").image.rgb.clone()
}

fn transforms(angle: &str, frames: &[String]) -> String {
    format!(r#"{{"camera_angle_x": {angle}, "frames": [{}]}}"#, frames.join(", "))
}

fn frame(file_path: &str, i: usize) -> String {
    // At angle φ on the circle in the xz plane the camera is turned by φ about y.
    let rotation = DMat3::from_rotation_y(0.5 * i as f64);
    frame_with(file_path, rotation, rotation * DVec3::new(0.0, 0.0, 4.0))
}

fn frame_with(file_path: &str, rotation: DMat3, centre: DVec3) -> String {
    let mut rows = String::new();
    for (row, c) in rotation.transpose().to_cols_array_2d().iter().zip(centre.to_array()) {
        write!(rows, "[{:?}, {:?}, {:?}, {c:?}], ", row[0], row[1], row[2]).expect("a string takes all");
    }
    format!(r#"{{"file_path": "{file_path}", "transform_matrix": [{rows}[0, 0, 0, 1]]}}"#)
}

#[track_caller]
fn assert_says(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "`{part}` is not in: {text}");
    }
}

#[test]
fn a_sound_capture_loads_with_its_cameras_and_pixels() {
    let mut fixture = Fixture::new(5);
    fixture.write_transforms();
    let held_out = fixture.frames.pop().expect("five frames");
    fixture.write(TEST_FILE, &transforms("0.7", &[held_out]));
    let (capture, report) = fixture.load().expect("a capture");

    assert_eq!((capture.train.len(), capture.test.len(), report.skipped.len()), (5, 1, 0), "{report}");
    // Photographs of 6×4 pixels have no corners.
    assert!(matches!(&report.notes[..], [note] if note.starts_with("points matched")), "{:?}", report.notes);
    assert_eq!(capture.points.len(), 10_000);
    let camera = &capture.train[1].camera;
    assert!((camera.focal_px[0] - 3.0 / 0.35_f64.tan()).abs() < 1e-12, "{camera:?}");
    assert_eq!((camera.principal_px, camera.width_px, camera.height_px), ([3.0, 2.0], 6, 4));
    // The origin of the world is straight ahead of every camera, 4 capture units away.
    let origin = camera.rotation * capture.normalisation.point(DVec3::ZERO) + camera.translation;
    let expected = DVec3::new(0.0, 0.0, 4.0 * capture.normalisation.scale);
    assert!((origin - expected).length() < 1e-9, "{origin}");
    assert_eq!(pixels(&capture.train[1])[..3], [100, 50, 0], "200, 100, 0 at alpha 128 on black, truncated");
    assert_eq!(capture.train[1].name, "train/r_1");
    assert_eq!(capture.shown, 1.0, "no pixel is wholly transparent");
}

#[test]
fn images_are_composited_before_they_are_reduced_and_intrinsics_follow() {
    let fixture = Fixture::new(3);
    fixture.write_transforms();
    let options =
        LoadOptions { max_resolution: Some(3), background: Background::White, test_every: 0, ..LoadOptions::default() };
    let (capture, report) = load(fixture.path(), &options).expect("a capture");
    let view = &capture.train[0];
    assert_eq!((view.camera.width_px, view.camera.height_px), (3, 2));
    assert_eq!((view.camera.width_px, view.camera.principal_px), (3, [1.5, 1.0]));
    assert!((view.camera.focal_px[0] - 1.5 / 0.35_f64.tan()).abs() < 1e-12, "{:?}", view.camera);
    // (200·128 + 255·127)/255 = 227.4 truncates to 227, which averages to itself.
    assert_eq!(pixels(view)[0], 227);
    assert_eq!(capture.background, [1.0; 3]);
    assert_says(&report.to_string(), &["3×2 px (area-averaged from 6×4)", "on white"]);
}

#[test]
fn views_with_faults_are_left_out_and_named() {
    let mut fixture = Fixture::new(8);
    fs::remove_file(fixture.path().join("train/r_1.png")).expect("it was written");
    fixture.write("train/r_3.png", "no image at all");
    fixture.write_image("train/r_5.png", 5, 4);
    fixture.frames[6] = frame_with("./train/r_6", DMat3::IDENTITY * 2.0, DVec3::new(0.0, 3.0, 0.0));
    fixture.frames[7] = fixture.frames[7].replacen("0.0", "NaN", 1);
    fixture.write_transforms();
    fixture.write(TEST_FILE, &transforms("0.7", &[]));
    fixture.write(VAL_FILE, &transforms("0.7", &[frame("./val/r_0", 0)]));

    let (capture, report) = fixture.load().expect("three sound views are left");
    let names: Vec<&str> = capture.train.iter().map(|view| view.name.as_str()).collect();
    assert_eq!(names, ["train/r_0", "train/r_2", "train/r_4"]);
    let skipped: Vec<String> = report.skipped.iter().map(ToString::to_string).collect();
    assert_eq!(skipped.len(), 5, "{skipped:?}");
    assert_says(&skipped[0], &["train/r_1: image missing", "with the extension png or jpg", "restore it"]);
    assert_says(&skipped[1], &["train/r_3: image unreadable", "train/r_3.png", "replace it"]);
    assert_says(&skipped[2], &["train/r_5", "5×4", "6×4", "export it again"]);
    assert_says(&skipped[3], &["train/r_6: `transform_matrix` scales by 2.0", "apply the camera's scale"]);
    assert_says(&skipped[4], &["train/r_7: `transform_matrix` has NaN in row 0, column 1"]);
    assert_says(
        &report.to_string(),
        &["train views left out: 5", "… and 2 more", "not used: 1", "has no usable frame"],
    );
}

#[test]
fn without_a_test_file_every_eighth_view_is_held_out() {
    let fixture = Fixture::new(9);
    fixture.write_transforms();
    let (capture, _) = load(fixture.path(), &LoadOptions::default()).expect("a capture");
    assert_eq!((capture.train.len(), capture.test.len()), (7, 2));
    assert_eq!([0, 1].map(|i| capture.test[i].name.clone()), ["train/r_0", "train/r_8"]);
    let (_, report) = fixture.load().expect("a capture");
    assert_says(&report.to_string(), &["no test views, so test PSNR", "`--test-every 8`"]);
}

#[test]
fn random_points_lie_where_the_cameras_look() {
    let fixture = Fixture::new(9);
    fixture.write_transforms();
    let elsewhere = DVec3::new(60.0, 0.0, 0.0);
    let frames: Vec<String> = (0..9)
        .map(|i| {
            let rotation = DMat3::from_rotation_y(0.5 * i as f64);
            frame_with(&format!("train/r_{i}"), rotation, elsewhere + rotation * DVec3::new(0.0, 0.0, 4.0))
        })
        .collect();
    fixture.write("transforms_train.json", &transforms("0.7", &frames));
    let (capture, _) = load(fixture.path(), &LoadOptions::default()).expect("a capture");
    let focus = capture.normalisation.point(elsewhere);
    let n_near = capture.points.iter().filter(|point| point.distance(focus) < 5.0).count();
    assert!(2 * n_near >= capture.points.len(), "{n_near} of {}", capture.points.len());
}

#[test]
fn images_without_alpha_are_said() {
    let fixture = Fixture::new(3);
    fixture.write_transforms();
    let grey = [9_u8; 24];
    ::image::save_buffer(fixture.path().join("train/r_0.png"), &grey, 6, 4, ::image::ExtendedColorType::L8)
        .expect("an image");
    let (capture, report) = fixture.load().expect("a capture");
    assert_eq!(pixels(&capture.train[0])[..3], [9; 3]);
    assert_says(&report.to_string(), &["images without an alpha channel: 1"]);
}

#[test]
fn too_few_views_name_what_is_wrong_with_the_others() {
    let fixture = Fixture::new(4);
    for i in [0, 3] {
        fs::remove_file(fixture.path().join(format!("train/r_{i}.png"))).expect("it was written");
    }
    fixture.write_transforms();
    assert_says(&fixture.error(), &["2 of 4 training views", "at least 3", "train/r_0: image missing", "train/r_3"]);

    let none = Fixture::new(0);
    none.write_transforms();
    assert_says(&none.error(), &[TRAIN_FILE, "0 of 0 training views", "at least 3"]);
}

#[test]
fn broken_transforms_name_file_place_and_remedy() {
    let fixture = Fixture::new(3);
    for (angle, parts) in [
        ("40.0", ["`camera_angle_x` is 40", "between 0 and π", "degrees"]),
        ("-0.5", ["`camera_angle_x` is -0.5", TRAIN_FILE, "radians"]),
        ("\"wide\"", ["line 1 column 25", TRAIN_FILE, "invalid type: string"]),
        ("NaN", ["neither `fl_x` nor `camera_angle_x` is a number", TRAIN_FILE, "`train/r_0`"]),
    ] {
        fixture.write(TRAIN_FILE, &transforms(angle, &fixture.frames));
        assert_says(&fixture.error(), &parts);
    }
    fixture.write(TRAIN_FILE, r#"{"camera_angle_x": 0.7}"#);
    assert_says(&fixture.error(), &["missing field `frames`", TRAIN_FILE, "`transform_matrix`"]);
    fixture.write(TRAIN_FILE, &transforms("0.7", &fixture.frames)[..60]);
    assert_says(&fixture.error(), &["EOF while parsing", TRAIN_FILE]);
    fixture.write_transforms();
    fixture.write(TEST_FILE, "[]");
    assert_says(&fixture.error(), &[TEST_FILE, "is not a transforms file"]);
}

#[test]
fn cameras_in_one_place_are_refused() {
    let mut fixture = Fixture::new(3);
    for i in 0..3 {
        fixture.frames[i] = frame_with(&format!("train/r_{i}"), DMat3::IDENTITY, DVec3::ONE);
    }
    fixture.write_transforms();
    assert_says(&fixture.error(), &["all training cameras stand within 0.0e0", "views from different places"]);
}

#[test]
fn what_is_no_capture_is_refused_by_what_was_looked_for() {
    let fixture = Fixture::new(3);
    assert_says(&fixture.error(), &["looked for `transforms_train.json`", "give the folder that holds one of them"]);
    let nowhere = fixture.path().join("nowhere");
    let error = load(&nowhere, &LoadOptions::default()).expect_err("no folder").to_string();
    assert_says(&error, &["nowhere` is not a folder"]);
    let options = LoadOptions { max_resolution: Some(0), ..LoadOptions::default() };
    let error = load(fixture.path(), &options).expect_err("no size").to_string();
    assert_says(&error, &["is 0 px", "at least 1"]);
}

#[test]
fn lego_loads_where_the_data_is_at_hand() {
    let data = std::env::var_os("POCKETSPLAT_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from);
    let lego = data.join("lego");
    if !lego.is_dir() {
        eprintln!("skipped: no lego capture in `{}`; name its parent in POCKETSPLAT_DATA", data.display());
        return;
    }
    let options = LoadOptions { max_resolution: Some(50), ..LoadOptions::default() };
    let (capture, report) = load(&lego, &options).expect("the published capture");
    assert_eq!((capture.train.len(), report.skipped.len()), (100, 0), "{report}");
    assert!(capture.train.iter().all(|view| (view.camera.width_px, view.camera.height_px) == (50, 50)), "{report}");
    // All published cameras stand 4.03 from the origin, on the upper half.
    let origin = capture.normalisation.point(DVec3::ZERO);
    for view in capture.train.iter().chain(&capture.test) {
        let distance = view.camera.centre_world().distance(origin) / capture.normalisation.scale;
        assert!((distance - 4.031).abs() < 0.001, "{}: {distance}", view.name);
    }
}
