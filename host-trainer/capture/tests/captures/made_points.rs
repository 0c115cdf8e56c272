//! Points for captures that bring none: kept, found again, of depth maps.

use image::{ImageBuffer, Luma};
use pocketsplat_capture::dataset::{Capture, LoadOptions, LoadReport, PointsChoice, PointsOrigin, load};
use pocketsplat_capture::synth::{SynthOptions, write_capture};

use crate::exports::{write_polycam, write_record3d};
use crate::fixture::{Fixture, Kind, SIZE_PX};

#[test]
fn points_are_made_once_for_the_same_photographs() {
    let folder = tempfile::tempdir().expect("a folder");
    let synth = SynthOptions { size_px: 96, n_train: 24, n_test: 1, ..SynthOptions::default() };
    write_capture(&folder.path().join("capture"), &synth).expect("a capture");
    let file = folder.path().join("points.ply");
    let options = LoadOptions {
        points: Some(PointsChoice::Matched),
        made_points: vec![folder.path().join("none.ply"), file.clone()],
        ..LoadOptions::default()
    };
    let loaded = || load(&folder.path().join("capture"), &options).expect("a sound capture");
    let (first, report) = loaded();
    assert!(report.points_seconds.is_some() && first.points_origin == PointsOrigin::Matched, "{report}");
    assert!(report.to_string().contains("initial points matched between the photographs in "), "{report}");
    let kept = first.made_points.as_ref().expect("points that were made");
    kept.write(&file).expect("written");
    let (second, report) = loaded();
    assert!(second.made_points == first.made_points, "for another folder");
    assert!(report.points_seconds.is_none() && second.points == first.points, "{report}");
    assert!(first.point_colours.len() == first.points.len() && second.point_colours == first.point_colours);
    assert!(
        report.to_string().contains("initial points matched between the photographs by an earlier run"),
        "{report}"
    );
    // Another photograph: other points.
    let [a, b] = ["r_0.png", "r_1.png"].map(|name| folder.path().join("capture/train").join(name));
    let swapped = (std::fs::read(&a).expect("an image"), std::fs::read(&b).expect("an image"));
    std::fs::write(&a, swapped.1).expect("written");
    assert!(loaded().1.points_seconds.is_some());
}

/// What a capture with a depth of 2 m everywhere starts from; one row of each map is not sure.
///
/// * `is_sure`: of the other rows.
fn with_depth_maps(record3d: bool, is_sure: bool) -> (Capture, LoadReport) {
    let fixture = Fixture::new(Kind::Nerfstudio, 17);
    let (width_px, height_px) = SIZE_PX;
    let n = (width_px * height_px) as usize;
    if record3d {
        write_record3d(&fixture, "metadata", "rgbd", 0);
    } else {
        write_polycam(&fixture, "cameras", "images");
    }
    for (i, photo) in fixture.photos.iter().enumerate() {
        if record3d {
            let packed = |bytes: &[u8]| {
                let mut packed = Vec::new();
                lzfse_rust::encode_bytes(bytes, &mut packed).expect("packed");
                packed
            };
            let depths: Vec<u8> = std::iter::repeat_n(2.0_f32.to_le_bytes(), n).flatten().collect();
            let sure: Vec<u8> = (0..n).map(|at| if at < width_px as usize || !is_sure { 1 } else { 2 }).collect();
            fixture.write(&format!("rgbd/{i}.depth"), packed(&depths));
            fixture.write(&format!("rgbd/{i}.conf"), packed(&sure));
        } else {
            let folder = fixture.at("keyframes");
            for kind in ["depth", "confidence"] {
                std::fs::create_dir_all(folder.join(kind)).expect("a folder");
            }
            let depth = ImageBuffer::from_pixel(width_px, height_px, Luma([2000_u16]));
            depth.save(folder.join("depth").join(&photo.name)).expect("a map");
            let sure =
                ImageBuffer::from_fn(width_px, height_px, |_, y| Luma([if y == 0 || !is_sure { 54_u8 } else { 255 }]));
            sure.save(folder.join("confidence").join(&photo.name)).expect("a map");
        }
    }
    fixture.load().expect("a sound capture")
}

#[test]
fn depth_maps_become_points() {
    for record3d in [false, true] {
        let (capture, report) = with_depth_maps(record3d, true);
        assert_eq!(capture.points_origin, PointsOrigin::DepthMaps, "{report}");
        assert!(report.to_string().contains("initial points of its depth maps in "), "{report}");
        // At 2 m from some camera each, and none in the row that is not sure.
        let unit = capture.normalisation.scale;
        for point in &capture.points {
            let seen = capture.train.iter().map(|view| view.camera.rotation * *point + view.camera.translation);
            let off = seen.map(|p| (p.z / unit - 2.0).abs()).fold(f64::INFINITY, f64::min);
            assert!(off < 0.3, "a point is {off} m off");
        }
        assert!(capture.points.len() > 100, "{report}");
        let (capture, report) = with_depth_maps(record3d, false);
        assert_ne!(capture.points_origin, PointsOrigin::DepthMaps, "nothing is sure: {report}");
    }
}

#[test]
fn what_gives_no_points_is_told() {
    let fixture = Fixture::new(Kind::Nerfstudio, 17);
    write_record3d(&fixture, "metadata", "rgbd", 0);
    for i in 0..17 {
        fixture.write(&format!("rgbd/{i}.depth"), "no stream");
    }
    let (capture, report) = fixture.load().expect("a sound capture");
    assert_eq!(capture.points_origin, PointsOrigin::Random, "{report}");
    let text = report.to_string();
    assert!(text.contains("note: depth maps: 14, which give 0 points, needed: "), "{text}");
    // Photographs of 24×16 pixels show too little to be matched.
    assert!(
        text.contains("note: points matched between the photographs: ") && text.contains("random initial"),
        "{text}"
    );
}

/// A capture whose photographs give hundreds of points, with so many of its own in the file that its `transforms.json` names.
fn with_own_points(n: usize) -> (Capture, LoadReport) {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path().join("capture");
    let synth = SynthOptions { size_px: 96, n_train: 24, n_test: 1, ..SynthOptions::default() };
    write_capture(&at, &synth).expect("a capture");
    let listed = std::fs::read_to_string(at.join("transforms_train.json")).expect("a list");
    std::fs::write(at.join("transforms.json"), listed.replacen('{', "{ \"ply_file_path\": \"own.ply\",", 1))
        .expect("written");
    for split in ["train", "test"] {
        std::fs::remove_file(at.join(format!("transforms_{split}.json"))).expect("removed");
    }
    let head = format!(
        "ply\nformat ascii 1.0\nelement vertex {n}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    );
    let point =
        |i: usize| format!("{} {} {}\n", 0.01 * (i % 10) as f64, 0.01 * (i / 10 % 10) as f64, 0.01 * (i / 100) as f64);
    std::fs::write(at.join("own.ply"), head + &(0..n).map(point).collect::<String>()).expect("written");
    load(&at, &LoadOptions::default()).expect("a sound capture")
}

#[test]
fn few_points_of_its_own_give_way_to_three_times_as_many() {
    let (few, report) = with_own_points(30);
    assert_eq!(few.points_origin, PointsOrigin::Matched, "{report}");
    assert!(report.notes.iter().any(|note| note.contains("points of the capture: 30, needed: 1000")), "{report}");
    let (as_many, report) = with_own_points(999);
    assert_eq!((as_many.points_origin, as_many.points.len()), (PointsOrigin::Capture, 999), "{report}");
    let (enough, report) = with_own_points(1000);
    assert!(enough.points_origin == PointsOrigin::Capture && enough.made_points.is_none(), "{report}");
}
