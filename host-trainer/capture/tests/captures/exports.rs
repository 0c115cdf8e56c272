//! Captures as telephones and NSVF export them, written from a fixture's photographs.

use glam::{DMat3, DQuat, DVec3};
use pocketsplat_capture::dataset::{Layout, LoadOptions};

use crate::fixture::{FOCAL_PX, Fixture, Kind, Photo, SIZE_PX, photograph};

/// Moves the photographs to another folder, `names` saying what the i-th is called there.
fn move_images(fixture: &Fixture, folder: &str, name: impl Fn(usize, &Photo) -> String) {
    std::fs::create_dir_all(fixture.at(folder)).expect("a folder");
    for (i, photo) in fixture.photos.iter().enumerate() {
        let to = fixture.at(folder).join(name(i, photo));
        std::fs::rename(fixture.at("images").join(&photo.name), to).expect("written");
    }
    std::fs::remove_dir(fixture.at("images")).expect("empty");
}

/// Camera to world by rows, OpenGL axes.
fn opengl(photo: &Photo) -> [[f64; 4]; 3] {
    rows(photo.rotation * DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)), photo.centre)
}

fn rows(rotation: DMat3, centre: DVec3) -> [[f64; 4]; 3] {
    let columns = rotation.to_cols_array_2d();
    [0, 1, 2].map(|i| [columns[0][i], columns[1][i], columns[2][i], centre[i]])
}

/// Polycam's raw export.
pub(crate) fn write_polycam(fixture: &Fixture, cameras: &str, images: &str) {
    move_images(fixture, &format!("keyframes/{images}"), |_, photo| photo.name.clone());
    let (width_px, height_px) = SIZE_PX;
    for photo in &fixture.photos {
        let numbers: Vec<String> = opengl(photo)
            .iter()
            .enumerate()
            .flat_map(|(i, row)| (0..4).map(move |j| format!("\"t_{i}{j}\": {:?}", row[j])))
            .collect();
        let text = format!(
            "{{\"fx\": {FOCAL_PX}, \"fy\": {FOCAL_PX}, \"cx\": 12.0, \"cy\": 8.0, \"width\": {width_px}, \
             \"height\": {height_px}, \"blur_score\": 90.5, {}}}",
            numbers.join(", ")
        );
        fixture.write(&format!("keyframes/{cameras}/{}.json", photo.name.trim_end_matches(".png")), text);
    }
}

/// Record3D's export, its pictures numbered from `first`.
pub(crate) fn write_record3d(fixture: &Fixture, metadata: &str, pictures: &str, first: usize) {
    move_images(fixture, pictures, |i, _| format!("{}.png", first + i));
    let poses: Vec<String> = fixture
        .photos
        .iter()
        .map(|photo| {
            let [x, y, z] = opengl(photo).map(|row| DVec3::new(row[0], row[1], row[2]));
            let q = DQuat::from_mat3(&DMat3::from_cols(x, y, z).transpose()) * photo.quaternion_length;
            let c = photo.centre;
            format!("[{:?}, {:?}, {:?}, {:?}, {:?}, {:?}, {:?}]", q.x, q.y, q.z, q.w, c.x, c.y, c.z)
        })
        .collect();
    let (width_px, height_px) = SIZE_PX;
    let text = format!(
        "{{\"w\": {width_px}, \"h\": {height_px}, \"fps\": 60, \"K\": [{FOCAL_PX}, 0, 0, 0, {FOCAL_PX}, 0, 12, 8, 1], \
         \"poses\": [{}]}}",
        poses.join(", ")
    );
    fixture.write(metadata, text);
}

/// A raw capture of NSVF; `name` gives the part of a name behind which the number stands.
pub(crate) fn write_nsvf(fixture: &Fixture, intrinsics: &str, prefix: fn(usize) -> &'static str) {
    move_images(fixture, "rgb", |i, _| format!("{}{i:04}.png", prefix(i)));
    fixture.write("intrinsics.txt", intrinsics);
    for (i, photo) in fixture.photos.iter().enumerate() {
        let [a, b, c] = rows(photo.rotation, photo.centre)
            .map(|row| row.iter().map(|number| format!("{number:e}")).collect::<Vec<_>>().join(" "));
        fixture.write(&format!("pose/{}{i:04}.txt", prefix(i)), format!("{a}\n{b}\n{c}\n0 0 0 1\n"));
    }
}

/// Metashape's cameras.xml, of a sensor of this type.
pub(crate) fn write_metashape(fixture: &Fixture, kind: &str) {
    let (width_px, height_px) = SIZE_PX;
    let camera = |(i, photo): (usize, &Photo)| {
        let numbers: Vec<String> =
            rows(photo.rotation, photo.centre).as_flattened().iter().map(|number| format!("{number:e}")).collect();
        format!(
            "<camera id=\"{i}\" sensor_id=\"4\" label=\"{}\"><transform>{} 0 0 0 1</transform></camera>",
            photo.name.trim_end_matches(".png"),
            numbers.join(" ")
        )
    };
    let cameras: String = fixture.photos.iter().enumerate().map(camera).collect();
    let text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<document version=\"2.0.0\"><chunk label=\"Chunk 1\">\n<sensors><sensor id=\"4\" \
         type=\"{kind}\"><resolution width=\"{width_px}\" height=\"{height_px}\"/><calibration class=\"initial\"><f>9</f></calibration>\
         <calibration class=\"adjusted\"><f>{FOCAL_PX}</f><cx>0</cx><cy>0</cy><b1>0</b1></calibration></sensor></sensors>\n\
         <cameras>{cameras}<camera id=\"99\" sensor_id=\"4\" label=\"never aligned\"/></cameras></chunk></document>"
    );
    fixture.write("cameras.xml", text);
}

/// RealityCapture's table of cameras.
pub(crate) fn write_realitycapture(fixture: &Fixture) {
    let line = |photo: &Photo| {
        let m = opengl(photo);
        // Of Rz(−heading)·Rx(pitch)·Ry(roll).
        let (heading, pitch, roll) = ((m[0][1]).atan2(m[1][1]), m[2][1].asin(), (-m[2][0]).atan2(m[2][2]));
        let [heading, pitch, roll] = [heading, pitch, roll].map(f64::to_degrees);
        let c = photo.centre;
        format!("{},{:?},{:?},{:?},{heading:?},{pitch:?},{roll:?},30,0,0,0,0,0,0,0,0\n", photo.name, c.x, c.y, c.z)
    };
    let head = "#cameras 9\n#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2\n";
    fixture.write("export.csv", format!("{head}{}", fixture.photos.iter().map(line).collect::<String>()));
}

/// LLFF's array, in numbers of this type.
pub(crate) fn write_llff(fixture: &Fixture, kind: &str, number: fn(f64) -> Vec<u8>) {
    let (width_px, height_px) = SIZE_PX;
    let hwf = [f64::from(height_px), f64::from(width_px), FOCAL_PX];
    let row = |photo: &Photo| {
        let matrix = opengl(photo).into_iter().zip(hwf).flat_map(|([r, u, b, c], last)| [-u, r, b, c, last]);
        matrix.chain([1.0, 9.0]).flat_map(number).collect::<Vec<u8>>()
    };
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}, 17), }}\n", fixture.photos.len());
    let start = [b"\x93NUMPY\x01\0".as_slice(), &(header.len() as u16).to_le_bytes(), header.as_bytes()].concat();
    let data: Vec<u8> = fixture.photos.iter().flat_map(row).collect();
    fixture.write("poses_bounds.npy", [start, data].concat());
}

/// Bundler's model, its list with focal lengths behind the names.
pub(crate) fn write_bundler(fixture: &Fixture) {
    let camera = |photo: &Photo| {
        let to_world = photo.rotation * DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
        let (r, t) = (to_world.transpose(), -(to_world.transpose() * photo.centre));
        let row = |i: usize| format!("{:?} {:?} {:?}\n", r.row(i).x, r.row(i).y, r.row(i).z);
        format!("{FOCAL_PX} 0 0\n{}{}{}{:?} {:?} {:?}\n", row(0), row(1), row(2), t.x, t.y, t.z)
    };
    let cameras: String = fixture.photos.iter().map(camera).collect();
    let none = "0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n";
    let point = |p: &DVec3| format!("{:?} {:?} {:?}\n9 9 9\n2 0 7 1.5 2.5 3 8 0.5 1.5\n", p.x, p.y, p.z);
    let points: String = fixture.points.iter().map(point).collect();
    let (n, n_points) = (fixture.photos.len() + 1, fixture.points.len());
    fixture.write("bundle.out", format!("# Bundle file v0.3\n{n} {n_points}\n{cameras}{none}{points}"));
    let names: String = fixture.photos.iter().map(|photo| format!("images/{} 0 812.5\n", photo.name)).collect();
    fixture.write("list.txt", names + "images/without_pose.png\n");
}

/// OpenSfM's reconstruction, behind a smaller one.
pub(crate) fn write_opensfm(fixture: &Fixture) {
    let (width_px, height_px) = SIZE_PX;
    let camera = |model: &str| {
        let focal = FOCAL_PX / f64::from(width_px);
        format!(
            "{{\"projection_type\": \"{model}\", \"width\": {width_px}, \"height\": {height_px}, \"focal\": {focal:?}, \"k1\": 0, \"k2\": 0.0}}"
        )
    };
    let shot = |photo: &Photo| {
        let (r, t) = (photo.rotation.transpose(), -(photo.rotation.transpose() * photo.centre));
        let axis = DQuat::from_mat3(&r).to_scaled_axis();
        let list = |v: DVec3| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
        format!(
            "\"{}\": {{\"camera\": \"v2\", \"rotation\": {}, \"translation\": {}}}",
            photo.name,
            list(axis),
            list(t)
        )
    };
    let shots: Vec<String> = fixture.photos.iter().map(shot).collect();
    let points = "\"7\": {\"coordinates\": [0.1, 0.2, 0.3], \"color\": [9, 9, 9]}";
    fixture.write(
        "reconstruction.json",
        format!(
            "[{{\"cameras\": {{}}, \"shots\": {{}}}}, {{\"cameras\": {{\"v2\": {}}}, \"shots\": {{{}}}, \"points\": {{{points}}}}}]",
            camera("perspective"),
            shots.join(", ")
        ),
    );
}

/// Intrinsics of the fixture as NSVF's matrix.
pub(crate) const NSVF_MATRIX: &str = "20.0 0 12.0 0\n0 20.0 8.0 0\n0 0 1 0\n0 0 0 1\n";

#[test]
fn exports_are_the_capture_that_they_were_made_from() {
    type Writer = (&'static str, fn(&Fixture));
    let reference = Fixture::new(Kind::ColmapBinary, 9).write_files().load().expect("a sound capture").0;
    let writers: [Writer; 13] = [
        ("Polycam", |f| write_polycam(f, "corrected_cameras", "corrected_images")),
        ("Polycam", |f| write_polycam(f, "cameras", "images")),
        ("Record3D", |f| write_record3d(f, "metadata", "rgbd", 0)),
        ("Record3D", |f| write_record3d(f, "metadata.json", "rgb", 1)),
        ("NSVF", |f| write_nsvf(f, NSVF_MATRIX, |_| "")),
        ("NSVF", |f| write_nsvf(f, "20.0 12.0 8.0 0.\n0. 0. 0.\n0.\n1.\n24 16\n", |_| "")),
        // A skew of rounding, and one of no sense, are still those of a matrix.
        ("NSVF", |f| write_nsvf(f, &NSVF_MATRIX.replacen("20.0 0 ", "20.0 3e-5 ", 1), |_| "")),
        ("NSVF", |f| write_nsvf(f, "20.0 -2 12.0\n0 20.0 8.0\n0 0 1\n", |_| "")),
        ("Metashape", |f| write_metashape(f, "frame")),
        ("RealityCapture", write_realitycapture),
        ("LLFF", |f| write_llff(f, "<f8", |number| number.to_le_bytes().to_vec())),
        ("Bundler", write_bundler),
        ("OpenSfM", write_opensfm),
    ];
    for (layout, write) in writers {
        let fixture = Fixture::new(Kind::Nerfstudio, 9);
        write(&fixture);
        let (capture, report) = fixture.load().unwrap_or_else(|error| panic!("{layout}: {error}"));
        assert_eq!(report.layout.to_string(), layout);
        assert_eq!((capture.train.len(), capture.test.len()), (7, 2), "{report}");
        assert_eq!(report.unposed, Vec::<String>::new());
        let is_coloured = matches!(report.layout, Layout::Bundler | Layout::OpenSfm);
        assert_eq!(capture.point_colours, vec![[9; 3]; if is_coloured { capture.points.len() } else { 0 }], "{layout}");
        for (a, b) in capture.train.iter().zip(&reference.train) {
            assert!(a.camera.rotation.abs_diff_eq(b.camera.rotation, 1e-12), "{layout} {}", a.name);
            assert!((a.camera.translation - b.camera.translation).length() < 1e-11, "{layout} {}", a.name);
            assert_eq!((a.camera.focal_px, a.camera.principal_px), (b.camera.focal_px, b.camera.principal_px));
            assert_eq!(photograph(a), photograph(b), "{layout} {}", a.name);
        }
    }
}

#[test]
fn files_that_a_mac_leaves_beside_others_are_passed_over() {
    let fixture = Fixture::new(Kind::Nerfstudio, 9);
    write_nsvf(&fixture, NSVF_MATRIX, |_| "");
    let hidden = "Mac OS X        \u{1}";
    fixture.write("pose/._0003.txt", hidden);
    fixture.write("rgb/._0003.png", hidden);
    let (capture, report) = fixture.load().expect("a sound capture");
    assert_eq!((capture.train.len() + capture.test.len(), report.unposed), (9, Vec::<String>::new()));
    let fixture = Fixture::new(Kind::Nerfstudio, 9);
    write_polycam(&fixture, "cameras", "images");
    fixture.write("keyframes/cameras/._p_03.json", hidden);
    assert_eq!(fixture.load().expect("a sound capture").0.train.len(), 7);
}

#[test]
fn options_that_a_layout_does_not_read_are_named() {
    let fixture = Fixture::new(Kind::Nerfstudio, 9);
    write_nsvf(&fixture, NSVF_MATRIX, |_| "");
    let options = LoadOptions { images: Some("rgb_2".to_owned()), model: Some(1), ..LoadOptions::default() };
    let said = fixture.load_with(&options).expect("a sound capture").1.to_string();
    for option in ["--images", "--model"] {
        assert!(said.contains(&format!("{option} has no effect on NSVF captures; leave it out")), "{said}");
    }
}

#[test]
fn names_of_nsvf_give_the_split() {
    let n_views = |prefix: fn(usize) -> &'static str| {
        let fixture = Fixture::new(Kind::Nerfstudio, 9);
        write_nsvf(&fixture, NSVF_MATRIX, prefix);
        let (capture, report) = fixture.load().expect("a sound capture");
        (capture.train.len(), capture.test.len(), report.to_string().contains("views for validation, not used: 2"))
    };
    assert_eq!(n_views(|i| ["0_", "1_", "2_"][i % 4 % 3]), (5, 2, true));
    assert_eq!(n_views(|i| if i < 6 { "0_" } else { "1_" }), (6, 3, false));
}

#[test]
fn numbers_of_llff_may_be_short_or_the_other_way_round() {
    let short: (&str, fn(f64) -> Vec<u8>) = ("<f4", |number| (number as f32).to_le_bytes().to_vec());
    let big: (&str, fn(f64) -> Vec<u8>) = (">f8", |number| number.to_be_bytes().to_vec());
    for (kind, number) in [short, big] {
        let fixture = Fixture::new(Kind::Nerfstudio, 9);
        write_llff(&fixture, kind, number);
        let capture = fixture.load().unwrap_or_else(|error| panic!("{kind}: {error}")).0;
        assert_eq!(capture.train[0].camera.focal_px, [FOCAL_PX; 2], "{kind}");
    }
    let fixture = Fixture::new(Kind::Nerfstudio, 9);
    write_llff(&fixture, "<f8", |number| number.to_le_bytes().to_vec());
    fixture.remove("images/p_03.png");
    let error = fixture.load().expect_err("8 images of 9 poses").to_string();
    assert!(error.contains("9 poses, but `") && error.contains("` holds 8 images, needed: as many"), "{error}");
}

#[test]
fn a_lens_of_metashape_is_read_as_its_manual_says() {
    let fixture = Fixture::new(Kind::Nerfstudio, 9);
    write_metashape(&fixture, "frame");
    let text = std::fs::read_to_string(fixture.at("cameras.xml")).expect("written");
    let lens = "<cx>1</cx><cy>-0.5</cy><b1>0.5</b1><k1>0.3</k1><k2>0.1</k2><p1>-0.02</p1><p2>0.01</p2>";
    fixture.write("cameras.xml", text.replace("<cx>0</cx><cy>0</cy><b1>0</b1>", lens));
    let capture = fixture.load().expect("a sound capture").0;
    let camera = &capture.train[0].camera;
    assert_eq!((camera.focal_px, camera.principal_px), ([20.5, 20.0], [13.0, 7.5]));
    let mut colmap = Fixture::new(Kind::ColmapText, 9);
    colmap.cameras[0].model = (4, "OPENCV");
    colmap.cameras[0].parameters = vec![20.5, 20.0, 13.0, 7.5, 0.3, 0.1, 0.01, -0.02];
    let expected = colmap.write_files().load().expect("a sound capture").0;
    assert_eq!(photograph(&capture.train[0]), photograph(&expected.train[0]), "p1 and p2 change places");
}

#[test]
fn cameras_of_metashape_that_are_none_are_named() {
    let fixture = Fixture::new(Kind::Nerfstudio, 9);
    write_metashape(&fixture, "spherical");
    let error = fixture.load().expect_err("no frame cameras").to_string();
    assert!(error.contains("its camera model is `spherical of Metashape`, needed: PINHOLE"), "{error}");
    let empty = "<?xml version=\"1.0\"?>\n<document version=\"2.0.0\"><chunk><sensors/><cameras/></chunk></document>";
    fixture.write("cameras.xml", empty);
    let error = fixture.load().expect_err("no cameras").to_string();
    for part in [
        "cameras.xml` is a file of cameras of Metashape, but none of its 0 cameras has a pose",
        "ns-process-data metashape --data ",
    ] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_focal_length_without_a_size_is_for_photographs_of_full_size() {
    let write: [fn(&Fixture); 2] = [write_bundler, |f| {
        f.write_files();
        let text = std::fs::read_to_string(f.at("transforms.json")).expect("written");
        let kept = text.lines().map(|line| {
            let is_size =
                |part: &&str| part.trim_start().starts_with("\"w\"") || part.trim_start().starts_with("\"h\"");
            line.split(',').filter(|part| !is_size(part)).collect::<Vec<_>>().join(",")
        });
        f.write("transforms.json", kept.collect::<Vec<_>>().join("\n"));
    }];
    for write in write {
        let fixture = Fixture::new(Kind::Nerfstudio, 9);
        write(&fixture);
        let focal = |options: &LoadOptions| fixture.load_with(options).expect("sound").0.train[0].camera.focal_px[0];
        let full = focal(&LoadOptions::default());
        let (width_px, height_px) = SIZE_PX;
        for photo in &fixture.photos {
            fixture.write_image(&format!("images_2/{}", photo.name), (width_px / 2, height_px / 2));
        }
        let half = focal(&LoadOptions { images: Some("images_2".to_owned()), ..LoadOptions::default() });
        assert!((half - 0.5 * full).abs() < 1e-9, "{half} of {full}");
    }
}

#[test]
fn the_fisheye_lens_of_opensfm_has_four_coefficients() {
    let pixels = |k4: f64| {
        let fixture = Fixture::new(Kind::Nerfstudio, 9);
        write_opensfm(&fixture);
        let text = std::fs::read_to_string(fixture.at("reconstruction.json")).expect("written");
        let lens = format!("\"projection_type\": \"fisheye_opencv\", \"k4\": {k4:?}");
        fixture.write("reconstruction.json", text.replace("\"projection_type\": \"perspective\"", &lens));
        photograph(&fixture.load().expect("sound").0.train[0]).image.rgb.clone()
    };
    assert_ne!(pixels(0.0), pixels(9.0));
}
