//! Captures without a fault load, and the same one in different layouts loads as the same.

use glam::DVec3;
use pocketsplat_capture::dataset::{Capture, Layout, LoadOptions, PointsOrigin, Split};

use crate::fixture::{FOCAL_PX, Fixture, Kind, SIZE_PX, photo, photograph};

fn loaded(kind: Kind) -> Capture {
    Fixture::new(kind, 17).write_files().load().expect("a sound capture").0
}

fn names(views: &[pocketsplat_capture::dataset::View]) -> Vec<&str> {
    views.iter().map(|view| view.name.trim_start_matches("images/")).collect()
}

#[test]
fn one_capture_in_every_layout_is_the_same_capture() {
    let reference = loaded(Kind::ColmapBinary);
    assert_eq!(names(&reference.test), ["p_00.png", "p_08.png", "p_16.png"]);
    assert_eq!((reference.train.len(), reference.points_origin), (14, PointsOrigin::Capture));
    for kind in [Kind::ColmapText, Kind::Nerfstudio, Kind::Blender] {
        let capture = loaded(kind);
        assert_eq!(names(&capture.train), names(&reference.train), "{kind:?}");
        assert_eq!(names(&capture.test), names(&reference.test), "{kind:?}");
        for (a, b) in capture.train.iter().zip(&reference.train) {
            assert!(a.camera.rotation.abs_diff_eq(b.camera.rotation, 1e-12), "{kind:?} {}", a.name);
            assert!((a.camera.translation - b.camera.translation).length() < 1e-11, "{kind:?} {}", a.name);
            assert!((a.camera.focal_px[0] - b.camera.focal_px[0]).abs() < 1e-12, "{kind:?} {}", a.name);
            assert_eq!(a.camera.principal_px, b.camera.principal_px, "{kind:?} {}", a.name);
            assert!(!a.has_mask());
            // Blender's images carry alpha 200 of 255.
            if kind != Kind::Blender {
                assert_eq!(photograph(a).image, photograph(b).image, "{kind:?} {}", a.name);
            }
        }
        if kind == Kind::ColmapText {
            assert_eq!(capture.points, reference.points);
        } else {
            assert_eq!((capture.points.len(), capture.points_origin), (10_000, PointsOrigin::Random), "{kind:?}");
        }
    }
}

#[test]
fn a_name_of_one_byte_a_letter_is_read_too() {
    let mut fixture = Fixture::new(Kind::ColmapBinary, 9);
    fixture.photos[3].name = "p_03ü.png".to_owned();
    std::fs::rename(fixture.at("images/p_03.png"), fixture.at("images/p_03ü.png")).expect("written");
    fixture.write_files();
    let model = fixture.at("sparse/0/images.bin");
    let bytes = std::fs::read(&model).expect("written");
    let at = bytes.windows(2).position(|two| two == "ü".as_bytes()).expect("its name");
    std::fs::write(&model, [&bytes[..at], &[0xFC], &bytes[at + 2..]].concat()).expect("a file");
    let (capture, report) = fixture.load().expect("a sound capture");
    assert_eq!((capture.train.len() + capture.test.len(), report.skipped.len()), (9, 0));
}

#[test]
fn points_and_cameras_share_one_frame() {
    let fixture = Fixture::new(Kind::ColmapBinary, 9);
    let (capture, report) = fixture.write_files().load().expect("a sound capture");
    assert_eq!((report.layout, report.n_points, report.skipped.len()), (Layout::Colmap, 20, 0), "{report}");
    for (world, normalised) in fixture.points.iter().zip(&capture.points) {
        assert!((capture.normalisation.point(*world) - *normalised).length() < 1e-12);
    }
    assert_eq!(capture.point_colours, [[200, 100, 50]; 20]);
    for view in &capture.train {
        let origin = view.camera.rotation * capture.normalisation.point(DVec3::ZERO) + view.camera.translation;
        assert!((origin - DVec3::Z * 4.0 * capture.normalisation.scale).length() < 1e-9, "{}: {origin}", view.name);
    }
    // The points stand 0.1 apart.
    let expected = 0.1 * capture.normalisation.scale;
    assert!(capture.suggested_voxel_size() >= expected && capture.suggested_voxel_size() < 1.2 * expected);
}

#[test]
fn missing_images_do_not_move_the_split() {
    let fixture = Fixture::new(Kind::ColmapText, 17);
    fixture.write_files().remove("images/p_01.png");
    fixture.remove("images/p_08.png");
    fixture.write_image("images/extra/unposed.png", SIZE_PX);
    let (capture, report) = fixture.load().expect("most views are there");
    assert_eq!(names(&capture.test), ["p_00.png", "p_16.png"]);
    let skipped: Vec<_> = report.skipped.iter().map(|view| (view.split, view.name.as_str())).collect();
    assert_eq!(skipped, [(Split::Train, "p_01.png"), (Split::Test, "p_08.png")]);
    assert_eq!(report.unposed, ["extra/unposed.png"]);
    let fifth = fixture.load_with(&LoadOptions { test_every: 5, ..LoadOptions::default() }).expect("a capture").0;
    assert_eq!(names(&fifth.test), ["p_00.png", "p_05.png", "p_10.png", "p_15.png"]);
    let none = fixture.load_with(&LoadOptions { test_every: 0, ..LoadOptions::default() }).expect("a capture");
    assert!(none.0.test.is_empty() && none.1.to_string().contains("no test views, so test PSNR"), "{}", none.1);
}

#[test]
fn intrinsics_follow_the_pixels_of_the_folder_that_is_read() {
    for kind in [Kind::ColmapBinary, Kind::Nerfstudio] {
        let fixture = Fixture::new(kind, 9);
        fixture.write_files();
        for photo in &fixture.photos {
            fixture.write_image(&format!("images_2/{}", photo.name), (12, 8));
        }
        let options = LoadOptions { images: Some("images_2".to_owned()), ..LoadOptions::default() };
        let camera = fixture.load_with(&options).expect("a capture").0.train[0].camera.clone();
        assert_eq!((camera.width_px, camera.focal_px, camera.principal_px), (12, [10.0; 2], [6.0, 4.0]), "{kind:?}");
        let full = fixture.load().expect("a capture");
        assert_eq!(full.0.train[0].camera.width_px, 24, "`images` comes first");
        if kind == Kind::ColmapBinary {
            assert!(full.1.to_string().contains("although `images_2` is there, too"), "{}", full.1);
        }
        std::fs::remove_dir_all(fixture.at("images")).expect("it was made");
        let only = fixture.load().expect("the only folder of images is taken").0;
        assert_eq!(only.train[0].camera.width_px, 12, "{kind:?}");
    }
}

#[test]
fn every_camera_model_reads_its_parameters_in_order() {
    let cases: [(_, &[f64], [f64; 2], bool); 9] = [
        ((0, "SIMPLE_PINHOLE"), &[21.0, 11.0, 7.0], [21.0, 21.0], false),
        ((1, "PINHOLE"), &[21.0, 22.0, 11.0, 7.0], [21.0, 22.0], false),
        ((2, "SIMPLE_RADIAL"), &[21.0, 11.0, 7.0, 0.3], [21.0, 21.0], true),
        ((3, "RADIAL"), &[21.0, 11.0, 7.0, 0.3, 0.1], [21.0, 21.0], true),
        ((4, "OPENCV"), &[21.0, 22.0, 11.0, 7.0, 0.3, 0.1, 0.01, -0.02], [21.0, 22.0], true),
        ((5, "OPENCV_FISHEYE"), &[21.0, 22.0, 11.0, 7.0, 0.9, 0.1, 0.1, 0.1], [21.0, 22.0], true),
        ((6, "FULL_OPENCV"), &[21.0, 22.0, 11.0, 7.0, 0.3, 0.1, 0.01, -0.02, 0.1, -0.1, 0.0, 0.0], [21.0, 22.0], true),
        ((8, "SIMPLE_RADIAL_FISHEYE"), &[21.0, 11.0, 7.0, 0.0], [21.0, 21.0], false),
        ((9, "RADIAL_FISHEYE"), &[21.0, 11.0, 7.0, 0.9, 0.5], [21.0, 21.0], true),
    ];
    for kind in [Kind::ColmapBinary, Kind::ColmapText] {
        for (model, parameters, focal_px, is_distorted) in cases {
            let mut fixture = Fixture::new(kind, 9);
            fixture.cameras[0].model = model;
            fixture.cameras[0].parameters = parameters.to_vec();
            let (capture, report) = fixture.write_files().load().expect("a capture");
            let view = &capture.train[0];
            assert_eq!((view.camera.focal_px, view.camera.principal_px), (focal_px, [11.0, 7.0]), "{}", model.1);
            // Pincushion distortion leaves the corners of the pinhole image without a source.
            assert_eq!(view.has_mask(), is_distorted, "{}", model.1);
            if let Some(mask) = &photograph(view).mask {
                assert!(!mask.valid[0] && mask.valid[8 * 24 + 12], "{}", model.1);
                assert!(report.to_string().contains("pixels that do not count"), "{report}");
            }
        }
    }
}

#[test]
fn a_fisheye_is_one_however_it_is_said() {
    let mut colmap = Fixture::new(Kind::ColmapBinary, 9);
    colmap.cameras[0].model = (5, "OPENCV_FISHEYE");
    colmap.cameras[0].parameters = vec![20.0, 20.0, 12.0, 8.0, 0.02, -0.01, 0.001, -0.001];
    let expected = colmap.write_files().load().expect("a capture").0;
    let pinhole = loaded(Kind::ColmapBinary);
    assert_ne!(photograph(&expected.train[0]), photograph(&pinhole.train[0]), "undistorted");
    for said in ["\"camera_model\": \"OPENCV_FISHEYE\"", "\"is_fisheye\": true, \"camera_model\": \"opencv_fisheye\""] {
        let mut fixture = Fixture::new(Kind::Nerfstudio, 9);
        fixture.shared.push_str(", \"k1\": 0.02, \"k2\": -0.01, \"k3\": 0.001, \"k4\": -0.001, ");
        fixture.shared.push_str(said);
        let capture = fixture.write_files().load().expect("a capture").0;
        for (a, b) in capture.train.iter().zip(&expected.train) {
            assert_eq!(photograph(a).image, photograph(b).image, "{said}: {}", a.name);
        }
    }
}

#[test]
fn a_rational_lens_is_one_however_it_is_said() {
    let mut colmap = Fixture::new(Kind::ColmapText, 9);
    colmap.cameras[0].model = (6, "FULL_OPENCV");
    colmap.cameras[0].parameters = vec![20.0, 20.0, 12.0, 8.0, 0.3, 0.2, 0.01, -0.02, 0.1, 0.4, 0.3, 0.2];
    let expected = colmap.write_files().load().expect("a capture").0;
    let mut fixture = Fixture::new(Kind::Nerfstudio, 9);
    fixture.shared.push_str(
        ", \"camera_model\": \"FULL_OPENCV\", \"k1\": 0.3, \"k2\": 0.2, \"p1\": 0.01, \"p2\": -0.02, \"k3\": 0.1, \
         \"k4\": 0.4, \"k5\": 0.3, \"k6\": 0.2",
    );
    let capture = fixture.write_files().load().expect("a capture").0;
    for (a, b) in capture.train.iter().zip(&expected.train) {
        assert_eq!(photograph(a).image, photograph(b).image, "{}", a.name);
    }
    assert_ne!(photograph(&expected.train[0]), photograph(&loaded(Kind::ColmapText).train[0]), "undistorted");
}

#[test]
fn the_largest_model_is_read_or_the_one_asked_for() {
    let mut fixture = Fixture::new(Kind::ColmapText, 9);
    fixture.write_files();
    std::fs::rename(fixture.at("sparse/0"), fixture.at("sparse/10")).expect("a model");
    fixture.photos.truncate(5);
    fixture.write_files();
    let n_views = |model| {
        let capture = fixture.load_with(&LoadOptions { model, ..LoadOptions::default() }).expect("a capture").0;
        capture.train.len() + capture.test.len()
    };
    assert_eq!((n_views(None), n_views(Some(0)), n_views(Some(10))), (9, 5, 9));
}

#[test]
fn a_lens_per_image_is_kept_apart() {
    let mut fixture = Fixture::new(Kind::ColmapBinary, 9);
    for i in 1..9_u32 {
        let mut camera = fixture.cameras[0].clone();
        (camera.id, camera.parameters[0]) = (i + 1, FOCAL_PX + f64::from(i));
        fixture.cameras.push(camera);
        fixture.photos[i as usize].camera_id = i + 1;
    }
    fixture.photos[5].camera_id = 40;
    fixture.cameras.push(crate::fixture::Camera { id: 40, size_px: (10, 30), ..fixture.cameras[0].clone() });
    fixture.write_image("images/p_05.png", (10, 30));
    let (capture, report) = fixture.write_files().load().expect("a capture");
    let focals: Vec<f64> = capture.train.iter().map(|view| view.camera.focal_px[0]).collect();
    assert_eq!(focals, [21.0, 22.0, 23.0, 24.0, 20.0, 26.0, 27.0]);
    assert_eq!(report.n_sizes, 2);
    let options = LoadOptions { max_resolution: Some(15), ..LoadOptions::default() };
    let small = fixture.load_with(&options).expect("a capture").0;
    let sizes: Vec<_> = small.train.iter().map(|view| (view.camera.width_px, view.camera.height_px)).collect();
    assert_eq!((sizes[0], sizes[4]), ((15, 10), (5, 15)), "the larger side of each is reduced");
}

#[test]
fn frames_override_shared_intrinsics_and_name_their_split() {
    let mut fixture = Fixture::new(Kind::Nerfstudio, 6);
    fixture.shared.push_str(
        ", \"cx\": 11.5, \"train_filenames\": [\"./images/p_00.png\", \"images/p_01.png\", \"images/p_02.png\", \
         \"images/p_09.png\"], \"val_filenames\": [\"images/p_04.png\"], \"test_filenames\": [\"images/p_03.png\"]",
    );
    fixture.photos[1].extra = "\"fl_x\": 30, \"cy\": 7.0, \"k1\": 0.0, ".to_owned();
    let (capture, report) = fixture.write_files().load().expect("a capture");
    assert_eq!(names(&capture.train), ["p_00.png", "p_01.png", "p_02.png"]);
    assert_eq!(names(&capture.test), ["p_03.png"]);
    let [shared, own] = [&capture.train[0].camera, &capture.train[1].camera];
    assert_eq!((shared.focal_px, shared.principal_px), ([20.0; 2], [11.5, 8.0]));
    assert_eq!((own.focal_px[0], own.principal_px), (30.0, [11.5, 7.0]));
    let text = report.to_string();
    for part in ["`val_filenames`, not used: 1", "left out: 2", "that no frame has: 1"] {
        assert!(text.contains(part), "{part} is not in {text}");
    }
}

#[test]
fn the_field_of_view_stands_in_for_the_focal_length() {
    let mut fixture = Fixture::new(Kind::Nerfstudio, 9);
    fixture.shared = format!("\"camera_angle_x\": {:?}", 2.0 * (12.0_f64 / 25.0).atan());
    let camera = fixture.write_files().load().expect("a capture").0.train[0].camera.clone();
    assert!((camera.focal_px[0] - 25.0).abs() < 1e-9 && (camera.focal_px[1] - 25.0).abs() < 1e-9, "{camera:?}");
}

#[test]
fn a_point_cloud_and_masks_beside_transforms_are_read() {
    let mut fixture = Fixture::new(Kind::Nerfstudio, 9);
    fixture.shared.push_str(", \"ply_file_path\": \"cloud.ply\"");
    fixture.write(
        "cloud.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n\
         0 0 0\n1 0 0\nnan 0 0\n",
    );
    fixture.photos[3].extra = "\"mask_path\": \"masks/p_03.png\", ".to_owned();
    let (width_px, height_px) = SIZE_PX;
    let left_half: Vec<u8> = (0..width_px * height_px).map(|i| if i % width_px < 12 { 0 } else { 255 }).collect();
    std::fs::create_dir(fixture.at("masks")).expect("a folder");
    image::save_buffer(fixture.at("masks/p_03.png"), &left_half, width_px, height_px, image::ExtendedColorType::L8)
        .expect("an image");
    let (capture, report) = fixture.write_files().load().expect("a capture");
    assert_eq!(capture.points, [DVec3::ZERO, DVec3::X].map(|p| capture.normalisation.point(p)));
    assert!(capture.point_colours.is_empty());
    assert!(report.to_string().contains("points left out: 1 of 3"), "{report}");
    let masked = capture.train.iter().find(|view| view.name.ends_with("p_03.png")).map(photograph).expect("a view");
    assert_eq!(masked.mask.as_ref().map(|mask| mask.n_valid()), Some(12 * 16));
}

#[test]
fn a_point_cloud_that_transforms_train_names_is_read() {
    let mut fixture = Fixture::new(Kind::Blender, 9);
    fixture.shared.push_str(", \"ply_file_path\": \"cloud.ply\"");
    fixture.write(
        "cloud.ply",
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n1 0 0\n",
    );
    let capture = fixture.write_files().load().expect("a capture").0;
    assert_eq!(capture.points, [DVec3::ZERO, DVec3::X].map(|p| capture.normalisation.point(p)));
}

#[test]
fn held_out_views_that_cannot_be_used_are_counted() {
    let fixture = Fixture::new(Kind::ColmapText, 12);
    fixture.write_files();
    ["images/p_00.png", "images/p_08.png"].iter().for_each(|name| fixture.write(name, "cut"));
    let report = fixture.load().expect("a capture").1.to_string();
    assert!(
        report.contains("views that are held out and cannot be used: 2; repair them, or hold out others"),
        "{report}"
    );
}

#[test]
fn random_points_surround_what_the_cameras_look_at() {
    let mut fixture = Fixture::new(Kind::Nerfstudio, 12);
    let target = DVec3::new(50.0, -20.0, 7.0);
    fixture.photos = (0..12).map(|i| photo(i, target)).collect();
    let capture = fixture.write_files().load().expect("a capture").0;
    let seen = |point: &DVec3| {
        let cameras = capture.train.iter().filter(|view| {
            let cam = view.camera.rotation * *point + view.camera.translation;
            let u = view.camera.focal_px[0] * cam.x / cam.z + view.camera.principal_px[0];
            let v = view.camera.focal_px[1] * cam.y / cam.z + view.camera.principal_px[1];
            cam.z > 0.0 && (0.0..=24.0).contains(&u) && (0.0..=16.0).contains(&v)
        });
        cameras.count()
    };
    let n_unseen = capture.points.iter().filter(|point| seen(point) == 0).count();
    assert!(n_unseen * 10 < capture.points.len(), "{n_unseen} of {} points are in no image", capture.points.len());
}
