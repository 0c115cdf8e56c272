//! Captures as telephones and NSVF export them, written from a fixture's photographs.

use glam::{DMat3, DQuat, DVec3};
use pocketsplat_capture::dataset::LoadOptions;

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

/// Intrinsics of the fixture as NSVF's matrix.
pub(crate) const NSVF_MATRIX: &str = "20.0 0 12.0 0\n0 20.0 8.0 0\n0 0 1 0\n0 0 0 1\n";

#[test]
fn exports_are_the_capture_that_they_were_made_from() {
    type Writer = (&'static str, fn(&Fixture));
    let reference = Fixture::new(Kind::ColmapBinary, 9).write_files().load().expect("a sound capture").0;
    let writers: [Writer; 6] = [
        ("Polycam", |f| write_polycam(f, "corrected_cameras", "corrected_images")),
        ("Polycam", |f| write_polycam(f, "cameras", "images")),
        ("Record3D", |f| write_record3d(f, "metadata", "rgbd", 0)),
        ("Record3D", |f| write_record3d(f, "metadata.json", "rgb", 1)),
        ("NSVF", |f| write_nsvf(f, NSVF_MATRIX, |_| "")),
        ("NSVF", |f| write_nsvf(f, "20.0 12.0 8.0 0.\n0. 0. 0.\n0.\n1.\n24 16\n", |_| "")),
    ];
    for (layout, write) in writers {
        let fixture = Fixture::new(Kind::Nerfstudio, 9);
        write(&fixture);
        let (capture, report) = fixture.load().unwrap_or_else(|error| panic!("{layout}: {error}"));
        assert_eq!(report.layout.to_string(), layout);
        assert_eq!((capture.train.len(), capture.test.len()), (7, 2), "{report}");
        assert_eq!(report.unposed, Vec::<String>::new());
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
