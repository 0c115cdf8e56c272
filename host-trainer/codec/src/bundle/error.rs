//! Why a scene cannot be written.

use super::channels::ChannelName;
use pocketsplat_kernels::integer_model::IntegerModelError;

/// Why a scene cannot be written as a bundle.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum WriteError {
    /// A trained value is infinite or not a number: training diverged.
    #[error("anchor {anchor}, {channel}: {value} is not finite; training diverged before this was written")]
    NotFinite { anchor: usize, channel: ChannelName, value: f32 },
    /// A value is more than 32767 steps from zero.
    #[error("anchor {anchor}, {channel}: {value} is beyond ±32767 steps of {step}; use a larger step")]
    BeyondSymbols { anchor: usize, channel: ChannelName, value: f32, step: f32 },
    /// A lattice coordinate is too large for f32 to hold its position.
    #[error("anchor {anchor}: lattice coordinate {found} is beyond ±{limit}; use a larger voxel size")]
    BeyondLattice { anchor: usize, found: i32, limit: i32 },
    /// The lattice cells of the scene are too far apart for a Morton code.
    #[error("the scene is {found} lattice cells wide, the format holds {limit}; use a larger voxel size")]
    LatticeTooWide { found: u32, limit: u32 },
    /// Two anchors share a lattice cell, which a trie of cells cannot tell apart.
    #[error("anchors {} and {} share the lattice cell {cell:?}; keep one of them", anchors[0], anchors[1])]
    SharedCell { anchors: [usize; 2], cell: [i32; 3] },
    /// The tiers' pruning rates do not describe nested scenes.
    #[error("tiers of pruning rates {found:?}; 1 to {most} rates below 1 must fall to 0")]
    Tiers { found: Vec<f32>, most: usize },
    /// The context coder is asked for and the scene has no context model.
    #[error(
        "the context coder needs a scene with a context model; train one with the backbone hac or use --coder static"
    )]
    NoContext,
    /// A weight is not finite, or too large for half precision.
    #[error("{head} head, weight {index}: {value} does not fit half precision (±65504)")]
    Weight { head: &'static str, index: usize, value: f32 },
    /// The context model has no integer form.
    #[error(transparent)]
    IntegerModel(#[from] IntegerModelError),
    /// An array of the scene has another length than its shape says.
    #[error("{array} has {found} values, the scene's shape calls for {needed}")]
    Length { array: &'static str, needed: usize, found: usize },
    /// A count or a size lies outside the format's limits.
    #[error("{what} is {found}; the format holds {least} to {most}")]
    Count { what: &'static str, found: usize, least: usize, most: usize },
    /// A step, voxel size or normalisation is not a positive number, or the preview camera is unusable.
    #[error("{what} is {value}, it must be finite and positive")]
    NotPositive { what: &'static str, value: f64 },
    /// The preview camera cannot be drawn with.
    #[error("preview camera: {0}")]
    Preview(#[source] pocketsplat_core::DecodeError),
    /// The decoder refuses the bundle just written: a mistake in the writer.
    #[error("the bundle just written does not read back; please report it")]
    ReadBack(#[source] pocketsplat_core::DecodeError),
}
