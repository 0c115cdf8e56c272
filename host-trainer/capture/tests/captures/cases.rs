//! Captures of real trouble, where they are at hand: the folder `cases` beside the one that `POCKETSPLAT_DATA` names.

use std::path::{Path, PathBuf};

use pocketsplat_capture::dataset::{Capture, LoadOptions, View, diagnose, load};

use crate::fixture::photograph;

/// The capture of a case, or `None` after saying what is skipped.
fn find(name: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/cases");
    let root = std::env::var_os("POCKETSPLAT_DATA").map_or(beside, |data| PathBuf::from(data).join("../cases"));
    let capture = root.join(name);
    if !capture.is_dir() {
        eprintln!("skipped: no capture `{}`; name the folder beside `cases` in POCKETSPLAT_DATA", capture.display());
        return None;
    }
    Some(capture)
}

fn all(path: &Path) -> (Capture, String) {
    let options = LoadOptions { test_every: 0, ..LoadOptions::default() };
    let (capture, report) = load(path, &options).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    (capture, report.to_string())
}

/// Mean difference of two photographs, of 255, where both count.
fn difference(a: &View, b: &View) -> f64 {
    let (a, b) = (photograph(a), photograph(b));
    let counts = |i: usize| a.mask.as_ref().is_none_or(|mask| mask.valid[i / 3]);
    let pairs = a.image.rgb.iter().zip(&b.image.rgb).enumerate().filter(|(i, _)| counts(*i));
    let (sum, n) = pairs.fold((0.0, 0.0), |(sum, n), (_, (a, b))| (sum + f64::from(a.abs_diff(*b)), n + 1.0));
    sum / n
}

#[test]
fn captures_that_are_sound_but_for_their_form_are_the_sound_one() {
    let Some(sound) = find("sound/capture") else { return };
    let (sound, _) = all(&sound);
    for (name, masked) in [
        ("colmap-model-beside-images", 0.0),
        ("colmap-names-composed-files-decomposed", 0.0),
        ("colmap-txt-double-spaces", 0.0),
        ("colmap-txt-names-in-latin-1", 0.0),
        ("colmap-txt-names-of-three-words", 0.0),
        ("depth-maps-of-the-same-name", 0.0),
        ("heic-named-JPG-converted", 0.0),
        ("instant-ngp-dynamic-masks", 0.05),
        ("masks-in-the-alpha-channel", 0.05),
        ("masks-of-16-bit-0-and-1", 0.05),
        ("nsvf-tiny-skew", 0.0),
        ("polycam-empty-corrected-folders", 0.0),
        ("transforms-focal-y-in-frames", 0.0),
        ("transforms-only-w", 0.0),
    ] {
        let Some(path) = find(&format!("{name}/capture")) else { continue };
        let (capture, report) = all(&path);
        assert_eq!(capture.train.len(), sound.train.len(), "{name}: {report}");
        for (a, b) in capture.train.iter().zip(&sound.train) {
            assert!((a.camera.focal_px[0] - b.camera.focal_px[0]).abs() < 1e-3, "{name} {}: {:?}", a.name, a.camera);
            assert!((a.camera.focal_px[1] - b.camera.focal_px[1]).abs() < 1e-3, "{name} {}: {:?}", a.name, a.camera);
            assert!(a.camera.centre_world().distance(b.camera.centre_world()) < 1e-3, "{name} {}", a.name);
            let miss = difference(a, b);
            assert!(miss < 8.0, "{name} {}: differs by {miss} of 255 from {}", a.name, b.name);
        }
        let share = |view: &View| {
            let photograph = photograph(view);
            photograph.mask.as_ref().map_or(0.0, |mask| 1.0 - mask.n_valid() as f64 / mask.valid.len() as f64)
        };
        let mean = capture.train.iter().map(share).sum::<f64>() / capture.train.len() as f64;
        assert!(mean >= masked && mean < 0.5, "{name}: {mean} is masked");
    }
}

#[test]
fn captures_with_a_fault_say_which() {
    for (name, says) in [
        ("apostrophe-in-the-folder/Ann's photographs", &["pocketsplat poses '", "Ann'\\''s photographs' -o "][..]),
        (
            "colmap-radial-of-a-failed-calibration/capture",
            &["warning[bad-intrinsics]", "the distortion moves a ray by "],
        ),
        ("colmap-two-folders-flattened/capture", &["error[too-few-views]", "is also found for `right/000.jpg`"]),
        ("git-lfs-pointer-photographs/capture", &["a Git LFS pointer", "run `git lfs pull` in its repository"]),
        (
            "metashape-cameras-xml/capture",
            &["a file of cameras of Metashape", "as COLMAP", "ns-process-data metashape"],
        ),
        ("record3d-nan-in-metadata/capture", &["views left out: 1 of 21", "17 views to train"]),
        ("three-photographs/capture", &["train on all 3 with `--test-every 0`"]),
        (
            "transforms-k1-of-a-failed-calibration/capture",
            &["warning[bad-intrinsics]", "the distortion moves a ray by "],
        ),
        ("colmap-binary-simple-fisheye/capture", &["18 views to train, 3 to test", "images with lens distortion: 21"]),
    ] {
        let Some(path) = find(name) else { continue };
        let diagnosis = diagnose(&path, &LoadOptions::default()).to_string();
        for part in says {
            assert!(diagnosis.contains(part), "{name}: `{part}` is not in: {diagnosis}");
        }
    }
}
