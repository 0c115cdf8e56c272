//! Views whose photographs or masks cannot be used: left out where enough others are sound.

use super::Harm::{Fatal, Views};
use super::{Case, N_VIEWS, case, cut, turned_image};
use crate::exports::write_record3d;
use crate::fixture::Kind::{Blender, ColmapBinary, ColmapText, Nerfstudio};
use crate::fixture::SIZE_PX;

pub(super) fn cases() -> Vec<Case> {
    vec![
        case("images missing", ColmapText, Views, "missing-image", |f| {
            f.write_files().remove("images/p_03.png");
            f.remove("images/p_04.png");
        })
        .says(&[
            "train views left out: 2",
            "p_03.png: image missing: `",
            "does not exist, nor does the same with the extension png or jpg or jpeg or webp; restore it or \
             take the view out of the model",
        ]),
        case("all images missing", Nerfstudio, Fatal, "too-few-views", |f| {
            f.write_files();
            (0..N_VIEWS).for_each(|i| f.remove(&format!("images/p_{i:02}.png")));
        })
        .says(&["0 of 10 training views can be used", "images/p_01.png: image missing", "and 7 more"]),
        #[cfg(unix)]
        case("images behind links that lead nowhere", ColmapText, Views, "unreadable-image", |f| {
            f.write_files().remove("images/p_03.png");
            std::os::unix::fs::symlink("/gone/p_03.png", f.at("images/p_03.png")).expect("a link");
        })
        .says(&[
            "p_03.png: image out of reach: `",
            "/p_03.png` leads to `/gone/p_03.png`, which is not there; mend the link",
        ]),
        case("an image missing that another folder has", ColmapText, Views, "missing-image", |f| {
            f.photos[3].name = "left/p_03.png".to_owned();
            f.write_image("images/left/p_99.png", (24, 16));
            f.write_files();
        })
        .says(&["left/p_03.png: image missing: `", "images/left/p_03.png` does not exist"]),
        case("an image without content", Nerfstudio, Views, "unreadable-image", |f| {
            f.write_files().write("images/p_05.png", "");
        })
        .says(&["images/p_05.png: image unreadable: `", "replace it with a whole PNG, JPEG or WebP"]),
        case("an image cut behind its header", ColmapBinary, Views, "unreadable-image", |f| {
            cut(f.write_files(), "images/p_05.png", 60);
        })
        .says(&["p_05.png: image unreadable"]),
        case("a JPEG cut in its picture", ColmapBinary, Views, "unreadable-image", |f| {
            turned_image(f.write_files(), "images/p_05.png");
            cut(f, "images/p_05.png", 800);
        })
        .says(&[
            "p_05.png: image unreadable: `",
            "the JPEG ends after 800 bytes without its end marker (FF D9), so the file was cut",
            "replace it with a whole PNG, JPEG or WebP",
        ]),
        case("a JPEG whose copy was never finished", Nerfstudio, Views, "unreadable-image", |f| {
            turned_image(f.write_files(), "images/p_05.png");
            let mut bytes = std::fs::read(f.at("images/p_05.png")).expect("it was written");
            let half = bytes.len() / 2 + 300;
            bytes[half..].fill(0);
            f.write("images/p_05.png", bytes);
        })
        .says(&["images/p_05.png: image unreadable", "without its end marker (FF D9)"]),
        case("a format that is not read", Blender, Views, "unreadable-image", |f| {
            f.write_files().write("images/p_05.png", b"RIFF\x24\0\0\0WEBPVP8 ");
        })
        .says(&["images/p_05.png: image unreadable", "replace it with a whole PNG, JPEG or WebP"]),
        case("images of a format that has to be converted", Nerfstudio, Views, "image-format", |f| {
            f.write_files().write("images/p_05.png", b"\0\0\0\x18ftypheic\0\0\0\0");
            f.write("images/p_06.png", b"\0\0\0\x1Cftypavif\0\0\0\0");
        })
        .says(&[
            "p_05.png` is HEIC, needed: PNG, JPEG or WebP; convert the images, names need not change in the capture:\n",
            "magick mogrify -format jpg -quality 95 '",
        ]),
        case("a raw photograph", ColmapText, Views, "image-format", |f| {
            f.write_files().write("images/p_05.png", b"II*\0\x08\0\0\0\x01\0\0\0");
        })
        .says(&["p_05.png` is TIFF or raw, needed: PNG, JPEG or WebP"]),
        case("a WebP cut", ColmapText, Views, "unreadable-image", |f| {
            let image = image::open(f.write_files().at("images/p_05.png")).expect("written");
            image.save_with_format(f.at("images/p_05.png"), image::ImageFormat::WebP).expect("WebP");
            cut(f, "images/p_05.png", 60);
        })
        .says(&["p_05.png: image unreadable"]),
        case("a picture of Record3D missing", Nerfstudio, Views, "missing-image", |f| {
            write_record3d(f, "metadata", "rgbd", 0);
            f.remove("rgbd/4.png");
        })
        .says(&["rgbd/4` does not exist"]),
        case("an image of another size among renderings", Blender, Views, "image-size", |f| {
            f.write_files().write_image("images/p_06.png", (12, 8));
        })
        .says(&["p_06.png` is 12×8 px, the training images are 24×16 px; export it again at that size"]),
        case("an image turned on its side", ColmapBinary, Views, "image-shape", |f| {
            f.write_files().write_image("images/p_06.png", (16, 24));
        })
        .says(&["p_06.png` is 16×24 px, its camera is for 24×16 px", "it is turned on its side; store it as"]),
        case("an image cropped", Nerfstudio, Views, "image-shape", |f| {
            f.write_files().write_image("images/p_06.png", (24, 10));
        })
        .says(&["p_06.png` is 24×10 px, its camera is for 24×16 px, which is another shape; use the images"]),
        case("a mask of another size beside a model", ColmapBinary, Views, "bad-mask", |f| {
            f.write_files().write_image("masks/p_02.png.png", (24, 8));
        })
        .says(&["p_02.png: its mask `", "masks/p_02.png.png` is 24×8 px, its image 24×16 px; restore the mask"]),
        case("a mask missing", Nerfstudio, Views, "bad-mask", |f| {
            f.photos[2].extra = "\"mask_path\": \"masks/2.png\", ".to_owned();
            f.write_files();
        })
        .says(&["images/p_02.png: its mask `", "masks/2.png` does not exist; restore the mask"]),
        case("a mask missing that is called as its image", Nerfstudio, Views, "bad-mask", |f| {
            f.photos[2].extra = "\"mask_path\": \"masks/p_02.png\", ".to_owned();
            f.write_files();
        })
        .says(&["images/p_02.png: its mask `", "masks/p_02.png` does not exist; restore the mask"]),
        case("a mask of another size", Nerfstudio, Views, "bad-mask", |f| {
            f.photos[2].extra = "\"mask_path\": \"masks/2.png\", ".to_owned();
            f.write_files().write_image("masks/2.png", (5, 4));
        })
        .says(&["is 5×4 px, its image 24×16 px; restore the mask"]),
        case("two photographs of one file", ColmapText, Views, "shared-image", |f| {
            f.photos[2].name = "left/p_02.png".to_owned();
            f.photos[3].name = "right/p_02.png".to_owned();
            f.write_files();
        })
        .says(&[
            "left/p_02.png: its name is `left/p_02.png`, and the file found for it, `",
            "images/p_02.png`, is also found for `right/p_02.png`, but one file is not two photographs; put each",
        ]),
        case("two names of one file but for case", Nerfstudio, Views, "shared-image", |f| {
            f.photos[4].name = "P_03.PNG".to_owned();
            f.write_files();
        })
        .says(&["images/P_03.PNG: its name is", "is also found for `./images/p_03.png`"]),
        case("one mask of two photographs", ColmapBinary, Views, "bad-mask", |f| {
            for (i, side) in [(2, "left"), (3, "right")] {
                f.photos[i].name = format!("{side}/p_02.png");
                f.write_image(&format!("images/{side}/p_02.png"), SIZE_PX);
            }
            f.write_files().write_mask("masks/p_02.png.png", SIZE_PX);
        })
        .says(&["left/p_02.png: its mask `", "masks/p_02.png.png` is also that of `right/p_02.png`"]),
        case("a depth map in place of a photograph", ColmapText, Views, "missing-image", |f| {
            f.photos[3].name = "p_03.jpg".to_owned();
            image::save_buffer(f.at("images/p_03.png"), &[9; 24 * 16 * 2], 24, 16, image::ExtendedColorType::L16)
                .expect("an image");
            f.write_files();
        })
        .says(&["p_03.jpg: image missing"]),
        case("a pointer of Git LFS", Nerfstudio, Views, "unreadable-image", |f| {
            f.write_files()
                .write("images/p_05.png", "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n");
        })
        .says(&[
            "images/p_05.png: image unreadable: `",
            "p_05.png`: it is a Git LFS pointer, not the file itself; run `git lfs pull` in its repository, or \
             replace it with a whole PNG",
        ]),
    ]
}
