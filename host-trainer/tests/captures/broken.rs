//! A corpus of broken captures, each with the message that a person must be given.
//!
//! Every case breaks a sound capture in one way. What is fatal must be an error of loading and of the diagnosis; what
//! costs views must be told in both reports, and the rest of the capture must load; what is doubtful must be told by the
//! diagnosis.

use std::io::BufWriter;

use glam::{DMat3, DVec3};
use image::ImageEncoder;
use pocketsplat::dataset::{Diagnosis, LoadOptions, Severity, diagnose, diagnose_cheaply};

use crate::fixture::{Camera, Fixture, Kind, SIZE_PX};

/// What a fault does to a capture.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Harm {
    /// It cannot be trained on.
    Fatal,
    /// Views are left out.
    Views,
    /// The result may suffer.
    Doubt,
}

use Harm::{Doubt, Fatal, Views};
use Kind::{Blender, ColmapBinary, ColmapText, Nerfstudio};

struct Case {
    name: &'static str,
    kind: Kind,
    /// Breaks the capture and writes it.
    write: fn(&mut Fixture),
    harm: Harm,
    /// The code of the diagnosis's finding.
    code: &'static str,
    /// Parts of the message: of the error, of the report on loading, or of the diagnosis.
    says: &'static [&'static str],
}

/// Views of the sound capture: two are held out.
const N_VIEWS: usize = 12;

fn case(
    name: &'static str,
    kind: Kind,
    harm: Harm,
    code: &'static str,
    says: &'static [&'static str],
    write: fn(&mut Fixture),
) -> Case {
    Case { name, kind, write, harm, code, says }
}

/// Changes the text of a written file.
fn edit(fixture: &Fixture, name: &str, change: impl Fn(String) -> String) {
    let text = std::fs::read_to_string(fixture.at(name)).expect("it was written");
    fixture.write(name, change(text));
}

/// Keeps the first bytes of a written file.
fn cut(fixture: &Fixture, name: &str, n_bytes: usize) {
    let bytes = std::fs::read(fixture.at(name)).expect("it was written");
    fixture.write(name, &bytes[..n_bytes]);
}

/// Overwrites bytes of a written file.
fn poke(fixture: &Fixture, name: &str, at: usize, with: &[u8]) {
    let mut bytes = std::fs::read(fixture.at(name)).expect("it was written");
    bytes[at..at + with.len()].copy_from_slice(with);
    fixture.write(name, bytes);
}

fn flat_image(fixture: &Fixture, name: &str) {
    let (width_px, height_px) = SIZE_PX;
    let grey = vec![128; (width_px * height_px * 3) as usize];
    image::save_buffer(fixture.at(name), &grey, width_px, height_px, image::ExtendedColorType::Rgb8).expect("an image");
}

/// A JPEG turned by a quarter according to its EXIF data, under a name that ends in `.png`.
fn turned_image(fixture: &Fixture, name: &str) {
    // A TIFF directory of one entry: orientation (0x0112), short, one value: 6.
    let exif = [b"II*\0\x08\0\0\0\x01\0".as_slice(), b"\x12\x01\x03\0\x01\0\0\0\x06\0\0\0", &[0; 4]].concat();
    let (width_px, height_px) = SIZE_PX;
    let rgb: Vec<u8> = (0..width_px * height_px * 3).map(|i| (i % 251) as u8).collect();
    let file = BufWriter::new(std::fs::File::create(fixture.at(name)).expect("a file"));
    let mut encoder = image::codecs::jpeg::JpegEncoder::new(file);
    encoder.set_exif_metadata(exif).expect("JPEG holds EXIF data");
    encoder.write_image(&rgb, width_px, height_px, image::ExtendedColorType::Rgb8).expect("an image");
}

/// A turn of every pose by a half about y around its own camera: all look away from the scene.
fn look_away(fixture: &mut Fixture) {
    fixture.photos.iter_mut().for_each(|photo| photo.rotation *= DMat3::from_rotation_y(std::f64::consts::PI));
}

fn layouts() -> Vec<Case> {
    vec![
        case(
            "no capture at all",
            Blender,
            Fatal,
            "unknown-layout",
            &["looked for `transforms_train.json` (Blender), `sparse/0/cameras.bin`", "none of them; give the folder"],
            |_| {},
        ),
        case(
            "the capture is a folder further in",
            Nerfstudio,
            Fatal,
            "unknown-layout",
            &["its folder `", "/fox` is one, give that"],
            |f| f.write("fox/transforms.json", "{}"),
        ),
        case(
            "no folder of images",
            ColmapText,
            Fatal,
            "image-folder",
            &["has no folder of images: there is neither `images` nor `images_…`; put the photographs into `images`"],
            |f| std::fs::rename(f.write_files().at("images"), f.at("photos")).expect("a folder"),
        ),
        case(
            "several reduced folders of images",
            ColmapBinary,
            Fatal,
            "image-folder",
            &["there are `images_2`, `images_4`; choose one with `--images`"],
            |f| {
                std::fs::rename(f.write_files().at("images"), f.at("images_2")).expect("a folder");
                f.write_image("images_4/p_00.png", (6, 4));
            },
        ),
    ]
}

fn models() -> Vec<Case> {
    vec![
        case("images.bin missing", ColmapBinary, Fatal, "unreadable-file", &["sparse/0/images.bin`: "], |f| {
            f.write_files().remove("sparse/0/images.bin");
        }),
        case(
            "cameras.bin empty",
            ColmapBinary,
            Fatal,
            "bad-model",
            &["cameras.bin`: byte 0: the file has 0 bytes, needed: 8 for the count of cameras; export the model again"],
            |f| f.write_files().write("sparse/0/cameras.bin", ""),
        ),
        case(
            "a hostile count of cameras",
            ColmapBinary,
            Fatal,
            "bad-model",
            &[
                "cameras.bin`: byte 0: 18446744073709551615 cameras are announced, but the 56 bytes that follow hold at most 2",
            ],
            |f| poke(f.write_files(), "sparse/0/cameras.bin", 0, &[255; 8]),
        ),
        case(
            "a hostile count of observations",
            ColmapBinary,
            Fatal,
            "bad-model",
            &["images.bin`: image 1 of 12, byte 89: 9223372036854775808 observations are announced, but only "],
            // Behind the count, the number, seven doubles, the camera's number and `p_00.png\0`.
            |f| poke(f.write_files(), "sparse/0/images.bin", 8 + 4 + 56 + 4 + 9, &(1_u64 << 63).to_le_bytes()),
        ),
        case(
            "a hostile track",
            ColmapBinary,
            Fatal,
            "bad-model",
            &["points3D.bin`: point 1 of 120, byte 59: 2305843009213693952 track elements are announced"],
            |f| poke(f.write_files(), "sparse/0/points3D.bin", 8 + 43, &(1_u64 << 61).to_le_bytes()),
        ),
        case(
            "images.bin cut",
            ColmapBinary,
            Fatal,
            "bad-model",
            &[
                "images.bin`: image 9 of 12, byte 1",
                "bytes follow; export the model again, or copy it again if the file was cut",
            ],
            |f| {
                // Enough bytes for 12 of the smallest images.
                cut(f.write_files(), "sparse/0/images.bin", 1160);
            },
        ),
        case(
            "a name without end",
            ColmapBinary,
            Fatal,
            "bad-model",
            &["images.bin`: image 12 of 12, byte", "the name does not end within 4096 bytes or the file"],
            |f| {
                f.photos[11].name = "n".repeat(5000);
                f.write_files();
            },
        ),
        case(
            "a camera model of the future",
            ColmapBinary,
            Fatal,
            "bad-model",
            &["cameras.bin`: camera 1 of 1, byte 32: the camera model has the number 77, known: 0 to 11"],
            |f| {
                f.cameras[0].model.0 = 77;
                f.write_files();
            },
        ),
        case(
            "a fisheye in a binary model",
            ColmapBinary,
            Fatal,
            "camera-model",
            &["camera 1 has the camera model `OPENCV_FISHEYE`, needed: PINHOLE", "image_undistorter"],
            |f| {
                f.cameras[0].model.0 = 5;
                f.cameras[0].parameters.resize(8, 0.0);
                f.write_files();
            },
        ),
        case(
            "an unheard-of model in a text model",
            ColmapText,
            Fatal,
            "camera-model",
            &["cameras.txt`: camera 1 has the camera model `FULL_OPENCV`, needed: PINHOLE"],
            |f| {
                f.cameras[0].model.1 = "FULL_OPENCV";
                f.cameras[0].parameters.resize(12, 0.0);
                f.write_files();
            },
        ),
        case(
            "a parameter too few",
            ColmapText,
            Fatal,
            "bad-model",
            &["cameras.txt`: line 2: PINHOLE has 3 parameters, needed: 4"],
            |f| {
                f.cameras[0].parameters.pop();
                f.write_files();
            },
        ),
        case("a camera listed twice", ColmapText, Fatal, "bad-model", &["line 3: camera 1 is listed twice"], |f| {
            f.cameras.push(f.cameras[0].clone());
            f.write_files();
        }),
        case(
            "a word where a number is needed",
            ColmapText,
            Fatal,
            "bad-model",
            &["images.txt`: line 2: `east` is no quaternion"],
            |f| {
                edit(f.write_files(), "sparse/0/images.txt", |text| {
                    text.replacen("1 1.0", "1 east", 1).replacen("1 0.9", "1 east 0.9", 1)
                })
            },
        ),
        case(
            "the empty lines of images.txt taken out",
            ColmapText,
            Fatal,
            "bad-model",
            &[
                "images.txt`: line 5: 10 numbers of observations, needed: 3 for each; one of an image's two lines is missing",
            ],
            |f| edit(f.write_files(), "sparse/0/images.txt", |text| text.replace("\n\n", "\n")),
        ),
        case(
            "a line cut",
            ColmapText,
            Fatal,
            "bad-model",
            &["points3D.txt`: line 3: the line ends where the coordinate"],
            |f| {
                edit(f.write_files(), "sparse/0/points3D.txt", |text| {
                    text.lines().take(2).collect::<Vec<_>>().join("\n") + "\n0 1.5"
                });
            },
        ),
        case(
            "no image posed",
            ColmapBinary,
            Fatal,
            "too-few-views",
            &["0 of 0 training views can be used, needed: at least 3"],
            |f| {
                f.photos.clear();
                f.write_files();
            },
        ),
    ]
}

fn transforms() -> Vec<Case> {
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
            "a fisheye",
            Nerfstudio,
            Fatal,
            "camera-model",
            &["all frames has the camera model `OPENCV_FISHEYE`", "undistort the capture first"],
            |f| {
                f.shared.push_str(", \"camera_model\": \"OPENCV_FISHEYE\"");
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
            Fatal,
            "unreadable-file",
            &["sparse.ply`: ", "check that the file is there"],
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

fn views() -> Vec<Case> {
    vec![
        case(
            "images missing",
            ColmapText,
            Views,
            "missing-image",
            &[
                "train views left out: 2",
                "p_03.png: image missing: `",
                "does not exist; restore it or take the view out of the model",
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
            "an image without content",
            Nerfstudio,
            Views,
            "unreadable-image",
            &["images/p_05.png: image unreadable: `", "replace it with a whole PNG or JPEG"],
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
            "a format that is not read",
            Blender,
            Views,
            "unreadable-image",
            &["images/p_05.png: image unreadable", "replace it with a whole PNG or JPEG"],
            |f| {
                f.write_files().write("images/p_05.png", b"RIFF\x24\0\0\0WEBPVP8 ");
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
            "one frame with a fisheye",
            Nerfstudio,
            Views,
            "camera-model",
            &["images/p_02.png: its camera model is `is_fisheye`"],
            |f| {
                f.photos[2].extra = "\"is_fisheye\": true, ".to_owned();
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
    ]
}

fn doubts() -> Vec<Case> {
    vec![
        case(
            "images without a pose",
            ColmapText,
            Doubt,
            "unposed-image",
            &["images without a pose: 4 (p_08.png, p_09.png, p_10.png, … and 1 more)"],
            |f| {
                f.photos.truncate(8);
                f.write_files();
            },
        ),
        case(
            "few views",
            Blender,
            Doubt,
            "few-views",
            &["10 of 10 training views can be used, needed: at least 20 for a good scene"],
            |f| {
                f.write_files();
            },
        ),
        case(
            "no test split",
            Blender,
            Doubt,
            "no-test-views",
            &["warning[no-test-views]: no views are held out", "transforms_test.json` is missing"],
            |f| {
                f.write_files().remove("transforms_test.json");
            },
        ),
        case(
            "a camera far away",
            ColmapBinary,
            Doubt,
            "pose-outlier",
            &["cameras far from the others: 1 (p_07.png)", "take these views out"],
            |f| {
                f.photos[7].centre *= 100.0;
                f.write_files();
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
        case(
            "coordinates of a map",
            ColmapText,
            Doubt,
            "far-from-origin",
            &["7.071e6 from the origin", "subtract a common offset"],
            |f| {
                let offset = DVec3::new(5e6, 5e6, 0.0);
                f.photos.iter_mut().for_each(|photo| photo.centre += offset);
                f.points.iter_mut().for_each(|point| *point += offset);
                f.write_files();
            },
        ),
        case(
            "a scene far away",
            ColmapBinary,
            Doubt,
            "little-parallax",
            &["there is hardly any parallax", "places farther apart"],
            |f| {
                f.photos.iter_mut().for_each(|photo| photo.centre *= 0.0005);
                f.write_files();
            },
        ),
        case(
            "two views of one pose",
            Nerfstudio,
            Doubt,
            "repeated-pose",
            &["views that share their pose with another: 2 (images/p_04.png, images/p_05.png)"],
            |f| {
                (f.photos[5].rotation, f.photos[5].centre) = (f.photos[4].rotation, f.photos[4].centre);
                f.write_files();
            },
        ),
        case(
            "an image listed twice",
            ColmapBinary,
            Doubt,
            "repeated-image",
            &["images listed more than once: 1 (p_05.png)"],
            |f| {
                f.photos[6].name = f.photos[5].name.clone();
                f.write_files();
            },
        ),
        case(
            "distortion",
            ColmapBinary,
            Doubt,
            "distortion",
            &["note[distortion]: images with lens distortion: 12; it moves pixels by up to 1.5 px"],
            |f| {
                f.cameras[0].model = (2, "SIMPLE_RADIAL");
                f.cameras[0].parameters = vec![20.0, 12.0, 8.0, 0.2];
                f.write_files();
            },
        ),
        case(
            "a principal point outside",
            ColmapText,
            Doubt,
            "principal-point",
            &["images whose principal point lies outside them: 12"],
            |f| {
                f.cameras[0].parameters[2] = 48.0;
                f.write_files();
            },
        ),
        case(
            "photographs with alpha",
            Nerfstudio,
            Doubt,
            "alpha",
            &["photographs with an alpha channel", ": 1 (images/p_03.png)", "give them as masks"],
            |f| {
                let rgba = [90; 24 * 16 * 4];
                image::save_buffer(
                    f.write_files().at("images/p_03.png"),
                    &rgba,
                    24,
                    16,
                    image::ExtendedColorType::Rgba8,
                )
                .expect("an image");
            },
        ),
        case(
            "renderings without alpha",
            Blender,
            Doubt,
            "no-alpha",
            &["images without an alpha channel", ": 1 (images/p_03.png)"],
            |f| {
                flat_image(f.write_files(), "images/p_03.png");
            },
        ),
        case(
            "an image of a single colour",
            ColmapText,
            Doubt,
            "flat-image",
            &["images of a single colour: 1 (p_03.png)"],
            |f| {
                flat_image(f.write_files(), "images/p_03.png");
            },
        ),
        case(
            "an EXIF orientation",
            ColmapBinary,
            Doubt,
            "exif-orientation",
            &["images with an EXIF orientation, which is not applied", ": 1 (p_03.png)"],
            |f| {
                turned_image(f.write_files(), "images/p_03.png");
            },
        ),
        case(
            "a distortion beyond sense",
            Nerfstudio,
            Doubt,
            "mostly-masked",
            &["images of which less than 10 % counts: 12"],
            |f| {
                f.shared.push_str(", \"k1\": 500.0");
                f.write_files();
            },
        ),
        case(
            "images of several sizes",
            ColmapText,
            Doubt,
            "mixed-sizes",
            &["images of another size than the 24×16 px of most: 1 (p_03.png)"],
            |f| {
                f.write_files().write_image("images/p_03.png", (48, 32));
            },
        ),
        case(
            "no points",
            ColmapBinary,
            Doubt,
            "no-points",
            &["points3D.bin` is missing, so training starts from random points"],
            |f| {
                f.write_files().remove("sparse/0/points3D.bin");
            },
        ),
        case(
            "an empty list of points",
            ColmapText,
            Doubt,
            "no-points",
            &["points3D.txt` is empty, so training starts from random points"],
            |f| {
                f.points.clear();
                f.write_files();
            },
        ),
        case(
            "few points",
            ColmapText,
            Doubt,
            "few-points",
            &["points3D.txt` holds 7 points, needed: at least 100"],
            |f| {
                f.points.truncate(7);
                f.write_files();
            },
        ),
        case(
            "points of another reconstruction",
            ColmapBinary,
            Doubt,
            "points-unseen",
            &["only 0 % of the points", "points and poses of one reconstruction"],
            |f| {
                look_away(f);
                f.write_files();
            },
        ),
        case(
            "several models",
            ColmapBinary,
            Doubt,
            "several-models",
            &["the capture has several models, of which only `sparse/0` is read"],
            |f| {
                f.write_files().write("sparse/1/cameras.bin", "");
            },
        ),
    ]
}

fn told(diagnosis: &Diagnosis, code: &str) -> bool {
    diagnosis.findings.iter().any(|finding| finding.code == code)
}

fn check(case: &Case) {
    let name = case.name;
    let mut fixture = Fixture::new(case.kind, N_VIEWS);
    fixture.points = (0..120).map(|i| DVec3::new(0.01 * f64::from(i) - 0.6, 0.2, 0.05 * f64::from(i % 7))).collect();
    (case.write)(&mut fixture);
    let diagnosis = diagnose(fixture.path(), &LoadOptions::default());
    let text = match (case.harm, fixture.load()) {
        (Fatal, Err(error)) => error.to_string(),
        (Fatal, Ok((_, report))) => panic!("{name}: loaded, but must not: {report}"),
        (harm, Err(error)) => panic!("{name}: {harm:?}, but loading fails: {error}"),
        (Views, Ok((capture, report))) => {
            assert_eq!(capture.train.len() + capture.test.len() + report.skipped.len(), N_VIEWS, "{name}: {report}");
            assert!(!report.skipped.is_empty(), "{name}: no view is left out");
            report.to_string()
        }
        (Doubt, Ok(_)) => diagnosis.to_string(),
    };
    for part in case.says {
        assert!(text.contains(part), "{name}: `{part}` is not in: {text}");
    }
    assert!(told(&diagnosis, case.code), "{name}: no finding `{}` in:\n{diagnosis}", case.code);
    assert_eq!(diagnosis.has_errors(), case.harm == Fatal, "{name}:\n{diagnosis}");
    for finding in &diagnosis.findings {
        let needs_remedy = finding.severity != Severity::Note;
        assert!(!needs_remedy || !finding.remedy.is_empty(), "{name}: a finding without remedy: {finding}");
    }
    // What headers and poses tell is told without decoding.
    let cheap = diagnose_cheaply(fixture.path(), &LoadOptions::default());
    let needs_pixels = ["flat-image", "mostly-masked"].contains(&case.code)
        || ["an image cut behind its header", "a mask of another size"].contains(&name);
    assert_eq!(told(&cheap, case.code), !needs_pixels, "{name}: without decoding:\n{cheap}");
}

#[test]
fn captures_of_unknown_or_incomplete_layout() {
    layouts().iter().for_each(check);
}

#[test]
fn damaged_colmap_models() {
    models().iter().for_each(check);
}

#[test]
fn damaged_transforms_files() {
    transforms().iter().for_each(check);
}

#[test]
fn views_that_cannot_be_used() {
    views().iter().for_each(check);
}

#[test]
fn captures_that_load_but_are_doubtful() {
    doubts().iter().for_each(check);
}

#[test]
fn names_of_cases_are_distinct_and_every_layout_is_broken_often() {
    let cases: Vec<Case> = [layouts(), models(), transforms(), views(), doubts()].into_iter().flatten().collect();
    let names: std::collections::BTreeSet<_> = cases.iter().map(|case| case.name).collect();
    assert_eq!(names.len(), cases.len(), "names");
    for kind in [Blender, ColmapBinary, ColmapText, Nerfstudio] {
        let n = cases.iter().filter(|case| case.kind == kind).count();
        assert!(n >= 5, "{kind:?}: {n} cases");
    }
}

#[test]
fn a_diagnosis_serialises_for_programs() {
    let fixture = Fixture::new(ColmapBinary, N_VIEWS);
    fixture.write_files().remove("images/p_03.png");
    let json = serde_json::to_value(diagnose(fixture.path(), &LoadOptions::default())).expect("JSON");
    assert_eq!((&json["layout"], &json["n_train"], &json["decoded"]), (&"colmap".into(), &9.into(), &true.into()));
    let findings = json["findings"].as_array().expect("a list");
    let missing = findings.iter().find(|finding| finding["code"] == "missing-image").expect("the finding");
    assert_eq!((&missing["severity"], &missing["numbers"]["views"]), (&"warning".into(), &1.0.into()));
    assert!(missing["files"][0].as_str().is_some_and(|file| file.ends_with("images/p_03.png")), "{missing}");
}

#[test]
fn every_cut_of_a_binary_model_is_an_error_or_a_smaller_model() {
    let fixture = Fixture::new(ColmapBinary, 4);
    for (name, bytes) in fixture.files() {
        fixture.write_files();
        for n in (0..bytes.len()).step_by(7) {
            fixture.write(name, &bytes[..n]);
            assert!(fixture.load().is_err(), "{name} cut to {n} of {} bytes loads", bytes.len());
        }
    }
}

#[test]
fn options_out_of_range_are_refused() {
    let fixture = Fixture::new(ColmapBinary, 4);
    let error = |options| fixture.write_files().load_with(&options).expect_err("out of range").to_string();
    let message = error(LoadOptions { test_every: 1, ..LoadOptions::default() });
    assert!(message.contains("one view in 1 is to be held out, needed: at least 2"), "{message}");
    let message = error(LoadOptions { images: Some("images_8".to_owned()), ..LoadOptions::default() });
    assert!(message.contains("has no folder `images_8`: there are `images`; give `--images`"), "{message}");
}
