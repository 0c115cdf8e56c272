//! Captures load with the conventions that the renderers use: seen from all training views, the object is one solid.
//!
//! A point belongs to the visual hull when every training view sees it on the object. Were an axis flipped, a pose
//! inverted or the principal point off, the silhouettes would not meet: the hull would be empty, or too thin to fill
//! the silhouettes of views that did not carve it.

use std::path::Path;

use conformance::captures;
use glam::DVec3;
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{self, Background, EXTENT, LoadOptions, View};
use pocketsplat_capture::synth::{self, SynthOptions};

/// Points of the grid along an axis.
const N_CELLS: usize = 72;

/// The pixel that `point` falls on, if it is in the image.
fn pixel_of(camera: &Camera, point: DVec3) -> Option<usize> {
    let p = camera.rotation * point + camera.translation;
    let u = (camera.focal_px[0] * p.x / p.z + camera.principal_px[0]).floor();
    let v = (camera.focal_px[1] * p.y / p.z + camera.principal_px[1]).floor();
    let inside = p.z > 0.0 && u >= 0.0 && v >= 0.0 && u < f64::from(camera.width_px) && v < f64::from(camera.height_px);
    inside.then(|| v as usize * camera.width_px as usize + u as usize)
}

/// A view and which of its pixels show the object.
struct Silhouette<'a> {
    camera: &'a Camera,
    on_object: Vec<bool>,
}

/// The silhouettes of views loaded on black and again on white: the background is what changed completely.
fn silhouettes<'a>(on_black: &'a [View], on_white: &[View]) -> Vec<Silhouette<'a>> {
    let changed = |black: &u8, white: &u8| *white == 255 && *black == 0;
    let of_view = |(black, white): (&'a View, &View)| {
        assert_eq!(black.name, white.name, "views in the same order");
        let [on_black, on_white] = [black, white].map(|view| view.photograph().expect("in memory"));
        let pixels = on_black.image.rgb.chunks_exact(3).zip(on_white.image.rgb.chunks_exact(3));
        let on_object = pixels.map(|(b, w)| !b.iter().zip(w).all(|(b, w)| changed(b, w))).collect();
        Silhouette { camera: &black.camera, on_object }
    };
    on_black.iter().zip(on_white).map(of_view).collect()
}

/// The points of a grid, `reach` to each side of `centre`, that every view sees on the object.
fn visual_hull(views: &[Silhouette<'_>], centre: DVec3, reach: f64) -> Vec<DVec3> {
    let coordinate = |i: usize| reach * (2.0 * (i as f64 + 0.5) / N_CELLS as f64 - 1.0);
    let sees = |view: &Silhouette<'_>, point| pixel_of(view.camera, point).is_some_and(|i| view.on_object[i]);
    (0..N_CELLS.pow(3))
        .map(|i| centre + DVec3::from([i % N_CELLS, i / N_CELLS % N_CELLS, i / N_CELLS.pow(2)].map(coordinate)))
        .filter(|&point| views.iter().all(|view| sees(view, point)))
        .collect()
}

/// Share of a silhouette that the hull covers, each of its points spread over 5 × 5 pixels.
fn covered_share(hull: &[DVec3], view: &Silhouette<'_>) -> f64 {
    let (width, height) = (view.camera.width_px as usize, view.camera.height_px as usize);
    let mut covered = vec![false; width * height];
    for i in hull.iter().filter_map(|&point| pixel_of(view.camera, point)) {
        let (x, y) = (i % width, i / width);
        for row in y.saturating_sub(2)..(y + 3).min(height) {
            covered[row * width + x.saturating_sub(2)..row * width + (x + 3).min(width)].fill(true);
        }
    }
    let n_object = view.on_object.iter().filter(|&&on| on).count();
    let n_covered = view.on_object.iter().zip(&covered).filter(|&(&on, &covered)| on && covered).count();
    n_covered as f64 / n_object as f64
}

/// Loads the capture in `folder` and compares its hull with the views held out.
fn check(folder: &Path, name: &str) {
    let [on_black, on_white] = [Background::Black, Background::White].map(|background| {
        let options = LoadOptions { max_resolution: Some(100), background, ..LoadOptions::default() };
        let (capture, report) = dataset::load(folder, &options).expect("the capture is sound");
        println!("{report}");
        capture
    });
    assert!((on_black.extent - EXTENT).abs() < 1e-9, "{name}: extent {}", on_black.extent);
    // These captures show one object about the origin of their world, smaller than the ring of cameras.
    let origin = -on_black.normalisation.centre * on_black.normalisation.scale;
    let hull = visual_hull(&silhouettes(&on_black.train, &on_white.train), origin, 0.4 * EXTENT);
    let held_out = silhouettes(&on_black.test, &on_white.test);
    let least = held_out.iter().map(|view| covered_share(&hull, view)).reduce(f64::min).expect("views held out");
    println!("{name}: hull of {} points covers {:.1} % of a held-out silhouette at least", hull.len(), 100.0 * least);
    assert!(least > 0.95, "{name}: the hull covers only {:.1} % of a held-out silhouette", 100.0 * least);
}

#[test]
fn the_ray_traced_capture_has_one_visual_hull() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = SynthOptions { size_px: 100, n_train: 30, n_test: 6, ..SynthOptions::default() };
    synth::write_capture(folder.path(), &options).expect("written");
    check(folder.path(), "synthetic");
}

#[test]
fn lego_has_one_visual_hull() {
    if let Some(folder) = captures::find("lego", "visual hull of Synthetic-NeRF lego") {
        check(&folder, "lego");
    }
}
