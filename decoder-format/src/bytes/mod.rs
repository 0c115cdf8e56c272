//! Bytes to numbers, numbers to bytes, and their checksum.
//!
//! The module knows nothing of what the numbers mean.
// Tests may index and add as they like; this is about bytes that nobody vouches for.
#![cfg_attr(not(test), deny(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::panic))]

mod crc;
mod cursor;
mod emitter;
mod fields;

pub use crc::crc32;
pub(crate) use crc::crc32_of;
pub(crate) use cursor::Cursor;
pub(crate) use emitter::Emitter;
pub(crate) use fields::Fields;
