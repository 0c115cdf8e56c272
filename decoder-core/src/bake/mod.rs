//! Gaussians evaluated once, when bound: for scenes whose heads see neither direction nor distance of view.
//!
//! Such a Gaussian is the same in every frame, so nothing of an anchor is needed any more but what its heads made of it: a frame
//! then takes no decoding and no multiply-add of the heads. What it takes is 32 bytes a Gaussian. Where there is no room for
//! them and frames evaluate anchors, they round each Gaussian likewise, so that memory changes no pixel. It does where frames are drawn in
//! another arithmetic than the reference, in which Gaussians are baked.
#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::panic)]

mod pass;
mod record;
mod store;

pub(crate) use pass::bake;
pub(crate) use record::BakedGaussian;
pub(crate) use store::{BakedGaussians, BakedMemory, Baker};
