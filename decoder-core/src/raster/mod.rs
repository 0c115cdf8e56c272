//! From splats to pixels: order by depth, gather a row of tiles, blend tile after tile.
//!
//! All memory is the caller's; the module knows nothing of cameras and anchors.

mod blend;
mod depth;

pub(crate) use blend::{BlendRule, EMPTY, Pixel, TileRegion, blend_tile, finish_tile};
pub(crate) use depth::{DIGITS, N_RADIX, order_by_digit};
