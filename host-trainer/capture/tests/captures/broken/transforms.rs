//! Transforms files that are damaged, or say what no view can be made of.

use super::Harm::{Doubt, Fatal};
use glam::{DMat3, DVec3};

use super::{Case, case, cut};
use crate::fixture::Kind::{Blender, Nerfstudio};
use crate::fixture::SIZE_PX;

pub(super) fn cases() -> Vec<Case> {
    vec![
        case("not JSON", Nerfstudio, Fatal, "bad-transforms", |f| f.write("transforms.json", "<html>"))
            .says(&["transforms.json` is not a transforms file: expected value at line 1 column 1; it needs"]),
        case("a web page", Nerfstudio, Fatal, "bad-transforms", |f| {
            f.write("transforms.json", "<!DOCTYPE html><html>")
        })
        .says(&[
            "transforms.json` is not a transforms file: ",
            "; it is a web page: the download failed: fetch the file itself again",
        ]),
        case("a width without a height that fits", Nerfstudio, Fatal, "bad-intrinsics", |f| {
            f.shared = "\"fl_x\": 40, \"cx\": 24, \"cy\": 24, \"w\": 48".to_owned();
            f.write_files();
        })
        .says(&["`w` is 48 but `h` is not given, and from the photograph's 24×16 px it would be 32", "needed: `h`"]),
        case("poses in OpenCV's axes", Nerfstudio, Doubt, "looking-away", |f| {
            let turned = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
            f.photos.iter_mut().for_each(|photo| photo.rotation *= turned);
            f.write_files();
        })
        .says(&[
            "warning[looking-away]: cameras that look away from the point in which their axes meet: 12 of 12",
            "turn the signs of the second and third column of every `transform_matrix`",
        ]),
        case("a folder of masks that no frame names", Nerfstudio, Doubt, "unread-masks", |f| {
            f.write_files().write_mask("masks/p_03.png", SIZE_PX);
        })
        .says(&[
            "masks` holds images, but no photograph has a mask",
            "name the mask of each photograph in its frame as `mask_path`",
        ]),
        case("one mask that several frames name", Nerfstudio, Doubt, "shared-mask", |f| {
            for i in [3, 4] {
                f.photos[i].extra = "\"mask_path\": \"masks/hood.png\", ".to_owned();
            }
            f.write_files().write_mask("masks/hood.png", SIZE_PX);
        })
        .says(&["masks that several photographs name: 1, as `", "by 2 photographs (images/p_03.png, images/p_04.png)"]),
        case("focal lengths of pixels that are no squares", Nerfstudio, Doubt, "focal-lengths", |f| {
            f.photos[3].extra = "\"fl_y\": 22, ".to_owned();
            f.write_files();
        })
        .says(&["images whose focal lengths along x and y differ by more than 5 %: 1 (images/p_03.png)"]),
        case("lenses in shares of the image", Nerfstudio, Doubt, "field-of-view", |f| {
            f.photos[3].extra = "\"fl_x\": 0.83, \"fl_y\": 0.83, \"cx\": 0.5, \"cy\": 0.5, ".to_owned();
            f.write_files();
        })
        .says(&[
            "warning[field-of-view]: images whose focal length is not 0.1 to 100 times their longer side: 1 \
             (images/p_03.png)",
            "warning[principal-point]: images whose principal point lies outside them or in their corner: 1 \
             (images/p_03.png)",
        ]),
        case("a split of its own without views to test", Nerfstudio, Doubt, "no-test-views", |f| {
            let names: Vec<String> = (0..12).map(|i| format!("\"images/p_{i:02}.png\"")).collect();
            f.shared.push_str(&format!(", \"train_filenames\": [{}], \"test_filenames\": []", names.join(", ")));
            f.write_files();
        })
        .says(&["has a split of its own, and no frame is in its `test_filenames`"]),
        case("JSON cut", Blender, Fatal, "bad-transforms", |f| {
            cut(f.write_files(), "transforms_train.json", 300);
        })
        .says(&["EOF while parsing", "at line 2 column"]),
        case("no frames", Nerfstudio, Fatal, "bad-transforms", |f| {
            f.write("transforms.json", "{\"fl_x\": 20}");
        })
        .says(&["missing field `frames`"]),
        case("no focal length", Nerfstudio, Fatal, "bad-intrinsics", |f| {
            f.shared = "\"w\": 24, \"h\": 16".to_owned();
            f.write_files();
        })
        .says(&["neither `fl_x` nor `camera_angle_x` is a number", "`images/p_00.png`"]),
        case("degrees for radians", Blender, Fatal, "bad-intrinsics", |f| {
            f.shared = "\"camera_angle_x\": 50".to_owned();
            f.write_files();
        })
        .says(&["`camera_angle_x` is 50, needed", "convert it if it is in degrees"]),
        case("a panorama", Nerfstudio, Fatal, "camera-model", |f| {
            f.shared.push_str(", \"camera_model\": \"EQUIRECTANGULAR\"");
            f.write_files();
        })
        .says(&["all frames has the camera model `EQUIRECTANGULAR`", "undistort the capture first"]),
        case("no frame in any split", Nerfstudio, Fatal, "too-few-views", |f| {
            f.shared.push_str(", \"train_filenames\": [\"p_01.png\"]");
            f.write_files();
        })
        .says(&["0 of 0 training views can be used, needed: at least 3"]),
        case("a point cloud missing", Nerfstudio, Doubt, "missing-points", |f| {
            f.shared.push_str(", \"ply_file_path\": \"sparse.ply\"");
            f.write_files();
        })
        .says(&[
            "warning[missing-points]: `ply_file_path` names `",
            "sparse.ply`, which does not exist, so training makes points",
            "remedy: restore the point cloud for a better start, or take `ply_file_path` out",
        ]),
        case("a point cloud that is none", Nerfstudio, Fatal, "bad-points", |f| {
            f.shared.push_str(", \"ply_file_path\": \"sparse.ply\"");
            f.write_files().write("sparse.ply", "solid cube");
        })
        .says(&["sparse.ply` is no .ply file: it does not start with `ply`; write it again"]),
    ]
}
