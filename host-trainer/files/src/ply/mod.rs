//! .ply files: elements, their properties and their rows, ASCII or binary.
//!
//! What the vertices mean is the caller's: points of a capture, or Gaussians.

mod header;
mod line_endings;
mod rows;

use std::borrow::Cow;

pub use header::{Element, Encoding, Header, Property, Scalar, split};
pub use line_endings::check as check_line_endings;
pub use rows::{cut_off, vertices};

/// What is wrong with a file, as the rest of a sentence about it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Fault(pub Cow<'static, str>);

impl Fault {
    /// With what was found.
    pub fn new(found: impl Into<Cow<'static, str>>) -> Self {
        Self(found.into())
    }
}
