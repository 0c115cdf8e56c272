//! Captures of no layout, or of one that lacks a part.

use super::Harm::Fatal;
use super::{Case, case, cut, edit};
use crate::exports::{write_nsvf, write_polycam, write_record3d};
use crate::fixture::Kind::{Blender, ColmapBinary, ColmapText, Nerfstudio};

pub(super) fn cases() -> Vec<Case> {
    vec![
        case(
            "no capture at all",
            Blender,
            Fatal,
            "unknown-layout",
            &["looked for `transforms_train.json` (Blender), `sparse/0/cameras.bin`", "none of them; give the folder"],
            |f| std::fs::remove_dir_all(f.at("images")).expect("images"),
        ),
        #[cfg(unix)]
        case(
            "a model behind a link that leads nowhere",
            ColmapBinary,
            Fatal,
            "unreadable-file",
            &["cannot reach `", "the link `", "/sparse` leads to `/gone/sparse`, which is not there; mend the link"],
            |f| std::os::unix::fs::symlink("/gone/sparse", f.at("sparse")).expect("a link"),
        ),
        #[cfg(unix)]
        case(
            "a model in a folder that cannot be looked into",
            ColmapText,
            Fatal,
            "unreadable-file",
            &["cannot reach `", "/sparse`: ", "allow it: `chmod -R u+rX /"],
            // A permission would not stop the system's administrator, whom tests may be run by.
            |f| std::os::unix::fs::symlink("sparse", f.at("sparse")).expect("a link"),
        ),
        case(
            "photographs without poses",
            ColmapBinary,
            Fatal,
            "no-capture",
            &[
                "/images` holds 12 photographs but no poses; find them, and give the folder `/",
                "`:\n  pocketsplat poses /",
                "\n(`pocketsplat train --poses` does so before it trains)",
            ],
            |_| {},
        ),
        case(
            "photographs of a telephone without poses",
            ColmapBinary,
            Fatal,
            "no-capture",
            &[
                "holds 2 photographs but no poses; find them, and give the folder `/",
                "-capture`:\n  pocketsplat poses /",
            ],
            |f| {
                std::fs::remove_dir_all(f.at("images")).expect("images");
                f.write("IMG_0001.HEIC", "");
                f.write("IMG_0002.HEIC", "");
            },
        ),
        case(
            "raw photographs without poses",
            ColmapBinary,
            Fatal,
            "no-capture",
            &[
                "holds 7 photographs but no poses; convert those of a format that is not read:\n  magick mogrify -format jpg \
                 -quality 95 '",
                "/*.ARW'\nthen find them, and give the folder `/",
            ],
            |f| {
                std::fs::remove_dir_all(f.at("images")).expect("images");
                for name in ["1.ARW", "1.CR2", "1.CR3", "1.NEF", "1.ORF", "1.RAF", "1.RW2"] {
                    f.write(name, "");
                }
            },
        ),
        case(
            "a film",
            Nerfstudio,
            Fatal,
            "no-capture",
            &[
                "/walk.MOV` is a film, needed: photographs with poses; find them, and give the folder `/",
                "/walk`:\n  pocketsplat poses /",
                "/walk.MOV -o /",
            ],
            |f| {
                std::fs::remove_dir_all(f.at("images")).expect("images");
                f.write("walk.MOV", "");
            },
        ),
        case(
            "a packed capture",
            Nerfstudio,
            Fatal,
            "no-capture",
            &["/shoe.r3d` is a packed capture, needed: its files; unpack it", "unzip /", "/shoe.r3d -d /"],
            |f| {
                std::fs::remove_dir_all(f.at("images")).expect("images");
                f.write("shoe.r3d", "");
            },
        ),
        case(
            "a camera of Polycam cut",
            Nerfstudio,
            Fatal,
            "bad-export",
            &["p_04.json` is not a camera of Polycam: EOF", "it needs `fx`, `fy`,", "export the capture again"],
            |f| {
                write_polycam(f, "cameras", "images");
                cut(f, "keyframes/cameras/p_04.json", 40);
            },
        ),
        case(
            "metadata of Record3D without poses",
            Nerfstudio,
            Fatal,
            "bad-export",
            &["metadata` is not metadata of Record3D: missing field `poses`", "`poses` of 7 numbers each"],
            |f| {
                write_record3d(f, "metadata", "rgbd", 0);
                edit(f, "metadata", |text| text.replace("poses", "places"));
            },
        ),
        case(
            "intrinsics of NSVF that are words",
            Nerfstudio,
            Fatal,
            "bad-model",
            &["intrinsics.txt`: line 1: `focal` is no number"],
            |f| write_nsvf(f, "focal 20\n", |_| ""),
        ),
        case(
            "intrinsics of NSVF without a principal point",
            Nerfstudio,
            Fatal,
            "bad-model",
            &["intrinsics.txt`: line 1: no intrinsics, needed: a matrix of 4 by 4 numbers"],
            |f| write_nsvf(f, "20.0\n", |_| ""),
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
            &[
                "has no folder of images: there is neither `images` nor `images_…` nor `input`; put the photographs into `images`",
            ],
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
