//! Why there is no figure.

use std::path::PathBuf;

use safetensors::{Dtype, SafeTensorError};

/// What keeps LPIPS from being computed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum LpipsError {
    /// The system refuses.
    #[error("could not read the LPIPS weights {}", path.display())]
    Read { path: PathBuf, source: std::io::Error },
    /// Another kind of file, or a damaged one.
    #[error("{} is not a sound safetensors file", path.display())]
    Malformed { path: PathBuf, source: SafeTensorError },
    /// A tensor that LPIPS-VGG has and the file has not.
    #[error(
        "{} has no tensor `{name}` {needed:?}; LPIPS-VGG needs torchvision's VGG16 \
         (features.0.weight, features.0.bias, … features.28.bias) and the heads lin0.weight … lin4.weight",
        path.display()
    )]
    Missing { path: PathBuf, name: String, needed: Vec<usize> },
    /// Another network, or another layout.
    #[error("{}: the tensor `{name}` is {found:?}, needs {needed:?} as PyTorch lays out VGG16", path.display())]
    Shape { path: PathBuf, name: String, found: Vec<usize>, needed: Vec<usize> },
    /// Numbers of another type.
    #[error("{}: the tensor `{name}` has numbers of type {found:?}, needs F16 or F32; convert it", path.display())]
    Type { path: PathBuf, name: String, found: Dtype },
    /// A value that no trained network has.
    #[error("{}: value {index} of the tensor `{name}` is {found}, needs {needed}; the file is damaged", path.display())]
    Value { path: PathBuf, name: String, index: usize, found: f32, needed: &'static str },
    /// Nothing is left of the image after four poolings.
    #[error("LPIPS needs images of 16×16 px or more, these are {width_px}×{height_px}")]
    TooSmall { width_px: u32, height_px: u32 },
}
