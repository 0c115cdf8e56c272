//! Where an error lies: sections of a bundle, and numbers with limits of their own.

use core::fmt;

use super::ErrorClass;

/// A part of a bundle, as `FORMAT.md` names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SectionKind {
    /// Fixed-size fields and the section table.
    Header,
    /// Weights of the heads.
    Heads,
    /// Where anchors may lie, and the frequencies of their positions.
    Lattice,
    /// How often each offset is drawn.
    Masks,
    /// Quantisation and frequency tables.
    Tables,
    /// The context model.
    Context,
    /// What each tier was measured to look like and to cost.
    Manifest,
    /// The tiers, and one record a chunk.
    Directory,
    /// The chunks' coded anchors.
    Chunks,
    /// How many Gaussians a scene has that looks the same from everywhere.
    Gaussians,
    /// One that this decoder does not know and skips.
    Other(u8),
}

/// A value that has limits of its own; names what [`OutOfRange`](super::DecodeError::OutOfRange) and its kin speak of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "each variant is the name of a field of FORMAT.md or of `Camera`")]
#[non_exhaustive]
pub enum Field {
    HeaderLen,
    CameraConvention,
    FeatureDim,
    NOffsets,
    NAnchors,
    NChunks,
    MaxChunkAnchors,
    NTiers,
    NSections,
    SectionKind,
    Reserved,
    /// A byte between two sections or chunks.
    Padding,
    /// A channel of the background of a scene that has none.
    Background,
    ColourHidden,
    DetailHidden,
    /// Bits of the symbols of a group of channels.
    SymbolBits,
    TrainingSize,
    VoxelSize,
    Normalisation,
    PreviewCamera,
    /// How far the preview's matrix is from a [rotation](crate::Rotation), in 10 000ths.
    PreviewRotation,
    HeadWeight,
    HeadStep,
    NTables,
    NChannels,
    TableOffset,
    TableSymbols,
    TableScale,
    LatticeMin,
    LatticeBits,
    TrieFrequency,
    MaskFrequency,
    ManifestPsnr,
    /// The level that a tier declares, with the reserved bytes behind it.
    TierLevel,
    TierChunks,
    TierAnchors,
    TierEnd,
    TierGaussians,
    ChunkAnchors,
    ChunkLen,
    InkFrame,
    InkBox,
    ContextLevels,
    ContextHidden,
    ContextShift,
    ContextBias,
    ContextTaps,
    LevelShift,
    ContextStep,
    GridKind,
    GridResolution,
    GridRows,
    CameraPose,
    /// How far a camera's matrix is from a [rotation](crate::Rotation), in 10 000ths.
    CameraRotation,
    CameraFocal,
    CameraPrincipal,
    FrameWidth,
    FrameHeight,
    /// Tiers that a budget is to draw.
    Tiers,
    Strips,
    /// Places for the splats of a slab.
    SlabSplats,
    /// The alpha that a budget's quality cuts at.
    AlphaCut,
    ChannelBuffer,
    SiteBuffer,
    ModelBuffer,
    /// Bytes for a row of tiles.
    RowBuffer,
    /// Tiers that a cut is to leave.
    TiersToKeep,
}

impl Field {
    /// Fields of a camera or a budget are the caller's, all others the file's.
    pub(super) const fn class(self) -> ErrorClass {
        match self {
            Self::CameraPose
            | Self::CameraRotation
            | Self::CameraFocal
            | Self::CameraPrincipal
            | Self::FrameWidth
            | Self::FrameHeight
            | Self::Tiers
            | Self::Strips
            | Self::SlabSplats
            | Self::AlphaCut
            | Self::ChannelBuffer
            | Self::SiteBuffer
            | Self::ModelBuffer
            | Self::RowBuffer
            | Self::TiersToKeep => ErrorClass::Misuse,
            _ => ErrorClass::Malformed,
        }
    }
}

impl fmt::Display for SectionKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Header => "the header",
            Self::Heads => "section heads",
            Self::Lattice => "section lattice",
            Self::Masks => "section masks",
            Self::Tables => "section tables",
            Self::Context => "section context",
            Self::Manifest => "section manifest",
            Self::Directory => "section directory",
            Self::Chunks => "section chunks",
            Self::Gaussians => "section gaussians",
            Self::Other(code) => return write!(f, "section of unknown kind {code}"),
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
            Self::NTiers => "number of tiers",
            Self::NSections => "number of sections",
            Self::SectionKind => "kind of a section",
            Self::Reserved => "a reserved byte",
            Self::Padding => "a byte between sections or chunks",
            Self::Background => "the background of a scene without",
            Self::ColourHidden => "hidden width of the colour head",
            Self::DetailHidden => "hidden width of the detail head",
            Self::SymbolBits => "bits of a symbol",
            Self::TrainingSize => "training image size",
            Self::VoxelSize => "voxel size",
            Self::Normalisation => "normalisation",
            Self::PreviewCamera => "preview camera",
            Self::PreviewRotation => "distance of the preview camera's matrix from a rotation, in 10 000ths,",
            Self::HeadWeight => "weight of a head",
            Self::HeadStep => "origin or step of coded heads",
            Self::NTables => "number of tables",
            Self::NChannels => "number of channels",
            Self::TableOffset => "offset of a table",
            Self::TableSymbols => "symbols of a table",
            Self::TableScale => "origin or step of a table",
            Self::LatticeMin => "lowest lattice coordinate",
            Self::LatticeBits => "lattice bits an axis",
            Self::TrieFrequency => "cumulative frequency of positions",
            Self::MaskFrequency => "frequency of a drawn offset",
            Self::ManifestPsnr => "PSNR of a tier",
            Self::TierLevel => "level of a tier",
            Self::TierChunks => "chunks of a tier and those before it",
            Self::TierAnchors => "anchors of a tier and those before it",
            Self::TierEnd => "end of a tier in the chunks",
            Self::TierGaussians => "number of Gaussians",
            Self::ChunkAnchors => "anchors of a chunk",
            Self::ChunkLen => "odd bytes of a chunk's length",
            Self::InkFrame => "frame of the ink boxes",
            Self::InkBox => "ink box of a chunk",
            Self::ContextLevels => "grid levels of the context",
            Self::ContextHidden => "hidden units of the context",
            Self::ContextShift => "shift of a context layer",
            Self::ContextBias => "bias of a context layer",
            Self::ContextTaps => "taps of the context",
            Self::LevelShift => "cells of a level",
            Self::ContextStep => "base step of the context",
            Self::GridKind => "kind of a grid level",
            Self::GridResolution => "resolution of a grid level",
            Self::GridRows => "rows of a grid level (all nodes, or a power of two)",
            Self::CameraPose => "camera pose",
            Self::CameraRotation => "distance of the camera's matrix from a rotation, in 10 000ths,",
            Self::CameraFocal => "camera focal length",
            Self::CameraPrincipal => "camera principal point",
            Self::FrameWidth => "frame width",
            Self::FrameHeight => "frame height",
            Self::Tiers => "tiers to draw",
            Self::Strips => "number of strips",
            Self::SlabSplats => "number of splats of a slab",
            Self::AlphaCut => "alpha to cut at, in 255ths",
            Self::ChannelBuffer => "buffer for channels",
            Self::SiteBuffer => "buffer for anchors' sites",
            Self::ModelBuffer => "memory for the models of anchors",
            Self::RowBuffer => "buffer of bytes for a row of tiles",
            Self::TiersToKeep => "tiers to keep",
        })
    }
}

/// A kind of memory: a microcontroller may have little that is fast (SRAM, TCM) and much that is slow (PSRAM, SDRAM).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Region {
    /// What `Budget::ram_bytes` counts; all there is unless a budget says otherwise.
    Fast,
    /// What `Budget::slow_bytes` counts.
    Slow,
}

impl fmt::Display for Region {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fast => "scratch memory",
            Self::Slow => "slow scratch memory",
        })
    }
}
