//! Why there is no figure.

use std::path::PathBuf;

use safetensors::{Dtype, SafeTensorError};

/// What keeps LPIPS from being computed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LpipsError {
    /// The system refuses.
    #[error("could not read the LPIPS weights {}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// Another kind of file, or a damaged one.
    #[error("{} is not a sound safetensors file", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: SafeTensorError,
    },
    /// A tensor that LPIPS-VGG has and the file has not.
    #[error(
        "{} has no tensor `{name}` {needed:?}; LPIPS-VGG needs torchvision's VGG16 \
         (features.0.weight, features.0.bias, … features.28.bias) and the heads lin0.weight … lin4.weight",
        path.display()
    )]
    Missing {
        /// The file.
        path: PathBuf,
        /// The tensor.
        name: String,
        /// Its shape.
        needed: Vec<usize>,
    },
    /// Another network, or another layout.
    #[error("{}: the tensor `{name}` is {found:?}, needs {needed:?} as PyTorch lays out VGG16", path.display())]
    Shape {
        /// The file.
        path: PathBuf,
        /// The tensor.
        name: String,
        /// Its shape in the file.
        found: Vec<usize>,
        /// Its shape in LPIPS-VGG.
        needed: Vec<usize>,
    },
    /// Numbers of another type.
    #[error("{}: the tensor `{name}` has numbers of type {found:?}, needs F16 or F32; convert it", path.display())]
    Type {
        /// The file.
        path: PathBuf,
        /// The tensor.
        name: String,
        /// Their type.
        found: Dtype,
    },
    /// A value that no trained network has.
    #[error("{}: value {index} of the tensor `{name}` is {found}, needs {needed}; the file is damaged", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// The tensor.
        name: String,
        /// Where in it.
        index: usize,
        /// The value.
        found: f32,
        /// What it has to be.
        needed: &'static str,
    },
    /// Nothing is left of the image after four poolings.
    #[error("LPIPS needs images of 16×16 px or more, these are {width_px}×{height_px}")]
    TooSmall {
        /// Their width, pixels.
        width_px: u32,
        /// Their height, pixels.
        height_px: u32,
    },
}
