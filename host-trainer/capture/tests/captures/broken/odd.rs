//! Captures that are odd but lack nothing: all views load, and the code of each case is one that must not be told.

use super::Harm::Nothing;
use super::{Case, case, edit};
use crate::exports::{NSVF_MATRIX, write_nsvf, write_polycam, write_record3d};
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
    cases
}

fn paths() -> Vec<Case> {
    vec![
        case("names without extension", Nerfstudio, Nothing, "unposed-image", &["warnings: 1,"], |f| {
            replace(f, ".png", "");
        }),
        case("names of JPEG for images of PNG", Nerfstudio, Nothing, "unposed-image", &["warnings: 1,"], |f| {
            replace(f, ".png", ".jpg");
        }),
        case("images converted to JPEG", ColmapText, Nothing, "missing-image", &["warnings: 1,"], |f| {
            f.write_files();
            for photo in &f.photos {
                let jpeg = photo.name.replace(".png", ".JPG");
                image::open(f.at("images").join(&photo.name))
                    .expect("written")
                    .save(f.at("images").join(jpeg))
                    .expect("JPEG");
                f.remove(&format!("images/{}", photo.name));
            }
        }),
        case("images converted to WebP", Nerfstudio, Nothing, "image-format", &["warnings: 1,"], |f| {
            f.write_files();
            for photo in &f.photos {
                let webp = photo.name.replace(".png", ".webp");
                image::open(f.at("images").join(&photo.name))
                    .expect("written")
                    .save(f.at("images").join(webp))
                    .expect("WebP");
                f.remove(&format!("images/{}", photo.name));
            }
        }),
        case("images converted beside the originals", ColmapText, Nothing, "image-format", &["warnings: 1,"], |f| {
            f.photos.iter_mut().for_each(|photo| photo.name = photo.name.replace(".png", ".heic"));
            f.write_files();
            f.photos.iter().for_each(|photo| f.write(&format!("images/{}", photo.name), b"\0\0\0\x18ftypheic"));
        }),
        case("names of no folder", Nerfstudio, Nothing, "missing-image", &["warnings: 1,"], |f| {
            replace(f, "./images/", "");
        }),
        case("names from the folder above", Nerfstudio, Nothing, "missing-image", &["warnings: 1,"], |f| {
            replace(f, "./images/", "fox/images/");
        }),
        case("paths over a folder that is not there", Nerfstudio, Nothing, "unposed-image", &["warnings: 1,"], |f| {
            replace(f, "./images/", "colmap/../images/");
        }),
        case("absolute paths", Nerfstudio, Nothing, "unposed-image", &["warnings: 1,"], |f| {
            let images = format!("{}/", f.at("images").display());
            replace(f, "./images/", &images);
        }),
        case("absolute paths of another machine", Nerfstudio, Nothing, "unposed-image", &["warnings: 1,"], |f| {
            replace(f, "./images/", "/home/ann/photographs/");
        }),
        case("paths of Windows", Nerfstudio, Nothing, "unposed-image", &["warnings: 1,"], |f| {
            replace(f, "./images/", "C:\\\\Users\\\\ann\\\\fox\\\\images\\\\");
        }),
        case("backslashes in a model", ColmapText, Nothing, "missing-image", &["warnings: 1,"], |f| {
            f.photos.iter_mut().for_each(|photo| photo.name = format!("left\\{}", photo.name));
            std::fs::create_dir(f.at("images/left")).expect("a folder");
            for i in 0..super::N_VIEWS {
                let name = format!("p_{i:02}.png");
                std::fs::rename(f.at("images").join(&name), f.at("images/left").join(&name)).expect("written");
            }
            f.write_files();
        }),
        case(
            "names in a model that start with the folder",
            ColmapBinary,
            Nothing,
            "unposed-image",
            &["warnings: 1,"],
            |f| {
                f.photos.iter_mut().for_each(|photo| photo.name = format!("images/{}", photo.name));
                f.write_files();
            },
        ),
        case(
            "renderings stored as JPEG names",
            Blender,
            Nothing,
            "missing-image",
            &["10 views to train, 2 to test"],
            |f| {
                f.photos.iter_mut().for_each(|photo| photo.name = photo.name.replace(".png", ".jpg"));
                f.write_files();
            },
        ),
        case("masks beside the images", Nerfstudio, Nothing, "unposed-image", &["warnings: 1,"], |f| {
            f.photos[2].extra = "\"mask_path\": \"images/mask_02.png\", ".to_owned();
            f.write_image("images/mask_02.png", SIZE_PX);
            f.write_files();
        }),
    ]
}

fn layouts() -> Vec<Case> {
    vec![
        case("a model in `sparse` itself", ColmapBinary, Nothing, "several-models", &["COLMAP capture"], |f| {
            f.write_files();
            for name in ["cameras.bin", "images.bin", "points3D.bin"] {
                std::fs::rename(f.at("sparse/0").join(name), f.at("sparse").join(name)).expect("written");
            }
        }),
        case("a model in `colmap/sparse/0`", ColmapText, Nothing, "several-models", &["COLMAP capture"], |f| {
            std::fs::create_dir(f.write_files().at("colmap")).expect("a folder");
            std::fs::rename(f.at("sparse"), f.at("colmap/sparse")).expect("written");
        }),
        case(
            "transforms beside the model they were made from",
            Nerfstudio,
            Nothing,
            "no-alpha",
            &["nerfstudio"],
            |f| {
                f.write_files().write("colmap/sparse/0/cameras.bin", "");
            },
        ),
        case("a second model that is not the first", ColmapBinary, Nothing, "several-models", &["COLMAP"], |f| {
            std::fs::rename(f.write_files().at("sparse/0"), f.at("sparse/4")).expect("written");
        }),
        case("photographs in `input`", ColmapText, Nothing, "image-folder", &["warnings: 1,"], |f| {
            std::fs::rename(f.write_files().at("images"), f.at("input")).expect("a folder");
        }),
        case("photographs beside `sparse`", ColmapBinary, Nothing, "unposed-image", &["warnings: 1,"], |f| {
            f.write_files();
            for photo in &f.photos {
                std::fs::rename(f.at("images").join(&photo.name), f.at(&photo.name)).expect("written");
            }
            std::fs::remove_dir(f.at("images")).expect("empty");
        }),
        case(
            "masks beside a model",
            ColmapBinary,
            Nothing,
            "missing-masks",
            &["pixels that do not count", ": 12"],
            |f| {
                f.write_files();
                for (i, photo) in f.photos.iter().enumerate() {
                    let name = if i.is_multiple_of(2) { format!("{}.png", photo.name) } else { photo.name.clone() };
                    f.write_mask(&format!("masks/{name}"), SIZE_PX);
                }
            },
        ),
        case(
            "masks at twice the size of the images",
            ColmapText,
            Nothing,
            "bad-mask",
            &["do not count", ": 12"],
            |f| {
                f.write_files();
                for photo in &f.photos {
                    f.write_mask(&format!("masks/{}", photo.name), (2 * SIZE_PX.0, 2 * SIZE_PX.1));
                }
            },
        ),
        case(
            "photographs cut out of their background",
            ColmapBinary,
            Nothing,
            "no-alpha",
            &["note[alpha]", ": 12 ("],
            |f| {
                f.write_files();
                for photo in &f.photos {
                    let image = image::open(f.at("images").join(&photo.name)).expect("written").into_rgba8();
                    image.save(f.at("images").join(&photo.name)).expect("an image");
                }
            },
        ),
        case("a fisheye", ColmapBinary, Nothing, "camera-model", &["images with lens distortion: 12"], |f| {
            f.cameras[0].model = (5, "OPENCV_FISHEYE");
            f.cameras[0].parameters = vec![20.0, 20.0, 12.0, 8.0, 0.01, 0.0, 0.0, 0.0];
            f.write_files();
        }),
        case(
            "a fisheye of instant-ngp",
            Nerfstudio,
            Nothing,
            "camera-model",
            &["images with lens distortion: 12"],
            |f| {
                f.shared.push_str(", \"is_fisheye\": true, \"k1\": 0.01");
                f.write_files();
            },
        ),
        case("an export of Polycam", Nerfstudio, Nothing, "unposed-image", &["Polycam capture", "warnings: 1,"], |f| {
            write_polycam(f, "corrected_cameras", "corrected_images");
        }),
        case(
            "an export of Record3D",
            Nerfstudio,
            Nothing,
            "unposed-image",
            &["Record3D capture", "warnings: 1,"],
            |f| {
                write_record3d(f, "metadata", "rgbd", 0);
            },
        ),
        case("a raw capture of NSVF", Nerfstudio, Nothing, "unposed-image", &["NSVF capture", "warnings: 1,"], |f| {
            write_nsvf(f, NSVF_MATRIX, |_| "");
        }),
        case("a rational lens", ColmapText, Nothing, "camera-model", &["images with lens distortion: 12"], |f| {
            f.cameras[0].model = (6, "FULL_OPENCV");
            f.cameras[0].parameters = vec![20.0, 20.0, 12.0, 8.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0];
            f.write_files();
        }),
    ]
}

fn texts() -> Vec<Case> {
    vec![
        case("transforms behind a byte order mark", Nerfstudio, Nothing, "bad-transforms", &["warnings: 1,"], |f| {
            edit(f.write_files(), "transforms.json", |text| format!("\u{feff}{text}"));
        }),
        case("renderings behind a byte order mark", Blender, Nothing, "bad-transforms", &["2 to test"], |f| {
            f.write_files();
            for name in ["transforms_train.json", "transforms_test.json"] {
                edit(f, name, |text| format!("\u{feff}{text}"));
            }
        }),
        case("a text model behind byte order marks", ColmapText, Nothing, "bad-model", &["warnings: 1,"], |f| {
            f.write_files();
            for name in ["cameras", "images", "points3D"] {
                // Without the comment that would hide the mark.
                edit(f, &format!("sparse/0/{name}.txt"), |text| {
                    format!("\u{feff}{}", text.lines().skip(1).collect::<Vec<_>>().join("\n"))
                });
            }
        }),
        case("transforms in UTF-16", Nerfstudio, Nothing, "unreadable-file", &["warnings: 1,"], |f| {
            let text = String::from_utf8(f.files().remove(0).1).expect("text");
            let units = text.encode_utf16().flat_map(u16::to_le_bytes);
            f.write("transforms.json", [0xFF, 0xFE].into_iter().chain(units).collect::<Vec<u8>>());
        }),
    ]
}
