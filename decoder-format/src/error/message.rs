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
            Self::UnsupportedFeatures { unknown_bits } => {
                write!(f, "the bundle needs features {unknown_bits:#x} unknown to this decoder; use a newer one")
            }
            Self::NotBuilt { missing_bits } => {
                write!(
                    f,
                    "the bundle needs what this decoder was built without; build pocketsplat-core with the features"
                )?;
                let names = [(0b1_0000, "context"), (0b100_0000, "detail"), (0b1000_0000, "anisotropy")];
                for (_, name) in names.into_iter().filter(|(bits, _)| missing_bits & bits != 0) {
                    write!(f, " {name}")?;
                }
                Ok(())
            }
            Self::Truncated { section, needed, available } => {
                write!(f, "{section} needs {needed} bytes and has {available}; the file is cut, copy it again")
            }
            Self::WrongLength { section, expected, found } => {
                write!(f, "{section} is {found} bytes long, the header's counts call for {expected}")
            }
            Self::Misplaced { section, expected, found } => {
                write!(f, "{section} begins at offset {found} and must begin at {expected}; write the file anew")
            }
            Self::UnexpectedSection { found, expected } => {
                write!(f, "the section table has {found} where {expected} must follow")
            }
            Self::MissingSection { section } => write!(f, "the section table lacks {section}"),
            Self::SectionChecksum { section, stored, computed } => {
                write!(f, "{section} is damaged: CRC {computed:#010x}, stored {stored:#010x}; copy the file again")
            }
            Self::ChunkChecksum { chunk, stored, computed } => {
                write!(f, "chunk {chunk} is damaged: CRC {computed:#010x}, stored {stored:#010x}; copy the file again")
            }
            Self::OutOfRange { field, found, limit } => write!(f, "{field} is {found}, the limit is {limit}"),
            Self::BadFloat { field, index } => {
                write!(f, "{field}, float {index}: not finite, or outside its limits")
            }
            Self::BadBound { section, table, entry } => {
                write!(
                    f,
                    "{section}, table {table}, bound {entry}: bounds begin with 0, do not fall, and only the last is 4096"
                )
            }
            Self::NoSuchTable { channel, table, n_tables } => {
                write!(f, "channel {channel} refers to table {table} of {n_tables}")
            }
            Self::HeadStream { left_bytes: 0 } => {
                write!(f, "section heads: the coded weights do not end cleanly at the section's last byte")
            }
            Self::HeadStream { left_bytes } => {
                write!(f, "section heads: {left_bytes} bytes left after the last coded weight")
            }
            Self::ChunkStream { chunk, left_bytes: 0 } => {
                write!(f, "chunk {chunk}: its anchors do not end cleanly at its last byte")
            }
            Self::ChunkStream { chunk, left_bytes } => {
                write!(f, "chunk {chunk}: {left_bytes} bytes left after its last symbol")
            }
            Self::NoSuchChunk { chunk, n_chunks } => write!(f, "chunk {chunk} of {n_chunks}"),
            Self::PlanTooLarge { max_splats } => {
                write!(f, "{max_splats} splats need more memory than this machine addresses; plan for fewer")
            }
            Self::ScratchTooSmall { region, needed, available } => {
                write!(f, "{region} of {available} bytes, the plan needs {needed}")
            }
            Self::BudgetTooSmall { region, needed, available, n_tiers, n_strips } => write!(
                f,
                "a budget of {available} bytes of {region}, the smallest plan ({n_tiers} tiers, {n_strips} strips) needs {needed}: \
                 allow that many, or fewer splats, more strips, or streamed anchors where the budget rules them out"
            ),
            Self::NotBakeable => {
                write!(
                    f,
                    "Gaussians depend on the view, or the bundle or this decoder lacks baked; plan another residency"
                )
            }
            Self::PlanMismatch { needed, planned } => write!(
                f,
                "the plan ({planned} bytes) was made for another bundle; this one needs {needed}, plan with it"
            ),
            Self::TooMuchWork { needed_so_far, limit } => write!(
                f,
                "the frame took {needed_so_far} · 1024 model instructions and is not complete, the budget has {limit} · 1024: allow more \
                 work, or draw fewer tiers or a smaller frame"
            ),
            Self::BufferTooShort { field, needed, available } => {
                write!(f, "{field} holds {available} elements, {needed} are needed")
            }
            Self::Internal => write!(f, "a mistake in pocketsplat-core; please report it with the bundle"),
        }
    }
}
