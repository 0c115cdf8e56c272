//! Captures of no layout, or of one that lacks a part.

use super::Harm::Fatal;
use super::{Case, case, cut, edit};
use crate::exports::{write_nsvf, write_polycam, write_record3d};
use crate::fixture::Kind::{Blender, ColmapBinary, ColmapText, Nerfstudio};

pub(super) fn cases() -> Vec<Case> {
    vec![
        case("no capture at all", Blender, Fatal, "unknown-layout", |f| {
            std::fs::remove_dir_all(f.at("images")).expect("images")
        })
        .says(&[
            "looked for `transforms_train.json` (Blender), `sparse/0/cameras.bin`",
            "none of them; give the folder",
        ]),
        #[cfg(unix)]
        case("a model behind a link that leads nowhere", ColmapBinary, Fatal, "unreadable-file", |f| {
            std::os::unix::fs::symlink("/gone/sparse", f.at("sparse")).expect("a link")
        })
        .says(&[
            "cannot reach `",
            "the link `",
            "/sparse` leads to `/gone/sparse`, which is not there; mend the link",
        ]),
        #[cfg(unix)]
        case("a model in a folder that cannot be looked into", ColmapText, Fatal, "unreadable-file", |f| {
            // A permission would not stop the system's administrator, whom tests may be run by.
            std::os::unix::fs::symlink("sparse", f.at("sparse")).expect("a link")
        })
        .says(&["cannot reach `", "/sparse`: ", "allow it: `chmod -R u+rX /"]),
        case("photographs without poses", ColmapBinary, Fatal, "no-capture", |_| {}).says(&[
            "/images` holds 12 photographs but no poses; find them, and give the folder `/",
            "`:\n  pocketsplat poses /",
            "\n(`pocketsplat train --poses` does so before it trains)",
        ]),
        case("photographs of a telephone without poses", ColmapBinary, Fatal, "no-capture", |f| {
            std::fs::remove_dir_all(f.at("images")).expect("images");
            f.write("IMG_0001.HEIC", "");
            f.write("IMG_0002.HEIC", "");
        })
        .says(&[
            "holds 2 photographs but no poses; find them, and give the folder `/",
            "-capture`:\n  pocketsplat poses /",
        ]),
        case("raw photographs without poses", ColmapBinary, Fatal, "no-capture", |f| {
            std::fs::remove_dir_all(f.at("images")).expect("images");
            for name in ["1.ARW", "1.CR2", "1.CR3", "1.NEF", "1.ORF", "1.RAF", "1.RW2"] {
                f.write(name, "");
            }
        })
        .says(&[
            "holds 7 photographs but no poses; convert those of a format that is not read:\n  magick mogrify \
             -format jpg -quality 95 '",
            "/*.ARW'\nthen find them, and give the folder `/",
        ]),
        case("a film", Nerfstudio, Fatal, "no-capture", |f| {
            std::fs::remove_dir_all(f.at("images")).expect("images");
            f.write("walk.MOV", "");
        })
        .says(&[
            "/walk.MOV` is a film, needed: photographs with poses; find them, and give the folder `/",
            "/walk`:\n  pocketsplat poses /",
            "/walk.MOV -o /",
        ]),
        case("a packed capture", Nerfstudio, Fatal, "no-capture", |f| {
            std::fs::remove_dir_all(f.at("images")).expect("images");
            f.write("shoe.r3d", "");
        })
        .says(&["/shoe.r3d` is a packed capture, needed: its files; unpack it", "unzip /", "/shoe.r3d -d /"]),
        case("a camera of Polycam cut", Nerfstudio, Fatal, "bad-export", |f| {
            write_polycam(f, "cameras", "images");
            cut(f, "keyframes/cameras/p_04.json", 40);
        })
        .says(&[
            "p_04.json` is not a camera of Polycam: EOF",
            "it needs `fx`, `fy`,",
            "export the capture again",
        ]),
        case("metadata of Record3D without poses", Nerfstudio, Fatal, "bad-export", |f| {
            write_record3d(f, "metadata", "rgbd", 0);
            edit(f, "metadata", |text| text.replace("poses", "places"));
        })
        .says(&["metadata` is not metadata of Record3D: missing field `poses`", "`poses` of 7 numbers each"]),
        case("intrinsics of NSVF that are words", Nerfstudio, Fatal, "bad-model", |f| {
            write_nsvf(f, "focal 20\n", |_| "")
        })
        .says(&["intrinsics.txt`: line 1: `focal` is no number"]),
        case("intrinsics of NSVF without a principal point", Nerfstudio, Fatal, "bad-model", |f| {
            write_nsvf(f, "20.0\n", |_| "")
        })
        .says(&["intrinsics.txt`: line 1: no intrinsics, needed: a matrix of 4 by 4 numbers"]),
        case("the capture is a folder further in", Nerfstudio, Fatal, "unknown-layout", |f| {
            f.write("fox/transforms.json", "{}")
        })
        .says(&["its folder `", "/fox` is one, give that"]),
        case("no folder of images", ColmapText, Fatal, "image-folder", |f| {
            std::fs::rename(f.write_files().at("images"), f.at("photos")).expect("a folder")
        })
        .says(&["has no folder of images: there is neither `images` nor `images_…` nor `input`; put the photographs \
                 into `images`"]),
        case("several reduced folders of images", ColmapBinary, Fatal, "image-folder", |f| {
            std::fs::rename(f.write_files().at("images"), f.at("images_2")).expect("a folder");
            f.write_image("images_4/p_00.png", (6, 4));
        })
        .says(&["there are `images_2`, `images_4`; choose one with `--images`"]),
    ]
}
