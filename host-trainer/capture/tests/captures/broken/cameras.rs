//! Views whose cameras cannot be used: left out where enough others are sound.

use glam::DVec3;

use super::Harm::{Fatal, Views};
use super::{Case, case, edit};
use crate::exports::{NSVF_MATRIX, write_nsvf, write_polycam, write_record3d};
use crate::fixture::Camera;
use crate::fixture::Kind::{ColmapBinary, ColmapText, Nerfstudio};

pub(super) fn cases() -> Vec<Case> {
    vec![
        case("a camera far away", ColmapBinary, Views, "pose-outlier", |f| {
            f.photos[7].centre *= 100.0;
            f.write_files();
        })
        .says(&[
            "p_07.png: its camera stands",
            "times as far from the middle of all as half of them do",
            "take the view out",
        ]),
        case("test views of another reconstruction", Nerfstudio, Views, "pose-outlier", |f| {
            for i in [0, 8] {
                f.photos[i].centre += DVec3::X * 1e4;
            }
            f.write_files();
        })
        .says(&["test views left out: 2", "images/p_08.png: its camera stands"]),
        case("a moment of Polycam without a lens", Nerfstudio, Views, "bad-intrinsics", |f| {
            write_polycam(f, "cameras", "images");
            edit(f, "keyframes/cameras/p_04.json", |text| text.replace("\"fx\"", "\"focal\""));
        })
        .says(&["p_04: the focal length is NaN px, needed: a positive number"]),
        case("a moment of Polycam without a pose", Nerfstudio, Views, "bad-pose", |f| {
            write_polycam(f, "cameras", "images");
            edit(f, "keyframes/cameras/p_04.json", |text| text.replace("t_12", "t_99"));
        })
        .says(&["p_04: `transform_matrix` has NaN in row 1, column 2"]),
        case("a pose of NSVF cut", Nerfstudio, Views, "bad-pose", |f| {
            write_nsvf(f, NSVF_MATRIX, |_| "");
            edit(f, "pose/0004.txt", |text| text.lines().take(2).collect::<Vec<_>>().join("\n"));
        })
        .says(&["0004: `transform_matrix` has 2 rows, the shortest of 4 numbers, needed: 4 rows of 4"]),
        case("a camera that is not there", ColmapText, Views, "missing-camera", |f| {
            f.photos[2].camera_id = 9;
            f.write_files();
        })
        .says(&["p_02.png: its camera 9 is not among the model's cameras"]),
        case("a quaternion of length 0", ColmapBinary, Views, "bad-pose", |f| {
            f.photos[2].quaternion_length = 0.0;
            f.write_files();
        })
        .says(&["p_02.png: its rotation is a quaternion of length 0.000000, needed: 1"]),
        case("a quaternion far from length 1", ColmapText, Views, "bad-pose", |f| {
            f.photos[2].quaternion_length = 1.4;
            f.write_files();
        })
        .says(&["p_02.png: its rotation is a quaternion of length 1.400000, needed: 1; export the model again"]),
        case("a quaternion of NaN", ColmapBinary, Views, "bad-pose", |f| {
            f.photos[2].quaternion_length = f64::NAN;
            f.write_files();
        })
        .says(&["p_02.png: its rotation is a quaternion of length NaN, needed: 1"]),
        case("a quaternion of Record3D far from length 1", Nerfstudio, Views, "bad-pose", |f| {
            f.photos[2].quaternion_length = 1.4;
            write_record3d(f, "metadata", "rgbd", 0);
        })
        .says(&["2.png: its rotation is a quaternion of length 1.400000, needed: 1; export the model again"]),
        case("a quaternion of Record3D of length 0", Nerfstudio, Views, "bad-pose", |f| {
            f.photos[2].quaternion_length = 0.0;
            write_record3d(f, "metadata", "rgbd", 0);
        })
        .says(&["2.png: its rotation is a quaternion of length 0.000000, needed: 1"]),
        case("a translation of NaN", ColmapBinary, Views, "bad-pose", |f| {
            f.photos[2].centre.x = f64::NAN;
            f.write_files();
        })
        .says(&["p_02.png: its translation is [NaN, ", "needed: finite numbers"]),
        case("a pose with scale", Nerfstudio, Views, "bad-pose", |f| {
            f.photos[2].rotation *= 2.0;
            f.write_files();
        })
        .says(&["images/p_02.png: `transform_matrix` scales by 2.000000"]),
        case("a mirrored pose", Nerfstudio, Views, "bad-pose", |f| {
            f.photos[2].rotation *= -1.0;
            f.write_files();
        })
        .says(&["images/p_02.png: `transform_matrix` is a reflection"]),
        case("a focal length of 0", ColmapText, Views, "bad-intrinsics", |f| {
            f.cameras.push(Camera { id: 2, parameters: vec![0.0, 20.0, 12.0, 8.0], ..f.cameras[0].clone() });
            f.photos[2].camera_id = 2;
            f.write_files();
        })
        .says(&["p_02.png: the focal length is 0 px, needed: a positive number; correct the camera's numbers"]),
        case("an image size of nothing", Nerfstudio, Views, "bad-intrinsics", |f| {
            f.photos[2].extra = "\"w\": -24, ".to_owned();
            f.write_files();
        })
        .says(&["images/p_02.png: the image size is 0×16 px"]),
        case("one frame with a panorama", Nerfstudio, Views, "camera-model", |f| {
            f.photos[2].extra = "\"camera_model\": \"EQUIRECTANGULAR\", ".to_owned();
            f.write_files();
        })
        .says(&["images/p_02.png: its camera model is `EQUIRECTANGULAR`"]),
        case("a distortion beyond sense", Nerfstudio, Fatal, "bad-intrinsics", |f| {
            f.shared.push_str(", \"k1\": 500.0");
            f.write_files();
        })
        .says(&[
            "0 of 10 training views can be used",
            "the distortion moves a ray by ",
            "in an image of 24×16 px, more than half",
        ]),
        case("a distortion of one camera that turns back", ColmapBinary, Views, "bad-intrinsics", |f| {
            let model = (9, "RADIAL_FISHEYE");
            let parameters = vec![20.0, 12.0, 8.0, 0.5, -4.0];
            f.cameras.push(Camera { id: 2, model, parameters, ..f.cameras[0].clone() });
            f.photos[2].camera_id = 2;
            f.write_files();
        })
        .says(&["p_02.png: the distortion turns back at ", "correct the camera's numbers or take the view out"]),
        case("a frame whose numbers contradict each other", Nerfstudio, Views, "bad-intrinsics", |f| {
            f.photos[2].extra = "\"fl_x\": 20, \"camera_angle_x\": 0.5, ".to_owned();
            f.write_files();
        })
        .says(&["images/p_02.png: `fl_x` is 20 px, but `camera_angle_x` makes it 46.996 px in an image of 24 px"]),
        case("a pose of Record3D with NaN", Nerfstudio, Views, "bad-pose", |f| {
            f.photos[3].centre.x = f64::NAN;
            write_record3d(f, "metadata", "rgbd", 0);
        })
        .says(&["3.png: `transform_matrix` has NaN in row 0, column 3"]),
        case("cameras in one place", Nerfstudio, Fatal, "no-baseline", |f| {
            f.photos.iter_mut().for_each(|photo| photo.centre = DVec3::ONE);
            f.write_files();
        })
        .says(&["of one point, so the scene has no scale", "views from different places"]),
    ]
}
