//! How captures are laid out on disk.

use std::fmt;

use serde::Serialize;

/// A layout that can be read, told by the files present; the first that fits is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Layout {
    /// Synthetic-NeRF: `transforms_train.json` and its like beside RGBA images.
    Blender,
    /// A sparse model in `sparse/0`, `colmap/sparse/0`, `distorted/sparse/0`, `dense/0/sparse`, or beside the images; binary or text.
    Colmap,
    /// nerfstudio and instant-ngp: one `transforms.json`.
    Nerfstudio,
    /// Polycam's raw export: `keyframes`.
    Polycam,
    /// Record3D's export: `metadata` beside `rgbd` or `rgb`.
    Record3d,
    /// NSVF: `intrinsics.txt`, `pose` and `rgb`.
    Nsvf,
    /// LLFF: `poses_bounds.npy` beside `images`.
    Llff,
    /// Agisoft Metashape: `cameras.xml` beside `images`.
    Metashape,
    /// RealityCapture: a table of cameras, `.csv`, beside `images`.
    RealityCapture,
    /// Bundler: `bundle.out` and `list.txt` beside the images.
    Bundler,
    /// OpenSfM and OpenDroneMap: `reconstruction.json` beside `images`.
    OpenSfm,
}

impl Layout {
    /// What tells each layout, for messages.
    pub(super) const LOOKED_FOR: [&str; 11] = [
        "`transforms_train.json` (Blender)",
        "`sparse/0/cameras.bin` or `sparse/0/cameras.txt`, also in `colmap`, `distorted`, `dense/0` or beside `images` (COLMAP)",
        "`transforms.json` (nerfstudio, instant-ngp)",
        "`keyframes/cameras` (Polycam)",
        "`metadata` beside `rgbd` (Record3D)",
        "`intrinsics.txt` beside `pose` (NSVF)",
        "`poses_bounds.npy` (LLFF)",
        "`cameras.xml` (Metashape)",
        "a `.csv` of cameras (RealityCapture)",
        "`bundle.out` beside `list.txt` (Bundler)",
        "`reconstruction.json` (OpenSfM)",
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
            Self::Llff => "LLFF",
            Self::Metashape => "Metashape",
            Self::RealityCapture => "RealityCapture",
            Self::Bundler => "Bundler",
            Self::OpenSfm => "OpenSfM",
        })
    }
}
