//! Captures that load but are doubtful.

use glam::{DMat3, DVec3};
use moxcms::ColorProfile;

use super::Harm::Doubt;
use super::{Case, case, flat_image, look_away, profiled_image, turned_image};
use crate::exports::write_record3d;
use crate::fixture::Kind::{Blender, ColmapBinary, ColmapText, Nerfstudio};
use crate::fixture::SIZE_PX;

pub(super) fn cases() -> Vec<Case> {
    vec![
        case("images without a pose", ColmapText, Doubt, "unposed-image", |f| {
            f.photos.truncate(8);
            f.write_files();
        })
        .says(&["images without a pose: 4 (p_08.png, p_09.png, p_10.png, … and 1 more)"]),
        case("few views", Blender, Doubt, "few-views", |f| {
            f.write_files();
        })
        .says(&["10 of 10 training views can be used, needed: at least 20 for a good scene"]),
        case("no test split", Blender, Doubt, "no-test-views", |f| {
            f.write_files().write("transforms_test.json", "{\"camera_angle_x\": 0.7, \"frames\": []}");
        })
        .says(&["warning[no-test-views]: no test views, so test PSNR", "transforms_test.json` has no usable frame"]),
        case("poses without rotations", Nerfstudio, Doubt, "one-rotation", |f| {
            f.photos.iter_mut().for_each(|photo| photo.rotation = DMat3::IDENTITY);
            f.write_files();
        })
        .says(&[
            "views that all have one and the same rotation: 12 (images/p_00.png",
            "export the poses with their rotations",
        ]),
        case("poses the wrong way round", Nerfstudio, Doubt, "inverted-poses", |f| {
            for (i, photo) in f.photos.iter_mut().enumerate() {
                let there = crate::fixture::photo(i, DVec3::new(3.0, -1.0, 2.0));
                photo.rotation = there.rotation.transpose();
                photo.centre = -(photo.rotation * there.centre);
            }
            f.write_files();
        })
        .says(&["they would if their poses were the inverse", "take the camera to the world"]),
        case("places in left-handed axes", Nerfstudio, Doubt, "mirrored-poses", |f| {
            f.photos.iter_mut().for_each(|photo| photo.centre.x = -photo.centre.x);
            f.write_files();
        })
        .says(&["if one coordinate of their places had the other sign", "left- and right-handed"]),
        case("points in metres, poses in millimetres", ColmapBinary, Doubt, "points-small", |f| {
            f.points.iter_mut().for_each(|point| *point *= 1e-3);
            f.write_files();
        })
        .says(&["of an image's width, needed: at least 2 %", "in one frame and one unit"]),
        case("coordinates of a map", ColmapText, Doubt, "far-from-origin", |f| {
            let offset = DVec3::new(5e6, 5e6, 0.0);
            f.photos.iter_mut().for_each(|photo| photo.centre += offset);
            f.points.iter_mut().for_each(|point| *point += offset);
            f.write_files();
        })
        .says(&["7.071e6 from the origin", "subtract a common offset"]),
        case("a scene far away", ColmapBinary, Doubt, "little-parallax", |f| {
            f.photos.iter_mut().for_each(|photo| photo.centre *= 0.0005);
            f.write_files();
        })
        .says(&["there is hardly any parallax", "places farther apart"]),
        case("two views of one pose", Nerfstudio, Doubt, "repeated-pose", |f| {
            (f.photos[5].rotation, f.photos[5].centre) = (f.photos[4].rotation, f.photos[4].centre);
            f.write_files();
        })
        .says(&["views that share their pose with another: 2 (images/p_04.png, images/p_05.png)"]),
        case("an image listed twice", ColmapBinary, Doubt, "repeated-image", |f| {
            f.photos[6].name = f.photos[5].name.clone();
            f.write_files();
        })
        .says(&["images listed more than once: 1 (p_05.png)"]),
        case("two names of one image", Nerfstudio, Doubt, "repeated-image", |f| {
            f.photos[6].name = "p_05.jpg".to_owned();
            f.write_files();
        })
        .says(&["images listed more than once: 1 (images/p_05.jpg)"]),
        case("distortion", ColmapBinary, Doubt, "distortion", |f| {
            f.cameras[0].model = (2, "SIMPLE_RADIAL");
            f.cameras[0].parameters = vec![20.0, 12.0, 8.0, 0.2];
            f.write_files();
        })
        .says(&["note[distortion]: images with lens distortion: 12; it moves pixels by up to 1.5 px"]),
        case("a principal point outside", ColmapText, Doubt, "principal-point", |f| {
            f.cameras[0].parameters[2] = 48.0;
            f.write_files();
        })
        .says(&["images whose principal point lies outside them or in their corner: 12"]),
        case("photographs with alpha", Nerfstudio, Doubt, "alpha", |f| {
            let rgba = [90; 24 * 16 * 4];
            image::save_buffer(f.write_files().at("images/p_03.png"), &rgba, 24, 16, image::ExtendedColorType::Rgba8)
                .expect("an image");
        })
        .says(&[
            "note[alpha]: photographs with an alpha channel",
            ": 1 (images/p_03.png)",
            "give them as masks",
        ]),
        case("renderings without alpha", Blender, Doubt, "no-alpha", |f| {
            flat_image(f.write_files(), "images/p_03.png");
        })
        .says(&["images without an alpha channel", ": 1 (images/p_03.png)"]),
        case("an image of a single colour", ColmapText, Doubt, "flat-image", |f| {
            flat_image(f.write_files(), "images/p_03.png");
        })
        .says(&["images of a single colour: 1 (p_03.png)"]),
        case("an EXIF orientation", ColmapBinary, Doubt, "exif-orientation", |f| {
            turned_image(f.write_files(), "images/p_03.png");
        })
        .says(&["images with an EXIF orientation, which is not applied", ": 1 (p_03.png)"]),
        case("a colour profile of a phone", ColmapText, Doubt, "colour-profile", |f| {
            let f = f.write_files();
            profiled_image(f, "images/p_02.png", &ColorProfile::new_srgb());
            profiled_image(f, "images/p_03.png", &ColorProfile::new_display_p3());
            profiled_image(f, "images/p_04.png", &ColorProfile::new_adobe_rgb());
        })
        .says(&["images with a colour profile other than sRGB, as Display P3", ": 2 (p_03.png, p_04.png)"]),
        case("images of several sizes", ColmapText, Doubt, "mixed-sizes", |f| {
            f.write_files().write_image("images/p_03.png", (48, 32));
        })
        .says(&["images of another size than the 24×16 px of most: 1 (p_03.png)"]),
        case("a mask for some frames", Nerfstudio, Doubt, "missing-masks", |f| {
            f.photos[3].extra = "\"mask_path\": \"masks/p_03.png\", ".to_owned();
            f.write_files().write_mask("masks/p_03.png", SIZE_PX);
        })
        .says(&["images without a mask: 11 of 12 (", "name the mask of each in its frame as `mask_path`"]),
        case("a mask for some images", ColmapBinary, Doubt, "missing-masks", |f| {
            f.write_files().write_image("masks/p_03.png.png", SIZE_PX);
            f.write_image("masks/p_04.jpg", SIZE_PX);
        })
        .says(&[
            "masks`: 10 of 12 (p_00.png, p_01.png, p_02.png, … and 7 more), so all their pixels count",
            "name masks like",
        ]),
        case("quaternions that were never normalised", ColmapText, Doubt, "quaternion-length", |f| {
            (f.photos[2].quaternion_length, f.photos[7].quaternion_length) = (0.93, 1.05);
            f.write_files();
        })
        .says(&[
            "images.txt`: rotations whose quaternion is not of length 1: 2 (p_02.png, p_07.png), the worst of \
             length 0.930000",
            "they were normalised",
            "10 views to train, 2 to test",
        ]),
        case("quaternions of Record3D that were never normalised", Nerfstudio, Doubt, "quaternion-length", |f| {
            (f.photos[2].quaternion_length, f.photos[7].quaternion_length) = (0.93, 1.05);
            write_record3d(f, "metadata", "rgbd", 0);
        })
        .says(&[
            "metadata`: rotations whose quaternion is not of length 1: 2 (2.png, 7.png), the worst of length 0.930000",
        ]),
        case("no points", ColmapBinary, Doubt, "no-points", |f| {
            f.write_files().remove("sparse/0/points3D.bin");
        })
        .says(&["points3D.bin` is missing, so training makes them"]),
        case("an empty list of points", ColmapText, Doubt, "no-points", |f| {
            f.points.clear();
            f.write_files();
        })
        .says(&["points3D.txt` is empty, so training makes them"]),
        case("few points", ColmapText, Doubt, "few-points", |f| {
            f.points.truncate(7);
            f.write_files();
        })
        .says(&["points3D.txt` holds 7 points, needed: at least 100"]),
        case("points that are not numbers", ColmapBinary, Doubt, "non-finite-points", |f| {
            (f.points[5].x, f.points[9].z) = (f64::NAN, f64::INFINITY);
            f.write_files();
        })
        .says(&[
            "points3D.bin`: 2 of 120 points have a coordinate that is no finite number",
            "the first is point 5 (counted from 0): [NaN, 0.2, 0.25]",
        ]),
        case("a point cloud of nothing but NaN", Nerfstudio, Doubt, "non-finite-points", |f| {
            f.shared.push_str(", \"ply_file_path\": \"cloud.ply\"");
            f.write_files().write(
                "cloud.ply",
                "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                 end_header\nnan 0 0\n0 nan 0\n0 0 inf\n",
            );
        })
        .says(&[
            "cloud.ply`: 3 of 3 points have a coordinate",
            "the first is point 0",
            "holds 0 points, needed: at least 100",
        ]),
        case("points of another reconstruction", ColmapBinary, Doubt, "points-unseen", |f| {
            look_away(f);
            f.write_files();
        })
        .says(&["only 0 % of the points", "points and poses of one reconstruction"]),
        case("several models", ColmapBinary, Doubt, "several-models", |f| {
            f.write_files();
            std::fs::rename(f.at("sparse/0"), f.at("sparse/1")).expect("a model");
            f.photos.truncate(5);
            f.write_files().write("sparse/2/cameras.bin", "");
        })
        .says(&[
            "note[several-models]: the capture has 3 models, which share no frame: 0 poses 5 images, 1 poses 12 \
             images, 2 poses 0 images",
            "remedy: the largest, 1, is read: choose another with `--model N`",
            "10 views to train, 2 to test",
        ]),
    ]
}
