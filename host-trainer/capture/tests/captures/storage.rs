//! Photographs in memory, in a cache, and decoded again whenever they are asked for.

use std::fs;
use std::path::{Path, PathBuf};

use pocketsplat_capture::dataset::{Capture, DatasetError, LoadOptions, PhotographError, remove_cache};

use crate::fixture::{Fixture, Kind, SIZE_PX, photograph};

/// How photographs are loaded that do not stay in memory, whatever their size.
fn kept(cache: Option<&Path>) -> LoadOptions {
    LoadOptions { in_memory_bytes: 0, cache: cache.map(Path::to_owned), ..LoadOptions::default() }
}

fn assert_same(a: &Capture, b: &Capture) {
    assert_eq!((a.points == b.points, a.shown, a.normalisation), (true, b.shown, b.normalisation));
    assert_eq!((a.train.len(), a.test.len()), (b.train.len(), b.test.len()));
    for (a, b) in a.train.iter().chain(&a.test).zip(b.train.iter().chain(&b.test)) {
        assert_eq!((&a.name, &a.camera, a.has_mask(), a.crc32()), (&b.name, &b.camera, b.has_mask(), b.crc32()));
        assert_eq!((photograph(a), a.decoded_bytes()), (photograph(b), b.decoded_bytes()), "{}", a.name);
        assert_eq!(photograph(&a.halved()), photograph(&b.halved()), "{}", a.name);
        assert_eq!(a.halved().camera, b.halved().camera);
    }
}

/// Nine photographs: undistorted, one with a mask, one cut off in the middle.
fn fixture() -> Fixture {
    let mut fixture = Fixture::new(Kind::ColmapBinary, 10);
    fixture.cameras[0].model = (4, "OPENCV");
    fixture.cameras[0].parameters = vec![20.0, 20.0, 12.0, 8.0, 0.02, -0.01, 0.001, -0.001];
    fixture.write_mask("masks/p_03.png", SIZE_PX);
    let cut = fs::read(fixture.at("images/p_05.png")).expect("written");
    fixture.write("images/p_05.png", &cut[..cut.len() / 2]);
    fixture.write_files();
    fixture
}

/// The decoded photographs in a cache.
fn files(cache: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(cache).expect("a folder").map(|entry| entry.expect("a file").path());
    let mut files: Vec<_> = entries.filter(|path| path.extension().is_some_and(|e| e == "photograph")).collect();
    files.sort();
    files
}

#[test]
fn a_view_is_the_same_wherever_its_photograph_lies() {
    for kind in [Kind::Blender, Kind::Nerfstudio, Kind::ColmapText] {
        let fixture = Fixture::new(kind, 9);
        fixture.write_files();
        let (expected, report) = fixture.load().expect("a capture");
        assert!(expected.train.iter().all(|view| view.is_in_memory()));
        let (again, said) = fixture.load_with(&kept(None)).expect("a capture");
        assert_same(&expected, &again);
        assert_eq!(report.to_string(), said.to_string());
    }
    let fixture = fixture();
    let (expected, report) = fixture.load().expect("a capture");
    assert!(report.to_string().contains("p_05.png"), "one was left out: {report}");
    let cache = fixture.at("cache");
    for cache in [None, Some(cache.as_path()), Some(cache.as_path())] {
        for max_resolution in [None, Some(12)] {
            let (capture, said) = fixture.load_with(&LoadOptions { max_resolution, ..kept(cache) }).expect("a capture");
            let options = LoadOptions { max_resolution, ..LoadOptions::default() };
            let (expected, report) = fixture.load_with(&options).expect("a capture");
            assert!(capture.train.iter().all(|view| !view.is_in_memory()));
            assert_same(&expected, &capture);
            assert_eq!(report.to_string(), said.to_string());
        }
    }
    assert_eq!(files(&cache).len(), expected.train.len() + expected.test.len());
    remove_cache(&cache).expect("a cache");
    assert!(!cache.exists());
}

#[test]
fn photographs_are_decoded_once_and_damaged_ones_anew() {
    let fixture = fixture();
    let expected = fixture.load().expect("a capture").0;
    let cache = fixture.at("cache");
    let load = || fixture.load_with(&kept(Some(&cache))).expect("a capture").0;
    drop(load());
    let before: Vec<_> =
        files(&cache).iter().map(|path| fs::metadata(path).expect("a file").modified().expect("a time")).collect();
    let [damaged, cut, gone, sound @ ..] = &files(&cache)[..] else { panic!("nine files") };
    let mut bytes = fs::read(damaged).expect("a file");
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(damaged, &bytes).expect("room");
    let bytes = fs::read(cut).expect("a file");
    fs::write(cut, &bytes[..bytes.len() - 1]).expect("room");
    fs::remove_file(gone).expect("a file");
    assert_same(&expected, &load());
    for (path, before) in sound.iter().zip(&before[3..]) {
        let now = fs::metadata(path).expect("a file").modified().expect("a time");
        assert_eq!(now, *before, "{} was used again", path.display());
    }
    // Another image of the same name, and another background.
    fixture.write_image("images/p_07.png", (SIZE_PX.0, SIZE_PX.1));
    let mut other = image::open(fixture.at("images/p_07.png")).expect("an image").into_rgb8();
    other.get_pixel_mut(12, 8).0 = [1, 2, 3];
    other.save(fixture.at("images/p_07.png")).expect("room");
    let changed = fixture.load().expect("a capture").0;
    assert_ne!(changed.train[5].crc32(), expected.train[5].crc32(), "{}", changed.train[5].name);
    assert_same(&changed, &load());
}

#[test]
fn what_happens_to_a_photograph_after_loading_is_an_error_that_names_it() {
    let fixture = fixture();
    let cache = fixture.at("cache");
    let capture = fixture.load_with(&kept(Some(&cache))).expect("a capture").0;
    let in_use = fixture.load_with(&kept(Some(&cache))).expect_err("two at a time");
    assert!(matches!(in_use, DatasetError::CacheInUse { .. }), "{in_use}");
    for path in files(&cache) {
        let mut bytes = fs::read(&path).expect("a file");
        let last = bytes.len() - 1;
        bytes[last] ^= 1;
        fs::write(&path, bytes).expect("room");
    }
    let error = capture.train[0].photograph().expect_err("damaged").to_string();
    assert!(
        error.contains(&capture.train[0].name) && error.contains("is damaged") && error.contains("--resume"),
        "{error}"
    );
    let capture = fixture.load_with(&kept(None)).expect("a capture").0;
    assert!(capture.train[0].photograph().is_ok());
    for view in &capture.train {
        fixture.write_image(&format!("images/{}", view.name), (SIZE_PX.0, SIZE_PX.1));
        let mut other = image::open(fixture.at(&format!("images/{}", view.name))).expect("an image").into_rgb8();
        other.get_pixel_mut(12, 8).0 = [1, 2, 3];
        other.save(fixture.at(&format!("images/{}", view.name))).expect("room");
    }
    let error = capture.train[0].photograph().expect_err("another image");
    assert!(matches!(error, PhotographError::Changed { .. }), "{error}");
    fixture.remove(&format!("images/{}", capture.train[1].name));
    let error = capture.train[1].photograph().expect_err("no image").to_string();
    assert!(error.contains("it was sound when the capture was loaded"), "{error}");
}

#[test]
fn a_capture_that_fits_into_memory_leaves_no_cache() {
    let fixture = fixture();
    let cache = fixture.at("cache");
    drop(fixture.load_with(&kept(Some(&cache))).expect("a capture"));
    assert!(!files(&cache).is_empty());
    let fits = LoadOptions { cache: Some(cache.clone()), ..LoadOptions::default() };
    let capture = fixture.load_with(&fits).expect("a capture").0;
    assert!(capture.train.iter().all(|view| view.is_in_memory()) && !cache.exists());
}
