//! From the normalised frame to the image plane: which chunks and anchors a view can see, and the splats of Gaussians.
//!
//! Elliptical weighted average splatting (Zwicker et al. 2001), with the constants of the trainer.

mod band;
mod covariance;
mod cull;
mod dilation;
mod packed;
mod splat;
mod tile;
mod view;

pub(crate) use band::Band;
pub use cull::chunks_in_view;
pub(crate) use packed::PackedSplat;
pub(crate) use splat::Splat;
pub(crate) use tile::{TILE_PIXELS, TileRect};
pub(crate) use view::{View, log_cut};
