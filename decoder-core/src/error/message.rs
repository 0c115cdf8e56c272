//! What the errors say: the place, the number found, the number needed, and what to do.

use core::fmt;

use super::DecodeError;

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
