//! The error of the decoder: what is wrong, where, and what would be right; and that of a frame, which is it or the sink's.

mod check;
mod message;
mod place;

pub use check::{in_range, saturate};
pub use place::{Field, Region, SectionKind};

/// Whose fault an error is, which decides what can be done about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ErrorClass {
    /// The bytes are not a sound bundle: fetch or flash them again.
    Malformed,
    /// A sound bundle that needs a newer or a fuller decoder.
    Unsupported,
    /// The memory or the work planned is not enough for the bundle.
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
    /// The bundle requires features that this decoder does not know.
    UnsupportedFeatures {
        /// The feature bits without a meaning here.
        unknown_bits: u32,
    },
    /// The bundle needs what this decoder was built without.
    NotBuilt {
        /// The feature bits of it.
        missing_bits: u32,
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
    /// A section does not begin where the one before it ends.
    Misplaced {
        /// Where.
        section: SectionKind,
        /// Offset that closes the gap.
        expected: u32,
        /// Offset stored.
        found: u32,
    },
    /// The section table has another section than the features call for at this place.
    UnexpectedSection {
        /// The section there.
        found: SectionKind,
        /// The section that must come next.
        expected: SectionKind,
    },
    /// The section table ends before all sections came.
    MissingSection {
        /// The first that is missing.
        section: SectionKind,
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
    /// A float is infinite, not a number, or outside the limits that `FORMAT.md` gives it.
    BadFloat {
        /// Which.
        field: Field,
        /// Its index among the field's floats.
        index: u32,
    },
    /// The bounds of a table do not begin with 0, fall somewhere, or do not end with 4096.
    BadBound {
        /// Where.
        section: SectionKind,
        /// Which table, from 0.
        table: u16,
        /// Index of the first bound that is wrong.
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
    /// The coded weights of the heads do not end where their section ends.
    HeadStream {
        /// Bytes left over after the last weight; 0 when the weights ran past the end.
        left_bytes: u32,
    },
    /// The coded anchors of a chunk do not end where its bytes end, or are not as many as its record says.
    ChunkStream {
        /// Which, from 0.
        chunk: u32,
        /// Bytes left over after the last symbol; 0 when there are none but the symbols are not those of the anchors.
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
        /// Which memory.
        region: Region,
        /// Bytes needed.
        needed: u32,
        /// Bytes given.
        available: u32,
    },
    /// No plan fits the budget's bytes; with those of the smallest one it would.
    BudgetTooSmall {
        /// Which memory: the slow one, if the budget has some.
        region: Region,
        /// Bytes of the smallest plan within the budget's other limits.
        needed: u32,
        /// Bytes in the budget.
        available: u32,
        /// Tiers of the smallest plan.
        n_tiers: u8,
        /// Its strips.
        n_strips: u8,
    },
    /// A budget asks for Gaussians evaluated when bound, and the scene's depend on the view, or the bundle does not say how many
    /// they are.
    NotBakeable,
    /// The plan was made for another bundle.
    PlanMismatch {
        /// Bytes this bundle would need.
        needed: u32,
        /// Bytes in the plan.
        planned: u32,
    },
    /// A frame took more than its budget of work.
    TooMuchWork {
        /// What it took when it ended, 1,024 model instructions.
        needed_so_far: u32,
        /// The budget's, 1,024 model instructions.
        limit: u32,
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
    /// use pocketsplat_format::{Bundle, ErrorClass};
    ///
    /// assert_eq!(Bundle::parse(b"not a bundle").unwrap_err().class(), ErrorClass::Malformed);
    /// ```
    pub const fn class(&self) -> ErrorClass {
        match self {
            Self::UnsupportedVersion { .. } | Self::UnsupportedFeatures { .. } | Self::NotBuilt { .. } => {
                ErrorClass::Unsupported
            }
            Self::PlanTooLarge { .. }
            | Self::ScratchTooSmall { .. }
            | Self::BudgetTooSmall { .. }
            | Self::TooMuchWork { .. } => ErrorClass::OverBudget,
            Self::NoSuchChunk { .. } | Self::PlanMismatch { .. } | Self::NotBakeable | Self::BufferTooShort { .. } => {
                ErrorClass::Misuse
            }
            Self::OutOfRange { field, .. } | Self::BadFloat { field, .. } => field.class(),
            Self::Internal => ErrorClass::Internal,
            Self::NotABundle
            | Self::Truncated { .. }
            | Self::WrongLength { .. }
            | Self::Misplaced { .. }
            | Self::UnexpectedSection { .. }
            | Self::MissingSection { .. }
            | Self::SectionChecksum { .. }
            | Self::ChunkChecksum { .. }
            | Self::BadBound { .. }
            | Self::NoSuchTable { .. }
            | Self::HeadStream { .. }
            | Self::ChunkStream { .. } => ErrorClass::Malformed,
        }
    }
}

impl core::error::Error for DecodeError {}
