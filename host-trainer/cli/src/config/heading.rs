//! Headings of the options in help, in the order in which a run meets them.
//!
//! Each option names its own: a heading given to a group would also stand above whatever follows the group.

pub(crate) const INPUT: &str = "Input";
pub(crate) const OUTPUT: &str = "Output";
pub(crate) const QUALITY: &str = "Quality";
pub(crate) const DEVICE: &str = "Device";
pub(crate) const RUN: &str = "Run";
