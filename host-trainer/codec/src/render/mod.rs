//! Whole images from a scene, at leisure.
//!
//! [`decoder`] draws what a device draws. [`mod@reference`] is the oracle: f64, slow, plain, and sharing no line with the
//! renderers that it judges.

pub mod decoder;
pub mod reference;
