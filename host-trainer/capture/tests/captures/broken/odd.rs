//! Captures that are odd but lack nothing: all views load, and the code of each case is one that must not be told.

use super::Harm::Nothing;
use super::{Case, case, edit};
use crate::exports::{
    NSVF_MATRIX, write_bundler, write_llff, write_metashape, write_nsvf, write_opensfm, write_polycam,
    write_realitycapture, write_record3d,
};
use crate::fixture::Kind::{Blender, ColmapBinary, ColmapText, Nerfstudio};
use crate::fixture::{Fixture, SIZE_PX};

/// Replaces text of a transforms file.
fn replace(fixture: &Fixture, from: &str, to: &str) {
    edit(fixture.write_files(), "transforms.json", |text| text.replace(from, to));
}

pub(super) fn cases() -> Vec<Case> {
    let mut cases = paths();
    cases.extend(texts());
    cases.extend(layouts());
    cases.extend(names());
    cases.extend(masks());
    cases
}

fn paths() -> Vec<Case> {
    vec![
        case("names without extension", Nerfstudio, Nothing, "unposed-image", |f| {
            replace(f, ".png", "");
        })
        .says(&["warnings: 1,"]),
        case("names of JPEG for images of PNG", Nerfstudio, Nothing, "unposed-image", |f| {
            replace(f, ".png", ".jpg");
        })
        .says(&["warnings: 1,"]),
        case("images converted to JPEG", ColmapText, Nothing, "missing-image", |f| {
            f.write_files();
            for photo in &f.photos {
                let jpeg = photo.name.replace(".png", ".JPG");
                image::open(f.at("images").join(&photo.name))
                    .expect("written")
                    .save(f.at("images").join(jpeg))
                    .expect("JPEG");
                f.remove(&format!("images/{}", photo.name));
            }
        })
        .says(&["warnings: 1,"]),
        case("images converted to WebP", Nerfstudio, Nothing, "image-format", |f| {
            f.write_files();
            for photo in &f.photos {
                let webp = photo.name.replace(".png", ".webp");
                image::open(f.at("images").join(&photo.name))
                    .expect("written")
                    .save(f.at("images").join(webp))
                    .expect("WebP");
                f.remove(&format!("images/{}", photo.name));
            }
        })
        .says(&["warnings: 1,"]),
        case("images converted beside the originals", ColmapText, Nothing, "image-format", |f| {
            f.photos.iter_mut().for_each(|photo| photo.name = photo.name.replace(".png", ".heic"));
            f.write_files();
            f.photos.iter().for_each(|photo| f.write(&format!("images/{}", photo.name), b"\0\0\0\x18ftypheic"));
        })
        .says(&["warnings: 1,"]),
        case("names of no folder", Nerfstudio, Nothing, "missing-image", |f| {
            replace(f, "./images/", "");
        })
        .says(&["warnings: 1,"]),
        case("names from the folder above", Nerfstudio, Nothing, "missing-image", |f| {
            replace(f, "./images/", "fox/images/");
        })
        .says(&["warnings: 1,"]),
        case("paths over a folder that is not there", Nerfstudio, Nothing, "unposed-image", |f| {
            replace(f, "./images/", "colmap/../images/");
        })
        .says(&["warnings: 1,"]),
        case("absolute paths", Nerfstudio, Nothing, "unposed-image", |f| {
            let images = format!("{}/", f.at("images").display());
            replace(f, "./images/", &images);
        })
        .says(&["warnings: 1,"]),
        case("absolute paths of another machine", Nerfstudio, Nothing, "unposed-image", |f| {
            replace(f, "./images/", "/home/ann/photographs/");
        })
        .says(&["warnings: 1,"]),
        case("paths of Windows", Nerfstudio, Nothing, "unposed-image", |f| {
            replace(f, "./images/", "C:\\\\Users\\\\ann\\\\fox\\\\images\\\\");
        })
        .says(&["warnings: 1,"]),
        case("backslashes in a model", ColmapText, Nothing, "missing-image", |f| {
            f.photos.iter_mut().for_each(|photo| photo.name = format!("left\\{}", photo.name));
            std::fs::create_dir(f.at("images/left")).expect("a folder");
            for i in 0..super::N_VIEWS {
                let name = format!("p_{i:02}.png");
                std::fs::rename(f.at("images").join(&name), f.at("images/left").join(&name)).expect("written");
            }
            f.write_files();
        })
        .says(&["warnings: 1,"]),
        case("names in a model that start with the folder", ColmapBinary, Nothing, "unposed-image", |f| {
            f.photos.iter_mut().for_each(|photo| photo.name = format!("images/{}", photo.name));
            f.write_files();
        })
        .says(&["warnings: 1,"]),
        case("renderings stored as JPEG names", Blender, Nothing, "missing-image", |f| {
            f.photos.iter_mut().for_each(|photo| photo.name = photo.name.replace(".png", ".jpg"));
            f.write_files();
        })
        .says(&["10 views to train, 2 to test"]),
        case("masks beside the images", Nerfstudio, Nothing, "unposed-image", |f| {
            f.photos[2].extra = "\"mask_path\": \"images/mask_02.png\", ".to_owned();
            f.write_image("images/mask_02.png", SIZE_PX);
            f.write_files();
        })
        .says(&["warnings: 2,"]),
    ]
}

fn layouts() -> Vec<Case> {
    vec![
        case("a model in `sparse` itself", ColmapBinary, Nothing, "several-models", |f| {
            f.write_files();
            for name in ["cameras.bin", "images.bin", "points3D.bin"] {
                std::fs::rename(f.at("sparse/0").join(name), f.at("sparse").join(name)).expect("written");
            }
        })
        .says(&["COLMAP capture"]),
        case("a model in `colmap/sparse/0`", ColmapText, Nothing, "several-models", |f| {
            std::fs::create_dir(f.write_files().at("colmap")).expect("a folder");
            std::fs::rename(f.at("sparse"), f.at("colmap/sparse")).expect("written");
        })
        .says(&["COLMAP capture"]),
        case("transforms beside the model they were made from", Nerfstudio, Nothing, "no-alpha", |f| {
            f.write_files().write("colmap/sparse/0/cameras.bin", "");
        })
        .says(&["nerfstudio"]),
        case("a second model that is not the first", ColmapBinary, Nothing, "several-models", |f| {
            std::fs::rename(f.write_files().at("sparse/0"), f.at("sparse/4")).expect("written");
        })
        .says(&["COLMAP"]),
        case("photographs in `input`", ColmapText, Nothing, "image-folder", |f| {
            std::fs::rename(f.write_files().at("images"), f.at("input")).expect("a folder");
        })
        .says(&["warnings: 1,"]),
        case("photographs beside `sparse`", ColmapBinary, Nothing, "unposed-image", |f| {
            f.write_files();
            for photo in &f.photos {
                std::fs::rename(f.at("images").join(&photo.name), f.at(&photo.name)).expect("written");
            }
            std::fs::remove_dir(f.at("images")).expect("empty");
        })
        .says(&["warnings: 1,"]),
        case("masks beside a model", ColmapBinary, Nothing, "missing-masks", |f| {
            f.write_files();
            for (i, photo) in f.photos.iter().enumerate() {
                let name = if i.is_multiple_of(2) { format!("{}.png", photo.name) } else { photo.name.clone() };
                f.write_mask(&format!("masks/{name}"), SIZE_PX);
            }
        })
        .says(&["pixels that do not count", ": 12"]),
        case("masks at twice the size of the images", ColmapText, Nothing, "bad-mask", |f| {
            f.write_files();
            for photo in &f.photos {
                f.write_mask(&format!("masks/{}", photo.name), (2 * SIZE_PX.0, 2 * SIZE_PX.1));
            }
        })
        .says(&["do not count", ": 12"]),
        case("photographs cut out of their background", ColmapBinary, Nothing, "no-alpha", |f| {
            f.write_files();
            for photo in &f.photos {
                let image = image::open(f.at("images").join(&photo.name)).expect("written").into_rgba8();
                image.save(f.at("images").join(&photo.name)).expect("an image");
            }
        })
        .says(&["note[alpha]", ": 12 ("]),
        case("a fisheye", ColmapBinary, Nothing, "camera-model", |f| {
            f.cameras[0].model = (5, "OPENCV_FISHEYE");
            f.cameras[0].parameters = vec![20.0, 20.0, 12.0, 8.0, 0.01, 0.0, 0.0, 0.0];
            f.write_files();
        })
        .says(&["images with lens distortion: 12"]),
        case("a fisheye of instant-ngp", Nerfstudio, Nothing, "camera-model", |f| {
            f.shared.push_str(", \"is_fisheye\": true, \"k1\": 0.01");
            f.write_files();
        })
        .says(&["images with lens distortion: 12"]),
        case("an export of Polycam", Nerfstudio, Nothing, "unposed-image", |f| {
            write_polycam(f, "corrected_cameras", "corrected_images");
        })
        .says(&["Polycam capture", "warnings: 1,"]),
        case("an export of Record3D", Nerfstudio, Nothing, "unposed-image", |f| {
            write_record3d(f, "metadata", "rgbd", 0);
        })
        .says(&["Record3D capture", "warnings: 1,"]),
        case("a raw capture of NSVF", Nerfstudio, Nothing, "unposed-image", |f| {
            write_nsvf(f, NSVF_MATRIX, |_| "");
        })
        .says(&["NSVF capture", "warnings: 1,"]),
        case("a model beside the images", ColmapBinary, Nothing, "unposed-image", |f| {
            f.write_files();
            for name in ["cameras.bin", "images.bin", "points3D.bin"] {
                std::fs::rename(f.at("sparse/0").join(name), f.at(name)).expect("written");
            }
            std::fs::remove_dir_all(f.at("sparse")).expect("empty");
        })
        .says(&["COLMAP capture", "warnings: 1,"]),
        case("a model of the distorted photographs", ColmapText, Nothing, "unposed-image", |f| {
            std::fs::create_dir(f.write_files().at("distorted")).expect("a folder");
            std::fs::rename(f.at("sparse"), f.at("distorted/sparse")).expect("written");
            std::fs::rename(f.at("images"), f.at("input")).expect("a folder");
            // Of the undistorted ones, which are of another shape.
            f.write_image("images/p_00.png", (20, 20));
        })
        .says(&["warnings: 1,"]),
        case("a dense reconstruction", ColmapBinary, Nothing, "unposed-image", |f| {
            f.write_files();
            std::fs::create_dir_all(f.at("dense/0")).expect("a folder");
            std::fs::rename(f.at("sparse/0"), f.at("dense/0/sparse")).expect("written");
            std::fs::remove_dir(f.at("sparse")).expect("empty");
            std::fs::rename(f.at("images"), f.at("dense/0/images")).expect("a folder");
        })
        .says(&["COLMAP capture", "warnings: 1,"]),
        case("a plain fisheye", ColmapBinary, Nothing, "bad-model", |f| {
            f.cameras[0].model = (14, "SIMPLE_FISHEYE");
            f.cameras[0].parameters = vec![20.0, 12.0, 8.0];
            f.write_files();
        })
        .says(&["images with lens distortion: 12"]),
        case("a plain fisheye of two focal lengths", ColmapText, Nothing, "camera-model", |f| {
            f.cameras[0].model = (15, "FISHEYE");
            f.cameras[0].parameters = vec![20.0, 21.0, 12.0, 8.0];
            f.write_files();
        })
        .says(&["distortion: 12"]),
        case("corrected folders of Polycam that are empty", Nerfstudio, Nothing, "too-few-views", |f| {
            write_polycam(f, "cameras", "images");
            f.write("keyframes/corrected_cameras/.keep", "");
            f.write("keyframes/corrected_images/.keep", "");
        })
        .says(&["Polycam"]),
        case("cameras of Metashape", Nerfstudio, Nothing, "unposed-image", |f| {
            write_metashape(f, "frame");
        })
        .says(&["Metashape capture", "warnings: 1,"]),
        case("a table of RealityCapture", Nerfstudio, Nothing, "unposed-image", |f| {
            write_realitycapture(f);
        })
        .says(&["RealityCapture", "warnings: 1,"]),
        case("a capture of LLFF", Nerfstudio, Nothing, "unposed-image", |f| {
            write_llff(f, "<f8", |number| number.to_le_bytes().to_vec());
        })
        .says(&["LLFF capture", "warnings: 1,"]),
        case("a model of Bundler", Nerfstudio, Nothing, "no-points", |f| {
            write_bundler(f);
        })
        .says(&["Bundler capture", "warnings: 1,"]),
        case("a model of OpenSfM", Nerfstudio, Nothing, "no-points", |f| {
            write_opensfm(f);
        })
        .says(&["OpenSfM capture", "several-models"]),
        case("a rational lens", ColmapText, Nothing, "camera-model", |f| {
            f.cameras[0].model = (6, "FULL_OPENCV");
            f.cameras[0].parameters = vec![20.0, 20.0, 12.0, 8.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0];
            f.write_files();
        })
        .says(&["images with lens distortion: 12"]),
    ]
}

/// Renames all photographs on the disk.
fn rename(fixture: &Fixture, name: impl Fn(usize) -> String) {
    for i in 0..super::N_VIEWS {
        std::fs::rename(fixture.at(&format!("images/p_{i:02}.png")), fixture.at("images").join(name(i)))
            .expect("written");
    }
}

/// Renames them in the model.
fn rename_in_model(fixture: &mut Fixture, name: impl Fn(usize) -> String) {
    fixture.photos.iter_mut().enumerate().for_each(|(i, photo)| photo.name = name(i));
    fixture.write_files();
}

const DECOMPOSED: &str = "Ba\u{308}ckerei";

fn names() -> Vec<Case> {
    vec![
        case("names decomposed on the disk", ColmapText, Nothing, "missing-image", |f| {
            rename(f, |i| format!("{DECOMPOSED}_{i:02}.png"));
            rename_in_model(f, |i| format!("Bäckerei_{i:02}.png"));
        })
        .says(&["the form of Unicode: 12"]),
        case("folders decomposed on the disk", ColmapBinary, Nothing, "missing-image", |f| {
            std::fs::create_dir(f.at("images").join(DECOMPOSED)).expect("a folder");
            rename(f, |i| format!("{DECOMPOSED}/p_{i:02}.png"));
            rename_in_model(f, |i| format!("Bäckerei/p_{i:02}.png"));
        })
        .says(&["warnings: 1,"]),
        case("names in another case", Nerfstudio, Nothing, "missing-image", |f| {
            rename(f, |i| format!("P_{i:02}.PNG"));
            f.write_files();
        })
        .says(&["upper and lower case", ": 12"]),
        case("a HEIC beside its conversion", ColmapText, Nothing, "image-format", |f| {
            rename(f, |i| format!("IMG_{i:02}.png"));
            rename_in_model(f, |i| format!("IMG_{i:02}.JPG"));
            f.photos.iter().for_each(|photo| f.write(&format!("images/{}", photo.name), b"\0\0\0\x18ftypheic"));
        })
        .says(&["warnings: 1,"]),
        case("depth maps beside the photographs", ColmapText, Nothing, "unposed-image", |f| {
            rename_in_model(f, |i| format!("p_{i:02}.jpg"));
            for i in 0..super::N_VIEWS {
                let depth = f.at(&format!("images/p_{i:02}.png"));
                image::open(&depth).expect("written").save(depth.with_extension("webp")).expect("WebP");
                let far = [7; (SIZE_PX.0 * SIZE_PX.1 * 2) as usize];
                image::save_buffer(depth, &far, SIZE_PX.0, SIZE_PX.1, image::ExtendedColorType::L16).expect("PNG");
            }
        })
        .says(&["their name with another ending: 12 (`p_00.webp` is read, not `p_00.png`"]),
        case("names of three words without observations", ColmapText, Nothing, "bad-model", |f| {
            rename(f, |i| format!("my  photo {i:02}.png"));
            rename_in_model(f, |i| format!("my  photo {i:02}.png"));
            edit(f, "sparse/0/images.txt", |text| {
                text.lines().filter(|line| line.contains("photo")).map(|line| format!("{line}\n")).collect()
            });
        })
        .says(&["warnings: 1,"]),
        case("names of a byte a letter", ColmapText, Nothing, "unreadable-file", |f| {
            rename(f, |i| format!("café_{i:02}.png"));
            rename_in_model(f, |i| format!("café_{i:02}.png"));
            let text = String::from_utf8(f.files()[1].1.clone()).expect("text");
            f.write("sparse/0/images.txt", text.chars().map(|c| c as u8).collect::<Vec<u8>>());
        })
        .says(&["warnings: 1,"]),
    ]
}

fn masks() -> Vec<Case> {
    /// Writes a mask of each photograph whose left third does not count.
    fn write(f: &Fixture, name: fn(&str) -> String, pixel: fn(bool) -> Vec<u8>, colour: image::ExtendedColorType) {
        let (width_px, height_px) = SIZE_PX;
        for photo in &f.photos {
            let bytes: Vec<u8> =
                (0..width_px * height_px).flat_map(|i| pixel(3 * (i % width_px) >= width_px)).collect();
            let path = f.at(&name(&photo.name));
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            image::save_buffer(path, &bytes, width_px, height_px, colour).expect("an image");
        }
    }
    let says = &["masks: 12 views; of their pixels 33.3 % do not count (least 33.3 % of ", "warnings: 1,"];
    vec![
        case("masks in the alpha channel", ColmapText, Nothing, "empty-masks", |f| {
            let pixel = |counts: bool| vec![255, 255, 255, if counts { 255 } else { 0 }];
            write(f.write_files(), |name| format!("masks/{name}.png"), pixel, image::ExtendedColorType::Rgba8);
        })
        .says(says),
        case("masks of 16 bit with 0 and 1", ColmapBinary, Nothing, "bad-mask", |f| {
            let pixel = |counts: bool| u16::from(counts).to_ne_bytes().to_vec();
            write(f.write_files(), |name| format!("masks/{name}"), pixel, image::ExtendedColorType::L16);
        })
        .says(says),
        case("masks of 16 bit under another ending", ColmapText, Nothing, "missing-masks", |f| {
            f.photos.iter_mut().for_each(|photo| photo.name = photo.name.replace(".png", ".jpg"));
            let pixel = |counts: bool| u16::from(counts).to_ne_bytes().to_vec();
            let name = |name: &str| format!("masks/{}", name.replace(".jpg", ".png"));
            write(f.write_files(), name, pixel, image::ExtendedColorType::L16);
        })
        .says(says),
        case("masks of labels", ColmapText, Nothing, "bad-mask", |f| {
            write(
                f.write_files(),
                |name| format!("masks/{name}"),
                |counts| vec![u8::from(counts)],
                image::ExtendedColorType::L8,
            );
        })
        .says(says),
        case("masks of nearly black and nearly white", ColmapText, Nothing, "empty-masks", |f| {
            let pixel = |counts: bool| vec![if counts { 243 } else { 11 }];
            write(f.write_files(), |name| format!("masks/{name}"), pixel, image::ExtendedColorType::L8);
        })
        .says(says),
        case("dynamic masks of instant-ngp", Nerfstudio, Nothing, "unposed-image", |f| {
            let name = |name: &str| format!("images/dynamic_mask_{name}");
            write(f.write_files(), name, |counts| vec![if counts { 0 } else { 255 }], image::ExtendedColorType::L8);
        })
        .says(says),
    ]
}

fn texts() -> Vec<Case> {
    vec![
        case("transforms behind a byte order mark", Nerfstudio, Nothing, "bad-transforms", |f| {
            edit(f.write_files(), "transforms.json", |text| format!("\u{feff}{text}"));
        })
        .says(&["warnings: 1,"]),
        case("renderings behind a byte order mark", Blender, Nothing, "bad-transforms", |f| {
            f.write_files();
            for name in ["transforms_train.json", "transforms_test.json"] {
                edit(f, name, |text| format!("\u{feff}{text}"));
            }
        })
        .says(&["2 to test"]),
        case("a text model behind byte order marks", ColmapText, Nothing, "bad-model", |f| {
            f.write_files();
            for name in ["cameras", "images", "points3D"] {
                // Without the comment that would hide the mark.
                edit(f, &format!("sparse/0/{name}.txt"), |text| {
                    format!("\u{feff}{}", text.lines().skip(1).collect::<Vec<_>>().join("\n"))
                });
            }
        })
        .says(&["warnings: 1,"]),
        case("transforms in UTF-16", Nerfstudio, Nothing, "unreadable-file", |f| {
            let text = String::from_utf8(f.files().remove(0).1).expect("text");
            let units = text.encode_utf16().flat_map(u16::to_le_bytes);
            f.write("transforms.json", [0xFF, 0xFE].into_iter().chain(units).collect::<Vec<u8>>());
        })
        .says(&["warnings: 1,"]),
    ]
}
