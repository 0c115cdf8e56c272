//! The one error of the decoder: what is wrong, where, and what would be right.

use core::fmt;

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
}

/// A value that has limits of its own; names what [`DecodeError::OutOfRange`] and its kin speak of.
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
    CameraPose,
    CameraFocal,
    CameraPrincipal,
    FrameWidth,
    FrameHeight,
    ChannelBuffer,
    LatticeBuffer,
}

/// Whose fault an error is, which decides what can be done about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ErrorClass {
    /// The bytes are not a sound bundle: fetch or flash them again.
    Malformed,
    /// A sound bundle that needs a newer or a fuller decoder.
    Unsupported,
    /// The bundle is fine and the memory planned is not enough.
    OverBudget,
    /// The call was wrong: an argument lies outside its limits.
    Misuse,
    /// A mistake in this crate; please report it.
    Internal,
}

/// Everything that can go wrong between bytes and pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum DecodeError {
    /// The first eight bytes are not a bundle's.
    NotABundle,
    /// The bundle has a version that this decoder does not read.
    UnsupportedVersion {
        /// Version in the file.
        found: u16,
        /// The version this decoder reads.
        supported: u16,
    },
    /// The scene uses effects that this decoder does not know.
    UnsupportedEffects {
        /// The effect bits without a meaning here.
        unknown_bits: u32,
    },
    /// A section ends before its content does.
    Truncated {
        /// Where.
        section: SectionKind,
        /// Bytes needed from the section's start (from the file's start for the header).
        needed: u32,
        /// Bytes there.
        available: u32,
    },
    /// A section's length does not follow from the header's counts.
    WrongLength {
        /// Where.
        section: SectionKind,
        /// Bytes that the header's counts call for.
        expected: u32,
        /// Bytes in the section table.
        found: u32,
    },
    /// A section, or a chunk in its section, does not begin where the one before it ends.
    Misplaced {
        /// Where.
        section: SectionKind,
        /// Offset that closes the gap.
        expected: u32,
        /// Offset stored.
        found: u32,
    },
    /// The bytes of a section changed since they were written.
    SectionChecksum {
        /// Which.
        section: SectionKind,
        /// CRC-32 in the file.
        stored: u32,
        /// CRC-32 of the bytes.
        computed: u32,
    },
    /// The bytes of a chunk changed since they were written.
    ChunkChecksum {
        /// Which, from 0.
        chunk: u32,
        /// CRC-32 in the directory.
        stored: u32,
        /// CRC-32 of the bytes.
        computed: u32,
    },
    /// A number lies outside its limits.
    OutOfRange {
        /// Which number.
        field: Field,
        /// Its value.
        found: u32,
        /// The limit that it violates.
        limit: u32,
    },
    /// A float is infinite, not a number, or of the wrong sign.
    BadFloat {
        /// Which.
        field: Field,
        /// Its index among the field's floats.
        index: u32,
    },
    /// The cumulative frequencies of a table fall somewhere.
    NotIncreasing {
        /// Which table, from 0.
        table: u32,
        /// Index of the entry that is smaller than the one before, or beyond the limit.
        entry: u32,
    },
    /// A channel refers to a table that is not there.
    NoSuchTable {
        /// Which channel, from 0.
        channel: u32,
        /// The table it names.
        table: u32,
        /// Tables there are.
        n_tables: u32,
    },
    /// A chunk is shorter than its fixed fields and lattice offsets.
    ChunkTooShort {
        /// Which, from 0.
        chunk: u32,
        /// Bytes needed.
        needed: u32,
        /// Bytes there.
        available: u32,
    },
    /// The coded symbols of a chunk do not end where its bytes end.
    ChunkStream {
        /// Which, from 0.
        chunk: u32,
        /// Bytes left over after the last symbol; 0 when the symbols ran past the end.
        left_bytes: u32,
    },
    /// There is no such chunk.
    NoSuchChunk {
        /// The one asked for.
        chunk: u32,
        /// Chunks there are.
        n_chunks: u32,
    },
    /// The plan needs more bytes than this machine can address.
    PlanTooLarge {
        /// Splats asked for.
        max_splats: u32,
    },
    /// The caller's scratch memory is shorter than the plan says.
    ScratchTooSmall {
        /// Bytes needed.
        needed: u32,
        /// Bytes given.
        available: u32,
    },
    /// A frame holds more splats than were planned for.
    TooManySplats {
        /// Splats of this frame.
        needed: u32,
        /// Splats planned.
        planned: u32,
    },
    /// The plan was made for another bundle.
    PlanMismatch {
        /// Bytes this bundle would need.
        needed: u32,
        /// Bytes in the plan.
        planned: u32,
    },
    /// A buffer passed to a decoding function is too short.
    BufferTooShort {
        /// Which.
        field: Field,
        /// Elements needed.
        needed: u32,
        /// Elements given.
        available: u32,
    },
    /// A state that parsing rules out.
    Internal,
}

// An error travels through every `Result` of the hot paths; four words fit a Cortex-M's registers.
const _: () = assert!(size_of::<DecodeError>() <= 16, "DecodeError grew beyond four words");

impl DecodeError {
    /// Whose fault it is.
    ///
    /// ```
    /// use pocketsplat_core::{Bundle, ErrorClass};
    ///
    /// assert_eq!(Bundle::parse(b"not a bundle").unwrap_err().class(), ErrorClass::Malformed);
    /// ```
    pub const fn class(&self) -> ErrorClass {
        match self {
            Self::UnsupportedVersion { .. } | Self::UnsupportedEffects { .. } => ErrorClass::Unsupported,
            Self::PlanTooLarge { .. } | Self::ScratchTooSmall { .. } | Self::TooManySplats { .. } => {
                ErrorClass::OverBudget
            }
            Self::NoSuchChunk { .. } | Self::PlanMismatch { .. } | Self::BufferTooShort { .. } => ErrorClass::Misuse,
            Self::OutOfRange { field, .. } | Self::BadFloat { field, .. } => field.class(),
            Self::Internal => ErrorClass::Internal,
            Self::NotABundle
            | Self::Truncated { .. }
            | Self::WrongLength { .. }
            | Self::Misplaced { .. }
            | Self::SectionChecksum { .. }
            | Self::ChunkChecksum { .. }
            | Self::NotIncreasing { .. }
            | Self::NoSuchTable { .. }
            | Self::ChunkTooShort { .. }
            | Self::ChunkStream { .. } => ErrorClass::Malformed,
        }
    }
}

impl Field {
    /// Fields of a camera or a budget are the caller's, all others the file's.
    const fn class(self) -> ErrorClass {
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

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotABundle => write!(f, "not a bundle: the first 8 bytes differ; pass the bytes of a .psb file"),
            Self::UnsupportedVersion { found, supported } => {
                write!(f, "bundle version {found}, this decoder reads {supported}; use matching releases")
            }
            Self::UnsupportedEffects { unknown_bits } => {
                write!(f, "the scene needs effects {unknown_bits:#x} unknown to this decoder; use a newer one")
            }
            Self::Truncated { section, needed, available } => {
                write!(f, "{section} needs {needed} bytes and has {available}; the file is cut, copy it again")
            }
            Self::WrongLength { section, expected, found } => {
                write!(f, "{section} is {found} bytes long, the header's counts call for {expected}")
            }
            Self::Misplaced { section, expected, found } => {
                write!(f, "{section} has a part at offset {found} that must begin at {expected}")
            }
            Self::SectionChecksum { section, stored, computed } => {
                write!(f, "{section} is damaged: CRC {computed:#010x}, stored {stored:#010x}; copy the file again")
            }
            Self::ChunkChecksum { chunk, stored, computed } => {
                write!(f, "chunk {chunk} is damaged: CRC {computed:#010x}, stored {stored:#010x}; copy the file again")
            }
            Self::OutOfRange { field, found, limit } => write!(f, "{field} is {found}, the limit is {limit}"),
            Self::BadFloat { field, index } => {
                write!(f, "{field}, float {index}: not finite, or not positive where it must be")
            }
            Self::NotIncreasing { table, entry } => {
                write!(f, "table {table}, entry {entry}: cumulative frequencies must not fall and end below 4096")
            }
            Self::NoSuchTable { channel, table, n_tables } => {
                write!(f, "channel {channel} refers to table {table} of {n_tables}")
            }
            Self::ChunkTooShort { chunk, needed, available } => {
                write!(f, "chunk {chunk} has {available} bytes, its anchors need at least {needed}")
            }
            Self::ChunkStream { chunk, left_bytes: 0 } => {
                write!(f, "chunk {chunk}: the symbols do not end cleanly at the chunk's last byte")
            }
            Self::ChunkStream { chunk, left_bytes } => {
                write!(f, "chunk {chunk}: {left_bytes} bytes left after its last symbol")
            }
            Self::NoSuchChunk { chunk, n_chunks } => write!(f, "chunk {chunk} of {n_chunks}"),
            Self::PlanTooLarge { max_splats } => {
                write!(f, "{max_splats} splats need more memory than this machine addresses; plan for fewer")
            }
            Self::ScratchTooSmall { needed, available } => {
                write!(f, "scratch memory of {available} bytes, the plan needs {needed}")
            }
            Self::TooManySplats { needed, planned } => {
                write!(f, "the frame has {needed} splats, the plan {planned}; plan for at least {needed}")
            }
            Self::PlanMismatch { needed, planned } => write!(
                f,
                "the plan ({planned} bytes) was made for another bundle; this one needs {needed}, plan with it"
            ),
            Self::BufferTooShort { field, needed, available } => {
                write!(f, "{field} holds {available} elements, {needed} are needed")
            }
            Self::Internal => write!(f, "a mistake in pocketsplat-core; please report it with the bundle"),
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

impl core::error::Error for DecodeError {}
