//! Where an error lies: sections of a bundle, and numbers with limits of their own.

use core::fmt;

use super::ErrorClass;

/// A part of a bundle, as `FORMAT.md` names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SectionKind {
    /// Fixed-size fields and the section table.
    Header,
    /// Weights of the three heads.
    Heads,
    /// Quantisation and frequency tables.
    Tables,
    /// One record per chunk.
    Directory,
    /// The chunks' coded anchors.
    Chunks,
    /// The context model.
    Context,
}

/// A value that has limits of its own; names what [`OutOfRange`](super::DecodeError::OutOfRange) and its kin speak of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "each variant is the name of a field of FORMAT.md or of `Camera`")]
pub enum Field {
    HeaderLen,
    CameraConvention,
    FeatureDim,
    NOffsets,
    NAnchors,
    NChunks,
    MaxChunkAnchors,
    NSections,
    SectionKind,
    Reserved,
    TrainingSize,
    VoxelSize,
    Normalisation,
    PreviewCamera,
    HeadWeight,
    NTables,
    NChannels,
    TableOffset,
    TableSymbols,
    TableScale,
    ChunkAnchors,
    InkBox,
    LatticeBase,
    LatticeBits,
    ContextLevels,
    ContextHidden,
    ContextShift,
    ContextBias,
    ContextStep,
    GridKind,
    GridResolution,
    GridRows,
    CameraPose,
    CameraFocal,
    CameraPrincipal,
    FrameWidth,
    FrameHeight,
    ChannelBuffer,
    LatticeBuffer,
}

impl Field {
    /// Fields of a camera or a budget are the caller's, all others the file's.
    pub(super) const fn class(self) -> ErrorClass {
        match self {
            Self::CameraPose
            | Self::CameraFocal
            | Self::CameraPrincipal
            | Self::FrameWidth
            | Self::FrameHeight
            | Self::ChannelBuffer
            | Self::LatticeBuffer => ErrorClass::Misuse,
            _ => ErrorClass::Malformed,
        }
    }
}

impl fmt::Display for SectionKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Header => "the header",
            Self::Heads => "section heads",
            Self::Tables => "section tables",
            Self::Directory => "section directory",
            Self::Chunks => "section chunks",
            Self::Context => "section context",
        })
    }
}

impl fmt::Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::HeaderLen => "header length",
            Self::CameraConvention => "camera convention",
            Self::FeatureDim => "feature width",
            Self::NOffsets => "offsets of an anchor",
            Self::NAnchors => "number of anchors",
            Self::NChunks => "number of chunks",
            Self::MaxChunkAnchors => "largest number of anchors in a chunk",
            Self::NSections => "number of sections",
            Self::SectionKind => "kind of a section",
            Self::Reserved => "a reserved byte",
            Self::TrainingSize => "training image size",
            Self::VoxelSize => "voxel size",
            Self::Normalisation => "normalisation",
            Self::PreviewCamera => "preview camera",
            Self::HeadWeight => "weight of a head",
            Self::NTables => "number of tables",
            Self::NChannels => "number of channels",
            Self::TableOffset => "offset of a table",
            Self::TableSymbols => "symbols of a table",
            Self::TableScale => "origin or step of a table",
            Self::ChunkAnchors => "anchors of a chunk",
            Self::InkBox => "ink box of a chunk",
            Self::LatticeBase => "lattice base of a chunk",
            Self::LatticeBits => "lattice bits of a chunk",
            Self::ContextLevels => "grid levels of the context",
            Self::ContextHidden => "hidden units of the context",
            Self::ContextShift => "shift of a context layer",
            Self::ContextBias => "bias of a context layer",
            Self::ContextStep => "base step of the context",
            Self::GridKind => "kind of a grid level",
            Self::GridResolution => "resolution of a grid level",
            Self::GridRows => "rows of a grid level (all nodes, or a power of two)",
            Self::CameraPose => "camera pose",
            Self::CameraFocal => "camera focal length",
            Self::CameraPrincipal => "camera principal point",
            Self::FrameWidth => "frame width",
            Self::FrameHeight => "frame height",
            Self::ChannelBuffer => "buffer for channels",
            Self::LatticeBuffer => "buffer for lattice coordinates",
        })
    }
}
