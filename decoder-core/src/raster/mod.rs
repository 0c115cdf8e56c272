//! From splats to pixels: order by depth, gather a row of tiles, blend tile after tile.
//!
//! All memory is the caller's; the module knows nothing of cameras and anchors.

mod blend;
mod blending;
mod depth;
mod float_blending;
mod integer_blending;

pub(crate) use blend::{Splats, blend_tile, finish_tile};
pub(crate) use blending::{Blending, Pixel, TileRegion};
pub(crate) use depth::{DIGITS, N_RADIX, order_by_digit, order_list_by_digit};
pub(crate) use float_blending::FloatBlending;
pub(crate) use integer_blending::IntegerBlending;
