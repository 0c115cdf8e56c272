//! How captures are laid out on disk.

use std::fmt;

use serde::Serialize;

/// A layout that can be read, told by the files present; the first that fits is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Layout {
    /// Synthetic-NeRF: `transforms_train.json` and its like beside RGBA images.
    Blender,
    /// A sparse model in `sparse/0` or `colmap/sparse/0`, binary or text, beside `images` or `input`.
    Colmap,
    /// nerfstudio and instant-ngp: one `transforms.json`.
    Nerfstudio,
    /// Polycam's raw export: `keyframes`.
    Polycam,
    /// Record3D's export: `metadata` beside `rgbd` or `rgb`.
    Record3d,
    /// NSVF: `intrinsics.txt`, `pose` and `rgb`.
    Nsvf,
}

impl Layout {
    /// What tells each layout, for messages.
    pub(super) const LOOKED_FOR: [&str; 6] = [
        "`transforms_train.json` (Blender)",
        "`sparse/0/cameras.bin` or `sparse/0/cameras.txt`, also in `colmap` (COLMAP)",
        "`transforms.json` (nerfstudio, instant-ngp)",
        "`keyframes/cameras` (Polycam)",
        "`metadata` beside `rgbd` (Record3D)",
        "`intrinsics.txt` beside `pose` (NSVF)",
    ];
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Blender => "Blender",
            Self::Colmap => "COLMAP",
            Self::Nerfstudio => "nerfstudio",
            Self::Polycam => "Polycam",
            Self::Record3d => "Record3D",
            Self::Nsvf => "NSVF",
        })
    }
}
