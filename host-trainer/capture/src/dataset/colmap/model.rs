//! What a sparse model holds, however it is written.

use crate::dataset::lens::{Lens, Projection};

/// How a model's files are written.
#[derive(Clone, Copy)]
pub(super) enum ModelEncoding {
    Binary,
    Text,
}

impl ModelEncoding {
    pub(super) fn extension(self) -> &'static str {
        match self {
            Self::Binary => "bin",
            Self::Text => "txt",
        }
    }
}

/// A camera of the model: one lens for any number of images.
#[derive(Debug, PartialEq)]
pub(super) struct ModelCamera {
    /// COLMAP's name of the camera model.
    pub(super) model: String,
    /// `None` where the model is none that can be undistorted.
    pub(super) lens: Option<Lens>,
}

/// An image of the model: a name and a pose.
#[derive(Debug, PartialEq)]
pub(super) struct ModelImage {
    /// Relative to the folder of images.
    pub(super) name: String,
    /// World to camera.
    pub(super) quaternion_wxyz: [f64; 4],
    /// World to camera, capture units.
    pub(super) translation: [f64; 3],
    pub(super) camera_id: u32,
}

/// Why a file of the model cannot be read.
#[derive(Debug, PartialEq)]
pub(super) struct ModelFault {
    /// Line, or record and byte.
    pub(super) place: String,
    /// What is wrong there, with what was found and what is needed.
    pub(super) found: String,
}

/// COLMAP's camera models: number in binary files, name in text files, count of parameters.
///
/// From COLMAP's documentation, "Camera Models"; the counts are needed to step over models that are refused.
pub(super) const CAMERA_MODELS: [(u32, &str, usize); 18] = [
    (0, "SIMPLE_PINHOLE", 3),
    (1, "PINHOLE", 4),
    (2, "SIMPLE_RADIAL", 4),
    (3, "RADIAL", 5),
    (4, "OPENCV", 8),
    (5, "OPENCV_FISHEYE", 8),
    (6, "FULL_OPENCV", 12),
    (7, "FOV", 5),
    (8, "SIMPLE_RADIAL_FISHEYE", 4),
    (9, "RADIAL_FISHEYE", 5),
    (10, "THIN_PRISM_FISHEYE", 12),
    (11, "RAD_TAN_THIN_PRISM_FISHEYE", 16),
    (12, "SIMPLE_DIVISION", 4),
    (13, "DIVISION", 5),
    (14, "SIMPLE_FISHEYE", 3),
    (15, "FISHEYE", 4),
    (16, "EUCM", 6),
    (17, "EQUIRECTANGULAR", 2),
];

impl ModelCamera {
    /// The camera of a model by its name and parameters, or `None` where a known model has another count of them.
    pub(super) fn new(model: &str, size_px: (u32, u32), parameters: &[f64]) -> Option<Self> {
        let known = CAMERA_MODELS.iter().find(|(_, name, _)| *name == model);
        if known.is_some_and(|&(_, _, count)| count != parameters.len()) {
            return None;
        }
        let pinhole = |focal_px, principal_px| Lens { principal_px, ..Lens::central(size_px, focal_px) };
        let lens = |focal_px, principal_px, radial, tangential| {
            Some(Lens { radial, tangential, ..pinhole(focal_px, principal_px) })
        };
        let fisheye = |focal_px, principal_px, radial| {
            Some(Lens { projection: Projection::Fisheye, radial, ..pinhole(focal_px, principal_px) })
        };
        let lens = match (model, parameters) {
            ("SIMPLE_PINHOLE", &[f, cx, cy]) => Some(pinhole([f; 2], [cx, cy])),
            ("PINHOLE", &[fx, fy, cx, cy]) => Some(pinhole([fx, fy], [cx, cy])),
            ("SIMPLE_RADIAL", &[f, cx, cy, k]) => lens([f; 2], [cx, cy], [k, 0.0, 0.0, 0.0], [0.0; 2]),
            ("RADIAL", &[f, cx, cy, k1, k2]) => lens([f; 2], [cx, cy], [k1, k2, 0.0, 0.0], [0.0; 2]),
            ("OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2]) => lens([fx, fy], [cx, cy], [k1, k2, 0.0, 0.0], [p1, p2]),
            ("FULL_OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2, k3, q1, q2, q3]) => {
                let (radial, divisor) = ([k1, k2, k3, 0.0], [q1, q2, q3]);
                Some(Lens { radial, divisor, tangential: [p1, p2], ..pinhole([fx, fy], [cx, cy]) })
            }
            ("OPENCV_FISHEYE", &[fx, fy, cx, cy, k1, k2, k3, k4]) => fisheye([fx, fy], [cx, cy], [k1, k2, k3, k4]),
            ("SIMPLE_RADIAL_FISHEYE", &[f, cx, cy, k]) => fisheye([f; 2], [cx, cy], [k, 0.0, 0.0, 0.0]),
            ("RADIAL_FISHEYE", &[f, cx, cy, k1, k2]) => fisheye([f; 2], [cx, cy], [k1, k2, 0.0, 0.0]),
            // Equidistant, without distortion.
            ("SIMPLE_FISHEYE", &[f, cx, cy]) => fisheye([f; 2], [cx, cy], [0.0; 4]),
            ("FISHEYE", &[fx, fy, cx, cy]) => fisheye([fx, fy], [cx, cy], [0.0; 4]),
            _ => None,
        };
        Some(Self { model: model.to_owned(), lens })
    }
}
