//! Transforms files that are damaged, or say what no view can be made of.

use super::Harm::{Doubt, Fatal};
use super::{Case, case, cut};
use crate::fixture::Kind::{Blender, Nerfstudio};

pub(super) fn cases() -> Vec<Case> {
    vec![
        case(
            "not JSON",
            Nerfstudio,
            Fatal,
            "bad-transforms",
            &["transforms.json` is not a transforms file: expected value at line 1 column 1; it needs"],
            |f| f.write("transforms.json", "<html>"),
        ),
        case("JSON cut", Blender, Fatal, "bad-transforms", &["EOF while parsing", "at line 2 column"], |f| {
            cut(f.write_files(), "transforms_train.json", 300);
        }),
        case("no frames", Nerfstudio, Fatal, "bad-transforms", &["missing field `frames`"], |f| {
            f.write("transforms.json", "{\"fl_x\": 20}");
        }),
        case(
            "no focal length",
            Nerfstudio,
            Fatal,
            "bad-intrinsics",
            &["neither `fl_x` nor `camera_angle_x` is a number", "`images/p_00.png`"],
            |f| {
                f.shared = "\"w\": 24, \"h\": 16".to_owned();
                f.write_files();
            },
        ),
        case(
            "degrees for radians",
            Blender,
            Fatal,
            "bad-intrinsics",
            &["`camera_angle_x` is 50, needed", "convert it if it is in degrees"],
            |f| {
                f.shared = "\"camera_angle_x\": 50".to_owned();
                f.write_files();
            },
        ),
        case(
            "a panorama",
            Nerfstudio,
            Fatal,
            "camera-model",
            &["all frames has the camera model `EQUIRECTANGULAR`", "undistort the capture first"],
            |f| {
                f.shared.push_str(", \"camera_model\": \"EQUIRECTANGULAR\"");
                f.write_files();
            },
        ),
        case(
            "no frame in any split",
            Nerfstudio,
            Fatal,
            "too-few-views",
            &["0 of 0 training views can be used, needed: at least 3"],
            |f| {
                f.shared.push_str(", \"train_filenames\": [\"p_01.png\"]");
                f.write_files();
            },
        ),
        case(
            "a point cloud missing",
            Nerfstudio,
            Doubt,
            "missing-points",
            &[
                "warning[missing-points]: `ply_file_path` names `",
                "sparse.ply`, which does not exist, so training starts from random points",
                "remedy: restore the point cloud for a better start, or take `ply_file_path` out",
            ],
            |f| {
                f.shared.push_str(", \"ply_file_path\": \"sparse.ply\"");
                f.write_files();
            },
        ),
        case(
            "a point cloud that is none",
            Nerfstudio,
            Fatal,
            "bad-points",
            &["sparse.ply` does not start with `ply`; write it again"],
            |f| {
                f.shared.push_str(", \"ply_file_path\": \"sparse.ply\"");
                f.write_files().write("sparse.ply", "solid cube");
            },
        ),
    ]
}
