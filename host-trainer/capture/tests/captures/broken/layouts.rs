//! Captures of no layout, or of one that lacks a part.

use super::Harm::Fatal;
use super::{Case, case};
use crate::fixture::Kind::{Blender, ColmapBinary, ColmapText, Nerfstudio};

pub(super) fn cases() -> Vec<Case> {
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
