//! From the normalised frame to the image plane: which chunks and anchors a view can see, and the splats of Gaussians.
//!
//! Elliptical weighted average splatting (Zwicker et al. 2001), with the constants of the trainer.

mod band;
mod covariance;
mod cull;
mod packed;
mod splat;
mod view;

pub(crate) use band::Band;
pub use cull::chunks_in_view;
pub(crate) use packed::SplatRecord;
pub use packed::{Packed28, Wide};
pub(crate) use splat::{Splat, log_cut};
pub(crate) use view::View;
