//! Views that cannot be used: left out where enough others are sound.

use glam::DVec3;

use super::Harm::{Fatal, Views};
use super::{Case, N_VIEWS, case, cut, edit, turned_image};
use crate::exports::{NSVF_MATRIX, write_nsvf, write_polycam, write_record3d};
use crate::fixture::Kind::{Blender, ColmapBinary, ColmapText, Nerfstudio};
use crate::fixture::{Camera, SIZE_PX};

pub(super) fn cases() -> Vec<Case> {
    vec![
        case(
            "a camera far away",
            ColmapBinary,
            Views,
            "pose-outlier",
            &[
                "p_07.png: its camera stands",
                "times as far from the middle of all as half of them do",
                "take the view out",
            ],
            |f| {
                f.photos[7].centre *= 100.0;
                f.write_files();
            },
        ),
        case(
            "test views of another reconstruction",
            Nerfstudio,
            Views,
            "pose-outlier",
            &["test views left out: 2", "images/p_08.png: its camera stands"],
            |f| {
                for i in [0, 8] {
                    f.photos[i].centre += DVec3::X * 1e4;
                }
                f.write_files();
            },
        ),
        case(
            "images missing",
            ColmapText,
            Views,
            "missing-image",
            &[
                "train views left out: 2",
                "p_03.png: image missing: `",
                "does not exist, nor does the same with the extension png or jpg or jpeg or webp; restore it or take the view out of the model",
            ],
            |f| {
                f.write_files().remove("images/p_03.png");
                f.remove("images/p_04.png");
            },
        ),
        case(
            "all images missing",
            Nerfstudio,
            Fatal,
            "too-few-views",
            &["0 of 10 training views can be used", "images/p_01.png: image missing", "and 7 more"],
            |f| {
                f.write_files();
                (0..N_VIEWS).for_each(|i| f.remove(&format!("images/p_{i:02}.png")));
            },
        ),
        case(
            "an image missing that another folder has",
            ColmapText,
            Views,
            "missing-image",
            &["left/p_03.png: image missing: `", "images/left/p_03.png` does not exist"],
            |f| {
                f.photos[3].name = "left/p_03.png".to_owned();
                f.write_image("images/left/p_99.png", (24, 16));
                f.write_files();
            },
        ),
        case(
            "an image without content",
            Nerfstudio,
            Views,
            "unreadable-image",
            &["images/p_05.png: image unreadable: `", "replace it with a whole PNG, JPEG or WebP"],
            |f| {
                f.write_files().write("images/p_05.png", "");
            },
        ),
        case(
            "an image cut behind its header",
            ColmapBinary,
            Views,
            "unreadable-image",
            &["p_05.png: image unreadable"],
            |f| {
                cut(f.write_files(), "images/p_05.png", 60);
            },
        ),
        case(
            "a JPEG cut in its picture",
            ColmapBinary,
            Views,
            "unreadable-image",
            &[
                "p_05.png: image unreadable: `",
                "the JPEG ends after 800 bytes without its end marker (FF D9), so the file was cut",
                "replace it with a whole PNG, JPEG or WebP",
            ],
            |f| {
                turned_image(f.write_files(), "images/p_05.png");
                cut(f, "images/p_05.png", 800);
            },
        ),
        case(
            "a JPEG whose copy was never finished",
            Nerfstudio,
            Views,
            "unreadable-image",
            &["images/p_05.png: image unreadable", "without its end marker (FF D9)"],
            |f| {
                turned_image(f.write_files(), "images/p_05.png");
                let mut bytes = std::fs::read(f.at("images/p_05.png")).expect("it was written");
                let half = bytes.len() / 2 + 300;
                bytes[half..].fill(0);
                f.write("images/p_05.png", bytes);
            },
        ),
        case(
            "a format that is not read",
            Blender,
            Views,
            "unreadable-image",
            &["images/p_05.png: image unreadable", "replace it with a whole PNG, JPEG or WebP"],
            |f| {
                f.write_files().write("images/p_05.png", b"RIFF\x24\0\0\0WEBPVP8 ");
            },
        ),
        case(
            "images of a format that has to be converted",
            Nerfstudio,
            Views,
            "image-format",
            &[
                "p_05.png` is HEIC, needed: PNG, JPEG or WebP; convert the images, names need not change in the capture:\n",
                "magick mogrify -format jpg -quality 95 '",
            ],
            |f| {
                f.write_files().write("images/p_05.png", b"\0\0\0\x18ftypheic\0\0\0\0");
                f.write("images/p_06.png", b"\0\0\0\x1Cftypavif\0\0\0\0");
            },
        ),
        case(
            "a raw photograph",
            ColmapText,
            Views,
            "image-format",
            &["p_05.png` is TIFF or raw, needed: PNG, JPEG or WebP"],
            |f| {
                f.write_files().write("images/p_05.png", b"II*\0\x08\0\0\0\x01\0\0\0");
            },
        ),
        case("a WebP cut", ColmapText, Views, "unreadable-image", &["p_05.png: image unreadable"], |f| {
            let image = image::open(f.write_files().at("images/p_05.png")).expect("written");
            image.save_with_format(f.at("images/p_05.png"), image::ImageFormat::WebP).expect("WebP");
            cut(f, "images/p_05.png", 60);
        }),
        case(
            "a moment of Polycam without a lens",
            Nerfstudio,
            Views,
            "bad-intrinsics",
            &["p_04: the focal length is NaN px, needed: a positive number"],
            |f| {
                write_polycam(f, "cameras", "images");
                edit(f, "keyframes/cameras/p_04.json", |text| text.replace("\"fx\"", "\"focal\""));
            },
        ),
        case(
            "a moment of Polycam without a pose",
            Nerfstudio,
            Views,
            "bad-pose",
            &["p_04: `transform_matrix` has NaN in row 1, column 2"],
            |f| {
                write_polycam(f, "cameras", "images");
                edit(f, "keyframes/cameras/p_04.json", |text| text.replace("t_12", "t_99"));
            },
        ),
        case("a picture of Record3D missing", Nerfstudio, Views, "missing-image", &["rgbd/4` does not exist"], |f| {
            write_record3d(f, "metadata", "rgbd", 0);
            f.remove("rgbd/4.png");
        }),
        case(
            "a pose of NSVF cut",
            Nerfstudio,
            Views,
            "bad-pose",
            &["0004: `transform_matrix` has 2 rows, the shortest of 4 numbers, needed: 4 rows of 4"],
            |f| {
                write_nsvf(f, NSVF_MATRIX, |_| "");
                edit(f, "pose/0004.txt", |text| text.lines().take(2).collect::<Vec<_>>().join("\n"));
            },
        ),
        case(
            "an image of another size among renderings",
            Blender,
            Views,
            "image-size",
            &["p_06.png` is 12×8 px, the training images are 24×16 px; export it again at that size"],
            |f| {
                f.write_files().write_image("images/p_06.png", (12, 8));
            },
        ),
        case(
            "an image turned on its side",
            ColmapBinary,
            Views,
            "image-shape",
            &["p_06.png` is 16×24 px, its camera is for 24×16 px", "it is turned on its side; store it as"],
            |f| {
                f.write_files().write_image("images/p_06.png", (16, 24));
            },
        ),
        case(
            "an image cropped",
            Nerfstudio,
            Views,
            "image-shape",
            &["p_06.png` is 24×10 px, its camera is for 24×16 px, which is another shape; use the images"],
            |f| {
                f.write_files().write_image("images/p_06.png", (24, 10));
            },
        ),
        case(
            "a camera that is not there",
            ColmapText,
            Views,
            "missing-camera",
            &["p_02.png: its camera 9 is not among the model's cameras"],
            |f| {
                f.photos[2].camera_id = 9;
                f.write_files();
            },
        ),
        case(
            "a quaternion of length 0",
            ColmapBinary,
            Views,
            "bad-pose",
            &["p_02.png: its rotation is a quaternion of length 0.000000, needed: 1"],
            |f| {
                f.photos[2].quaternion_length = 0.0;
                f.write_files();
            },
        ),
        case(
            "a quaternion far from length 1",
            ColmapText,
            Views,
            "bad-pose",
            &["p_02.png: its rotation is a quaternion of length 1.400000, needed: 1; export the model again"],
            |f| {
                f.photos[2].quaternion_length = 1.4;
                f.write_files();
            },
        ),
        case(
            "a quaternion of NaN",
            ColmapBinary,
            Views,
            "bad-pose",
            &["p_02.png: its rotation is a quaternion of length NaN, needed: 1"],
            |f| {
                f.photos[2].quaternion_length = f64::NAN;
                f.write_files();
            },
        ),
        case(
            "a quaternion of Record3D far from length 1",
            Nerfstudio,
            Views,
            "bad-pose",
            &["2.png: its rotation is a quaternion of length 1.400000, needed: 1; export the model again"],
            |f| {
                f.photos[2].quaternion_length = 1.4;
                write_record3d(f, "metadata", "rgbd", 0);
            },
        ),
        case(
            "a quaternion of Record3D of length 0",
            Nerfstudio,
            Views,
            "bad-pose",
            &["2.png: its rotation is a quaternion of length 0.000000, needed: 1"],
            |f| {
                f.photos[2].quaternion_length = 0.0;
                write_record3d(f, "metadata", "rgbd", 0);
            },
        ),
        case(
            "a mask of another size beside a model",
            ColmapBinary,
            Views,
            "bad-mask",
            &["p_02.png: its mask `", "masks/p_02.png.png` is 24×8 px, its image 24×16 px; restore the mask"],
            |f| {
                f.write_files().write_image("masks/p_02.png.png", (24, 8));
            },
        ),
        case(
            "a translation of NaN",
            ColmapBinary,
            Views,
            "bad-pose",
            &["p_02.png: its translation is [NaN, ", "needed: finite numbers"],
            |f| {
                f.photos[2].centre.x = f64::NAN;
                f.write_files();
            },
        ),
        case(
            "a pose with scale",
            Nerfstudio,
            Views,
            "bad-pose",
            &["images/p_02.png: `transform_matrix` scales by 2.000000"],
            |f| {
                f.photos[2].rotation *= 2.0;
                f.write_files();
            },
        ),
        case(
            "a mirrored pose",
            Nerfstudio,
            Views,
            "bad-pose",
            &["images/p_02.png: `transform_matrix` is a reflection"],
            |f| {
                f.photos[2].rotation *= -1.0;
                f.write_files();
            },
        ),
        case(
            "a focal length of 0",
            ColmapText,
            Views,
            "bad-intrinsics",
            &["p_02.png: the focal length is 0 px, needed: a positive number; correct the camera's numbers"],
            |f| {
                f.cameras.push(Camera { id: 2, parameters: vec![0.0, 20.0, 12.0, 8.0], ..f.cameras[0].clone() });
                f.photos[2].camera_id = 2;
                f.write_files();
            },
        ),
        case(
            "an image size of nothing",
            Nerfstudio,
            Views,
            "bad-intrinsics",
            &["images/p_02.png: the image size is 0×16 px"],
            |f| {
                f.photos[2].extra = "\"w\": -24, ".to_owned();
                f.write_files();
            },
        ),
        case(
            "one frame with a panorama",
            Nerfstudio,
            Views,
            "camera-model",
            &["images/p_02.png: its camera model is `EQUIRECTANGULAR`"],
            |f| {
                f.photos[2].extra = "\"camera_model\": \"EQUIRECTANGULAR\", ".to_owned();
                f.write_files();
            },
        ),
        case(
            "a mask missing",
            Nerfstudio,
            Views,
            "bad-mask",
            &["images/p_02.png: its mask `", "masks/2.png` does not exist; restore the mask"],
            |f| {
                f.photos[2].extra = "\"mask_path\": \"masks/2.png\", ".to_owned();
                f.write_files();
            },
        ),
        case(
            "a mask missing that is called as its image",
            Nerfstudio,
            Views,
            "bad-mask",
            &["images/p_02.png: its mask `", "masks/p_02.png` does not exist; restore the mask"],
            |f| {
                f.photos[2].extra = "\"mask_path\": \"masks/p_02.png\", ".to_owned();
                f.write_files();
            },
        ),
        case(
            "a mask of another size",
            Nerfstudio,
            Views,
            "bad-mask",
            &["is 5×4 px, its image 24×16 px; restore the mask"],
            |f| {
                f.photos[2].extra = "\"mask_path\": \"masks/2.png\", ".to_owned();
                f.write_files().write_image("masks/2.png", (5, 4));
            },
        ),
        case(
            "a distortion beyond sense",
            Nerfstudio,
            Fatal,
            "bad-intrinsics",
            &[
                "0 of 10 training views can be used",
                "the distortion moves a ray by ",
                "in an image of 24×16 px, more than half",
            ],
            |f| {
                f.shared.push_str(", \"k1\": 500.0");
                f.write_files();
            },
        ),
        case(
            "a distortion of one camera that turns back",
            ColmapBinary,
            Views,
            "bad-intrinsics",
            &["p_02.png: the distortion turns back at ", "correct the camera's numbers or take the view out"],
            |f| {
                let model = (9, "RADIAL_FISHEYE");
                let parameters = vec![20.0, 12.0, 8.0, 0.5, -4.0];
                f.cameras.push(Camera { id: 2, model, parameters, ..f.cameras[0].clone() });
                f.photos[2].camera_id = 2;
                f.write_files();
            },
        ),
        case(
            "two photographs of one file",
            ColmapText,
            Views,
            "shared-image",
            &[
                "left/p_02.png: its name is `left/p_02.png`, and the file found for it, `",
                "images/p_02.png`, is also found for `right/p_02.png`, but one file is not two photographs; put each",
            ],
            |f| {
                f.photos[2].name = "left/p_02.png".to_owned();
                f.photos[3].name = "right/p_02.png".to_owned();
                f.write_files();
            },
        ),
        case(
            "two names of one file but for case",
            Nerfstudio,
            Views,
            "shared-image",
            &["images/P_03.PNG: its name is", "is also found for `./images/p_03.png`"],
            |f| {
                f.photos[4].name = "P_03.PNG".to_owned();
                f.write_files();
            },
        ),
        case(
            "one mask of two photographs",
            ColmapBinary,
            Views,
            "bad-mask",
            &["left/p_02.png: its mask `", "masks/p_02.png.png` is also that of `right/p_02.png`"],
            |f| {
                for (i, side) in [(2, "left"), (3, "right")] {
                    f.photos[i].name = format!("{side}/p_02.png");
                    f.write_image(&format!("images/{side}/p_02.png"), SIZE_PX);
                }
                f.write_files().write_mask("masks/p_02.png.png", SIZE_PX);
            },
        ),
        case(
            "a depth map in place of a photograph",
            ColmapText,
            Views,
            "missing-image",
            &["p_03.jpg: image missing"],
            |f| {
                f.photos[3].name = "p_03.jpg".to_owned();
                image::save_buffer(f.at("images/p_03.png"), &[9; 24 * 16 * 2], 24, 16, image::ExtendedColorType::L16)
                    .expect("an image");
                f.write_files();
            },
        ),
        case(
            "a pointer of Git LFS",
            Nerfstudio,
            Views,
            "unreadable-image",
            &[
                "images/p_05.png: image unreadable: `",
                "p_05.png`: it is a Git LFS pointer, not the file itself; run `git lfs pull` in its repository, or replace it with a whole PNG",
            ],
            |f| {
                f.write_files()
                    .write("images/p_05.png", "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n");
            },
        ),
        case(
            "a frame whose numbers contradict each other",
            Nerfstudio,
            Views,
            "bad-intrinsics",
            &["images/p_02.png: `fl_x` is 20 px, but `camera_angle_x` makes it 46.996 px in an image of 24 px"],
            |f| {
                f.photos[2].extra = "\"fl_x\": 20, \"camera_angle_x\": 0.5, ".to_owned();
                f.write_files();
            },
        ),
        case(
            "a pose of Record3D with NaN",
            Nerfstudio,
            Views,
            "bad-pose",
            &["3.png: `transform_matrix` has NaN in row 0, column 3"],
            |f| {
                f.photos[3].centre.x = f64::NAN;
                write_record3d(f, "metadata", "rgbd", 0);
            },
        ),
        case(
            "cameras in one place",
            Nerfstudio,
            Fatal,
            "no-baseline",
            &["of one point, so the scene has no scale", "views from different places"],
            |f| {
                f.photos.iter_mut().for_each(|photo| photo.centre = DVec3::ONE);
                f.write_files();
            },
        ),
    ]
}
