//! The writer of bundles: quantise, order, count, code, lay out.
//!
//! Stages in the order data flows through them: `quantise` → `order` → `table` → `chunk` → `layout`; beside them
//! `size` says where the bytes of a bundle went and [`annotate`] what each of them means. The format is described in
//! `decoder-core/src/bundle/FORMAT.md`; what reads it is [`pocketsplat_core`], and nothing here decides a decoded
//! symbol or value by itself.

pub mod annotate;
mod chunk;
pub mod context;
mod error;
mod layout;
mod load;
mod order;
mod quantise;
mod size;
mod table;

#[cfg(test)]
mod tests;

pub use error::{ChannelName, WriteError};
pub use load::{LoadError, load};
pub use quantise::QuantisationSteps;
pub use size::SizeReport;

use crate::camera::Camera;
use crate::dataset::Normalisation;
use crate::scene::Scene;

/// Anchors of a chunk unless the caller says otherwise: neighbours enough for a tight box, few enough to skip.
pub const CHUNK_ANCHORS: u16 = 128;

/// What a bundle says about its capture besides the scene itself.
#[derive(Clone, Debug, PartialEq)]
pub struct BundleInfo {
    /// From the capture's world to the scene's frame.
    pub normalisation: Normalisation,
    /// What lies behind everything.
    pub background: [u8; 3],
    /// Width and height of the training images, pixels.
    pub training_px: [u32; 2],
    /// One of the training views, normalised frame, so that a device can draw something by itself.
    pub preview: Camera,
}

/// Writes a scene as a bundle, with chunks of [`CHUNK_ANCHORS`].
///
/// # Errors
/// [`WriteError`] naming the anchor and channel, weight, or count that has no place in the format.
pub fn write(scene: &Scene<f32>, info: &BundleInfo, steps: &QuantisationSteps) -> Result<Vec<u8>, WriteError> {
    write_chunked(scene, info, steps, CHUNK_ANCHORS)
}

/// Writes a scene as a bundle, with chunks of `chunk_anchors`.
///
/// # Errors
/// As [`write()`]; and [`WriteError::Count`] when a chunk may not be that large.
pub fn write_chunked(
    scene: &Scene<f32>,
    info: &BundleInfo,
    steps: &QuantisationSteps,
    chunk_anchors: u16,
) -> Result<Vec<u8>, WriteError> {
    let rows = order::in_morton_order(quantise::quantise(scene, steps)?);
    let tables = table::TableSet::build(&rows, scene.shape.n_offsets);
    let chunks = rows
        .chunks(usize::from(chunk_anchors).max(1))
        .map(|anchors| chunk::encode(anchors, &tables, scene.voxel_size as f32))
        .collect::<Result<Vec<_>, _>>()?;
    layout::assemble(scene, info, chunk_anchors, &tables, &chunks)
}
