//! A corpus of broken captures, each with the message that a person must be given.
//!
//! Every case breaks a sound capture in one way. What is fatal must be an error of loading and of the diagnosis; what
//! costs views must be told in both reports, and the rest of the capture must load; what is doubtful must be told by the
//! diagnosis; what is only odd must load whole.

mod cameras;
mod doubts;
mod layouts;
mod models;
mod odd;
mod photographs;
mod transforms;

use std::io::BufWriter;

use glam::{DMat3, DVec3};
use image::ImageEncoder;
use pocketsplat_capture::dataset::{Diagnosis, LoadOptions, Severity, diagnose};

use crate::fixture::{Fixture, Kind, SIZE_PX};

/// What a fault does to a capture.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Harm {
    /// It cannot be trained on.
    Fatal,
    /// Views are left out.
    Views,
    /// The result may suffer.
    Doubt,
    /// None: the case's code is the one that must not be told.
    Nothing,
}

use Harm::{Doubt, Fatal, Nothing, Views};
use Kind::{Blender, ColmapBinary, ColmapText, Nerfstudio};

struct Case {
    name: &'static str,
    kind: Kind,
    /// Breaks the capture and writes it.
    write: fn(&mut Fixture),
    harm: Harm,
    /// The code of the diagnosis's finding.
    code: &'static str,
    /// Parts of the message: of the error, of the report on loading, or of the diagnosis.
    says: &'static [&'static str],
}

/// Views of the sound capture: two are held out.
const N_VIEWS: usize = 12;

fn case(name: &'static str, kind: Kind, harm: Harm, code: &'static str, write: fn(&mut Fixture)) -> Case {
    Case { name, kind, write, harm, code, says: &[] }
}

impl Case {
    /// Sets the parts of the message.
    fn says(self, says: &'static [&'static str]) -> Self {
        Self { says, ..self }
    }
}

/// Keeps the first bytes of a written file.
fn cut(fixture: &Fixture, name: &str, n_bytes: usize) {
    let bytes = std::fs::read(fixture.at(name)).expect("it was written");
    fixture.write(name, &bytes[..n_bytes]);
}

/// Changes the text of a written file.
fn edit(fixture: &Fixture, name: &str, change: impl Fn(String) -> String) {
    let text = std::fs::read_to_string(fixture.at(name)).expect("it was written");
    fixture.write(name, change(text));
}

fn flat_image(fixture: &Fixture, name: &str) {
    let (width_px, height_px) = SIZE_PX;
    let grey = vec![128; (width_px * height_px * 3) as usize];
    image::save_buffer(fixture.at(name), &grey, width_px, height_px, image::ExtendedColorType::Rgb8).expect("an image");
}

/// A JPEG turned by a quarter according to its EXIF data, under a name that ends in `.png`.
fn turned_image(fixture: &Fixture, name: &str) {
    // A TIFF directory of one entry: orientation (0x0112), short, one value: 6.
    let exif = [b"II*\0\x08\0\0\0\x01\0".as_slice(), b"\x12\x01\x03\0\x01\0\0\0\x06\0\0\0", &[0; 4]].concat();
    let (width_px, height_px) = SIZE_PX;
    let rgb: Vec<u8> = (0..width_px * height_px * 3).map(|i| (i % 251) as u8).collect();
    let file = BufWriter::new(std::fs::File::create(fixture.at(name)).expect("a file"));
    let mut encoder = image::codecs::jpeg::JpegEncoder::new(file);
    encoder.set_exif_metadata(exif).expect("JPEG holds EXIF data");
    encoder.write_image(&rgb, width_px, height_px, image::ExtendedColorType::Rgb8).expect("an image");
}

/// A PNG with a colour profile.
fn profiled_image(fixture: &Fixture, name: &str, profile: &moxcms::ColorProfile) {
    let (width_px, height_px) = SIZE_PX;
    let rgb: Vec<u8> = (0..width_px * height_px * 3).map(|i| (i % 251) as u8).collect();
    let file = BufWriter::new(std::fs::File::create(fixture.at(name)).expect("a file"));
    let mut encoder = image::codecs::png::PngEncoder::new(file);
    encoder.set_icc_profile(profile.encode().expect("a profile")).expect("PNG holds profiles");
    encoder.write_image(&rgb, width_px, height_px, image::ExtendedColorType::Rgb8).expect("an image");
}

/// A turn of every pose by a half about y around its own camera: all look away from the scene.
fn look_away(fixture: &mut Fixture) {
    fixture.photos.iter_mut().for_each(|photo| photo.rotation *= DMat3::from_rotation_y(std::f64::consts::PI));
}

fn told(diagnosis: &Diagnosis, code: &str) -> bool {
    diagnosis.findings.iter().any(|finding| finding.code == code)
}

fn check(case: &Case) {
    let name = case.name;
    let mut fixture = Fixture::new(case.kind, N_VIEWS);
    fixture.points = (0..120).map(|i| DVec3::new(0.01 * f64::from(i) - 0.6, 0.2, 0.05 * f64::from(i % 7))).collect();
    (case.write)(&mut fixture);
    let diagnosis = diagnose(fixture.path(), &LoadOptions::default());
    let loaded = fixture.load();
    if let Ok((_, report)) = &loaded {
        // What is left out has lines of its own.
        let is_left_out = |code| code == "unposed-image" || (case.harm == Views && code == case.code);
        for finding in diagnosis.findings.iter().filter(|finding| finding.severity == Severity::Warning) {
            let is_told =
                is_left_out(finding.code) || report.warnings.iter().any(|warning| warning.code == finding.code);
            assert!(is_told, "{name}: loading does not tell of {finding}:\n{report}");
        }
    }
    let text = match (case.harm, loaded) {
        (Fatal, Err(error)) => error.to_string(),
        (Fatal, Ok((_, report))) => panic!("{name}: loaded, but must not: {report}"),
        (harm, Err(error)) => panic!("{name}: {harm:?}, but loading fails: {error}"),
        (Views, Ok((capture, report))) => {
            assert_eq!(capture.train.len() + capture.test.len() + report.skipped.len(), N_VIEWS, "{name}: {report}");
            assert!(!report.skipped.is_empty(), "{name}: no view is left out");
            report.to_string()
        }
        (Doubt, Ok(_)) => diagnosis.to_string(),
        (Nothing, Ok((capture, report))) => {
            assert_eq!(capture.train.len() + capture.test.len(), N_VIEWS, "{name}: {report}");
            assert_eq!((capture.train.len(), capture.test.len()), (10, 2), "{name}: {report}");
            format!("{report}\n{diagnosis}")
        }
    };
    for part in case.says {
        assert!(text.contains(part), "{name}: `{part}` is not in: {text}");
    }
    assert_eq!(told(&diagnosis, case.code), case.harm != Nothing, "{name}: finding `{}` in:\n{diagnosis}", case.code);
    assert_eq!(diagnosis.has_errors(), case.harm == Fatal, "{name}:\n{diagnosis}");
    for finding in &diagnosis.findings {
        let needs_remedy = finding.severity != Severity::Note;
        assert!(!needs_remedy || !finding.remedy.is_empty(), "{name}: a finding without remedy: {finding}");
    }
}

#[test]
fn captures_of_unknown_or_incomplete_layout() {
    layouts::cases().iter().for_each(check);
}

#[test]
fn damaged_colmap_models() {
    models::cases().iter().for_each(check);
}

#[test]
fn damaged_transforms_files() {
    transforms::cases().iter().for_each(check);
}

#[test]
fn views_that_cannot_be_used() {
    cameras::cases().iter().chain(&photographs::cases()).for_each(check);
}

#[test]
fn captures_that_load_but_are_doubtful() {
    doubts::cases().iter().for_each(check);
}

#[test]
fn captures_that_are_odd_but_whole() {
    odd::cases().iter().for_each(check);
}

#[test]
fn names_of_cases_are_distinct_and_every_layout_is_broken_often() {
    let cases: Vec<Case> = [
        layouts::cases,
        models::cases,
        transforms::cases,
        cameras::cases,
        photographs::cases,
        doubts::cases,
        odd::cases,
    ]
    .into_iter()
    .flat_map(|cases| cases())
    .collect();
    assert!(cases.len() >= 100, "{} cases", cases.len());
    let names: std::collections::BTreeSet<_> = cases.iter().map(|case| case.name).collect();
    assert_eq!(names.len(), cases.len(), "names");
    for kind in [Blender, ColmapBinary, ColmapText, Nerfstudio] {
        let n = cases.iter().filter(|case| case.kind == kind).count();
        assert!(n >= 5, "{kind:?}: {n} cases");
    }
}

#[test]
fn a_diagnosis_serialises_for_programs() {
    let fixture = Fixture::new(ColmapBinary, N_VIEWS);
    fixture.write_files().remove("images/p_03.png");
    let json = serde_json::to_value(diagnose(fixture.path(), &LoadOptions::default())).expect("JSON");
    assert_eq!((&json["layout"], &json["n_train"]), (&"colmap".into(), &9.into()));
    let findings = json["findings"].as_array().expect("a list");
    let missing = findings.iter().find(|finding| finding["code"] == "missing-image").expect("the finding");
    assert_eq!((&missing["severity"], &missing["numbers"]["views"]), (&"warning".into(), &1.0.into()));
    assert!(missing["files"][0].as_str().is_some_and(|file| file.ends_with("images/p_03.png")), "{missing}");
}

#[test]
fn every_cut_of_a_binary_model_is_an_error_or_a_smaller_model() {
    let fixture = Fixture::new(ColmapBinary, 4);
    for (name, bytes) in fixture.files() {
        fixture.write_files();
        for n in (0..bytes.len()).step_by(7) {
            fixture.write(name, &bytes[..n]);
            assert!(fixture.load().is_err(), "{name} cut to {n} of {} bytes loads", bytes.len());
        }
    }
}

#[test]
fn a_file_in_place_of_a_folder_is_told_what_it_is() {
    let fixture = Fixture::new(Nerfstudio, 4);
    fixture.write_files();
    for (name, says) in [
        ("transforms.json", "is a file, needed: a folder; give the folder that it lies in"),
        ("walk.mp4", "/walk`:\n  pocketsplat poses /"),
        ("walk.zip", "is a packed capture, needed: its files; unpack it"),
        ("walk.txt", "is not a folder; give the folder that holds the capture"),
    ] {
        fixture.write(name, fixture.files().remove(0).1);
        let path = fixture.at(name);
        let error = pocketsplat_capture::dataset::load(&path, &LoadOptions::default()).expect_err("a file").to_string();
        assert!(error.contains(says), "{name}: {error}");
        assert!(diagnose(&path, &LoadOptions::default()).has_errors(), "{name}");
    }
}

#[test]
fn a_part_of_a_capture_names_the_whole() {
    for (kind, part) in [(ColmapBinary, "images"), (ColmapText, "sparse/0"), (Blender, "images")] {
        let fixture = Fixture::new(kind, 4);
        let part = fixture.write_files().at(part);
        let error = pocketsplat_capture::dataset::load(&part, &LoadOptions::default()).expect_err("a part").to_string();
        let whole = fixture.path().canonicalize().expect("a folder");
        assert!(
            error.ends_with(&format!(" is a part of the capture `{}`; give that folder", whole.display())),
            "{error}"
        );
    }
}

#[test]
fn options_out_of_range_are_refused() {
    let fixture = Fixture::new(ColmapBinary, 4);
    let error = |options| fixture.write_files().load_with(&options).expect_err("out of range").to_string();
    let message = error(LoadOptions { test_every: 1, ..LoadOptions::default() });
    assert!(message.contains("one view in 1 is to be held out, needed: at least 2"), "{message}");
    let message = error(LoadOptions { n_random_points: 1 << 40, ..LoadOptions::default() });
    assert!(message.contains("1099511627776 random points are asked for, needed: at most 10000000"), "{message}");
    let message = error(LoadOptions { model: Some(3), ..LoadOptions::default() });
    assert!(message.contains("has no model 3: there are 0; give `--model` one of these, or leave it out"), "{message}");
    let message = error(LoadOptions { images: Some("images_8".to_owned()), ..LoadOptions::default() });
    assert!(message.contains("has no folder `images_8`: there are `images`; give `--images`"), "{message}");
}
