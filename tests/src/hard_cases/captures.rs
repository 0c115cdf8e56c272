//! Captures that lie far from the origin or are tiny, and points that are none.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use glam::DVec3;
use pocketsplat_capture::dataset::{self, Capture, LoadOptions};
use pocketsplat_capture::synth::{self, SynthOptions};
use pocketsplat_kernels::scene::init::initial_scene;
use pocketsplat_trainer::train::TrainConfig;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{Case, Family, error, n_not_finite, parameters};
use crate::difference::worse;

const ANSWER: &str = "\
A capture may lie 10⁶ units from its origin or be 10⁻⁴ wide: cameras come out right to 10⁻⁸ of the normalised frame. Any set of points
gives a finite scene to start from.";

const ANALYSIS: &str = "\
Poses are read as f64 and normalised before anything is rounded to f32: the mean of the cameras, but for those that stand apart, goes to the origin and their spread to 5.
A coordinate of 10⁶ is known to 1.2e-10. Normalising multiplies that by about 1, and a sum over the views by a few. In a capture 10⁻⁴
wide every number is as good as in one that is 1 wide. So the bounds are 1e-8 and 1e-12 normalised units. Where all points are one
point, or lie in a line, spacings are lifted to 3·10⁻⁴ before their logarithm is taken. A voxel size is found whatever the points are.";

const N_VIEWS: u32 = 8;

/// Where a ray-traced capture is put, in the units of its file.
#[derive(Clone, Copy)]
struct Place {
    scale: f64,
    shift: DVec3,
}

/// Writes a capture and moves its poses.
pub(super) fn write(folder: &Path, edit: impl Fn(usize, [[f64; 4]; 4]) -> [[f64; 4]; 4]) {
    let options =
        SynthOptions { size_px: 16, n_train: N_VIEWS, n_test: 1, samples_per_axis: 1, ..SynthOptions::default() };
    synth::write_capture(folder, &options).expect("written");
    let file = folder.join("transforms_train.json");
    let text = fs::read_to_string(&file).expect("written above");
    let mut transforms: serde_json::Value = serde_json::from_str(&text).expect("written above");
    for (index, frame) in transforms["frames"].as_array_mut().expect("frames").iter_mut().enumerate() {
        let rows: [[f64; 4]; 4] = serde_json::from_value(frame["transform_matrix"].clone()).expect("a matrix");
        // Not through serde_json, which has no word for NaN: as Python writes it.
        let mut text = String::from("[");
        for (i, row) in edit(index, rows).into_iter().enumerate() {
            let numbers = row.map(|x| if x.is_nan() { "NaN".to_owned() } else { format!("{x:?}") });
            let _ = write!(text, "{}[{}]", if i > 0 { ", " } else { "" }, numbers.join(", "));
        }
        text.push(']');
        frame["transform_matrix"] = serde_json::Value::String(text);
    }
    let text = serde_json::to_string(&transforms).expect("a value").replace("\"[[", "[[").replace("]]\"", "]]");
    fs::write(&file, text).expect("writable");
}

fn load(place: Place) -> Capture {
    let folder = tempfile::tempdir().expect("a temporary folder");
    write(folder.path(), |_, mut rows| {
        for (row, shift) in rows.iter_mut().zip(place.shift.to_array()) {
            row[3] = place.scale * row[3] + shift;
        }
        rows
    });
    dataset::load(folder.path(), &LoadOptions::default()).expect("a sound capture").0
}

/// How far the cameras of a moved capture are from those of the capture as it was, normalised units.
fn cameras_off(place: Place) -> f64 {
    let (here, there) = (load(Place { scale: 1.0, shift: DVec3::ZERO }), load(place));
    assert_eq!((here.train.len(), there.train.len()), (N_VIEWS as usize, N_VIEWS as usize), "all views");
    let pairs = here.train.iter().zip(&there.train);
    let worst = pairs.map(|(a, b)| a.camera.centre_world().distance(b.camera.centre_world())).fold(0.0, worse);
    if there.points.iter().all(|p| p.is_finite()) { worst } else { f64::INFINITY }
}

/// Parameters of the scene that starts from `points` which are not finite; infinite where there is no anchor.
fn start_of(points: &[DVec3]) -> f64 {
    let voxel_size = dataset::suggested_voxel_size(points);
    let scene = initial_scene(TrainConfig::default().shape, voxel_size, points, &mut ChaCha8Rng::seed_from_u64(1));
    if scene.anchors.is_empty() || !(voxel_size > 0.0) { f64::INFINITY } else { n_not_finite(parameters(&scene)) }
}

/// Anchors beside a plane's or a line's own after points that are not finite were among those of a PLY file.
fn damaged_points() -> f64 {
    let folder = tempfile::tempdir().expect("a temporary folder");
    write(folder.path(), |_, rows| rows);
    let (from, to) = (folder.path().join("transforms_train.json"), folder.path().join("transforms.json"));
    let text = fs::read_to_string(&from).expect("written above");
    fs::write(to, text.replacen('{', "{\"ply_file_path\": \"points.ply\", ", 1)).expect("writable");
    fs::remove_file(from).expect("there");
    let points = "0 0 0\n0.5 0 0\nnan 0 0\n0 inf 0\n0 0.5 0\n1e38 0 0\n";
    let header =
        "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    fs::write(folder.path().join("points.ply"), format!("{header}{points}")).expect("writable");
    let (capture, _) = dataset::load(folder.path(), &LoadOptions::default()).expect("a sound capture");
    (capture.points.len() as f64 - 3.0).abs() + start_of(&capture.points)
}

pub(super) fn family() -> Family {
    let units = "cameras off by, normalised units";
    let numbers = "parameters that are not finite";
    let cases: Vec<Case> = vec![
        error("far from the origin", "a capture 10⁶ units away", units, 1e-8, || {
            cameras_off(Place { scale: 1.0, shift: DVec3::new(1e6, -2e6, 3e5) })
        }),
        error("10⁻⁴ wide", "a capture of 0.4 mm in metres", units, 1e-12, || {
            cameras_off(Place { scale: 1e-4, shift: DVec3::ZERO })
        }),
        error("10⁶ wide", "a capture in millimetres, kilometres wide", units, 1e-12, || {
            cameras_off(Place { scale: 1e6, shift: DVec3::ZERO })
        }),
        error(
            "points that are none",
            "NaN, infinity and 10³⁸ in a point cloud: three left out",
            "points too many or parameters not finite",
            0.0,
            damaged_points,
        ),
        error("one point", "a scene that starts from a single point", numbers, 0.0, || start_of(&[DVec3::ONE])),
        error("one place", "a hundred times the same point", numbers, 0.0, || start_of(&[DVec3::ONE; 100])),
        error("points in a line", "a hundred points on one line", numbers, 0.0, || {
            start_of(&(0..100).map(|i| DVec3::new(f64::from(i), 2.0 * f64::from(i), 0.0)).collect::<Vec<_>>())
        }),
        error("points in a plane", "10⁴ points in one plane", numbers, 0.0, || {
            start_of(&(0..10_000).map(|i| DVec3::new(f64::from(i % 100), f64::from(i / 100), 7.0)).collect::<Vec<_>>())
        }),
        error("points of all scales", "spacings from 10⁻¹² to 10¹²", numbers, 0.0, || {
            start_of(&(-12..12).map(|i| DVec3::splat(10.0_f64.powi(i))).collect::<Vec<_>>())
        }),
    ];
    Family { title: "Captures", answer: ANSWER, analysis: ANALYSIS, cases }
}
