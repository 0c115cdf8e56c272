//! Remedies for files of nerfstudio and Blender.

use super::*;

#[test]
fn remedies_for_transforms() {
    check_all(&[
        trouble("degrees", Blender, |f| {
            f.shared = "\"camera_angle_x\": 50".to_owned();
            f.write_files();
        })
        .remedy("convert it if it is in degrees", |f, _| {
            f.shared = format!("\"camera_angle_x\": {}", 50_f64.to_radians());
            f.write_files();
            again(f)
        }),
        trouble("no focal length", Nerfstudio, |f| {
            f.shared = "\"w\": 24, \"h\": 16".to_owned();
            f.write_files();
        })
        .remedy("give the focal length in pixels", |f, _| {
            f.shared.push_str(&format!(", \"fl_x\": {FOCAL_PX}"));
            f.write_files();
            again(f)
        }),
        trouble("no frames", Nerfstudio, |f| {
            f.write("transforms.json", "{\"fl_x\": 20}");
        })
        .remedy("`frames`, each frame with `file_path` and a `transform_matrix`", |f, _| {
            f.write_files();
            again(f)
        }),
        trouble("a web page", Nerfstudio, |f| {
            f.write("transforms.json", "<!DOCTYPE html>");
        })
        .remedy("it is a web page: the download failed: fetch the file itself again", |f, _| {
            f.write_files();
            again(f)
        }),
        trouble("a missing height", Nerfstudio, |f| {
            f.shared = "\"fl_x\": 40, \"cx\": 24, \"cy\": 24, \"w\": 48".to_owned();
            f.write_files();
        })
        .remedy("needed: `h`; correct the camera's numbers", |f, _| {
            f.shared = "\"fl_x\": 40, \"cx\": 24, \"cy\": 16, \"w\": 48, \"h\": 32".to_owned();
            f.write_files();
            again(f)
        }),
        trouble("another size", Nerfstudio, |f| {
            f.shared = "\"fl_x\": 40, \"cx\": 24, \"cy\": 16".to_owned();
            f.write_files();
        })
        .remedy("needed: `w` and `h`", |f, _| {
            f.shared.push_str(", \"w\": 48, \"h\": 32");
            f.write_files();
            again(f)
        }),
        trouble("a focal length and a field of view that differ", Nerfstudio, |f| {
            f.shared.push_str(", \"camera_angle_x\": 0.5");
            f.write_files();
        })
        .remedy("needed: numbers that agree, or one of them", |f, _| {
            f.shared = f.shared.replace(", \"camera_angle_x\": 0.5", "");
            f.write_files();
            again(f)
        }),
        trouble("a size of its own", Nerfstudio, |f| {
            f.photos[3].extra = "\"w\": 48, \"h\": 32, ".to_owned();
            f.write_files();
        })
        .remedy("needed: `fl_x`, `fl_y`, `cx` and `cy` of its own", |f, _| {
            f.photos[3].extra.push_str("\"fl_x\": 40, \"fl_y\": 40, \"cx\": 24, \"cy\": 16, ");
            f.write_files();
            again(f)
        }),
        trouble("axes of OpenCV", Nerfstudio, |f| {
            let turned = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
            f.photos.iter_mut().for_each(|photo| photo.rotation *= turned);
            f.write_files();
        })
        .remedy("turn the signs of the second and third column", |f, _| {
            // In the file alone, as a person does it.
            let mut json: serde_json::Value =
                serde_json::from_slice(&std::fs::read(f.at("transforms.json")).expect("written")).expect("JSON");
            for frame in json["frames"].as_array_mut().expect("a list") {
                for row in frame["transform_matrix"].as_array_mut().expect("rows").iter_mut().take(3) {
                    for column in [1, 2] {
                        row[column] = (-row[column].as_f64().expect("a number")).into();
                    }
                }
            }
            f.write("transforms.json", json.to_string());
            again(f)
        }),
        trouble("points that are not there", Nerfstudio, |f| {
            f.shared.push_str(", \"ply_file_path\": \"sparse.ply\"");
            f.write_files();
        })
        .remedy("or take `ply_file_path` out", |f, _| {
            replace(f, "transforms.json", ", \"ply_file_path\": \"sparse.ply\"", "");
            again(f)
        }),
        trouble("points that are none", Nerfstudio, |f| {
            f.shared.push_str(", \"ply_file_path\": \"sparse.ply\"");
            f.write_files().write("sparse.ply", "solid cube");
        })
        .remedy("or take `ply_file_path` out, and training makes points", |f, _| {
            replace(f, "transforms.json", ", \"ply_file_path\": \"sparse.ply\"", "");
            again(f)
        }),
        trouble("a focal length of pixels that are no squares", Nerfstudio, |f| {
            f.shared = "\"fl_x\": 20, \"fl_y\": 60".to_owned();
            f.write_files();
        })
        .remedy("check the focal lengths (fl_x and fl_y)", |f, _| {
            f.shared = "\"fl_x\": 20, \"fl_y\": 20".to_owned();
            f.write_files();
            again(f)
        }),
    ]);
}
