//! Real captures, where they are at hand.

use std::path::{Path, PathBuf};

use pocketsplat_capture::dataset::{Capture, LoadOptions, LoadReport, PointsOrigin, Split, load};

/// The folder of a capture, or `None` after saying what is skipped.
fn find(name: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let root = std::env::var_os("POCKETSPLAT_DATA").map_or(beside, PathBuf::from);
    let folder = root.join(name);
    if !folder.is_dir() {
        eprintln!(
            "skipped: no capture `{}`; name the folder that holds `{name}` in POCKETSPLAT_DATA",
            folder.display()
        );
        return None;
    }
    Some(folder)
}

fn loaded(name: &str, max_resolution: u32) -> Option<(Capture, LoadReport)> {
    let options = LoadOptions { max_resolution: Some(max_resolution), ..LoadOptions::default() };
    let (capture, report) = load(&find(name)?, &options).expect("a sound capture");
    eprintln!("{report}\nsuggested voxel size: {:.5}", capture.suggested_voxel_size());
    Some((capture, report))
}

/// The part of the points that fall into the image of at least `n_views` training views.
fn share_seen(capture: &Capture, n_views: usize) -> f64 {
    let seen = |point: &&glam::DVec3| {
        let views = capture.train.iter().filter(|view| {
            let camera = &view.camera;
            let p = camera.rotation * **point + camera.translation;
            let u = camera.focal_px[0] * p.x / p.z + camera.principal_px[0];
            let v = camera.focal_px[1] * p.y / p.z + camera.principal_px[1];
            p.z > 0.0
                && (0.0..=f64::from(camera.width_px)).contains(&u)
                && (0.0..=f64::from(camera.height_px)).contains(&v)
        });
        views.take(n_views).count() == n_views
    };
    capture.points.iter().filter(seen).count() as f64 / capture.points.len() as f64
}

#[test]
fn bonsai() {
    let Some((capture, report)) = loaded("bonsai", 100) else { return };
    assert_eq!((capture.train.len(), capture.test.len(), report.skipped.len()), (255, 37, 0), "{report}");
    assert_eq!((report.source_size_px, report.size_px, report.n_sizes), ((800, 533), (100, 67), 1));
    assert_eq!(capture.points_origin, PointsOrigin::Capture);
    // Triangulated from at least two images each, and most of those are in the training split.
    let share = share_seen(&capture, 2);
    assert!(share > 0.99, "{share}");
}

#[test]
fn tumbler() {
    let Some((capture, report)) = loaded("tumbler", 100) else { return };
    assert_eq!((capture.train.len(), capture.test.len(), report.skipped.len()), (67, 10, 0), "{report}");
    let focal_px = |i: usize| capture.train[i].camera.focal_px[0];
    assert!((1..67).any(|i| focal_px(i) != focal_px(0)), "each image has a camera of its own");
    let share = share_seen(&capture, 2);
    assert!(share > 0.99, "{share}");
}

#[test]
fn fox() {
    let Some((capture, report)) = loaded("fox", 240) else { return };
    assert_eq!(report.skipped.len(), 17, "{report}");
    let n_skipped = |split| report.skipped.iter().filter(|view| view.split == split).count();
    // 9 of the 67 listed frames are every eighth, whether or not their image is there.
    assert_eq!(capture.test.len() + n_skipped(Split::Test), 9, "{report}");
    assert_eq!(capture.train.len() + n_skipped(Split::Train), 58, "{report}");
    assert_eq!(capture.points_origin, PointsOrigin::Matched);
    assert!((10_000..25_000).contains(&capture.points.len()), "{report}");
    assert!(report.to_string().contains("initial points matched between the photographs in "), "{report}");
    let camera = &capture.train[0].camera;
    assert_eq!((camera.width_px, camera.height_px), (135, 240));
    assert!((camera.principal_px[0] - 277.279 / 4.0).abs() < 1e-9, "{camera:?}");
    let share = share_seen(&capture, 3);
    assert!(share > 0.8, "{share}");
}
