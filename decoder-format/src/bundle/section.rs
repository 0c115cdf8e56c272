//! A row of the section table: where a section lies, and its checksum.

use crate::bytes::{Emitter, Fields, crc32};
use crate::error::{DecodeError, Field, SectionKind, in_range, saturate};

/// Length of a row of the section table, bytes.
pub const SECTION_LEN: usize = 16;
/// Sections and chunks begin at multiples of this, bytes from the start of the file; the bytes between them are 0.
pub const ALIGNMENT: u32 = 4;
/// Sections of this kind and above may be skipped by a decoder that does not know them.
const FIRST_OPTIONAL_CODE: u8 = 128;
/// The number of the section protocol, which decoders skip.
pub const PROTOCOL_CODE: u8 = 129;

/// One row of the section table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Section {
    /// Which section.
    pub kind: SectionKind,
    /// Where it begins, bytes from the start of the file.
    pub offset: u32,
    /// Its length, bytes.
    pub len: u32,
    /// Its checksum; 0 for the chunks, which have their own.
    pub crc: u32,
}

impl Section {
    pub(super) fn parse(row: &[u8; SECTION_LEN]) -> Result<Self, DecodeError> {
        let mut fields = Fields::new(row);
        let [code, a, b, c] = fields.bytes();
        in_range(Field::Reserved, (a | b | c).into(), 0, 0)?;
        let [offset, len, crc] = fields.u32s();
        Ok(Self { kind: kind_of(code)?, offset, len, crc })
    }

    /// The row's bytes: the reverse of `parse`.
    #[must_use]
    pub fn emit(&self) -> [u8; SECTION_LEN] {
        let mut out = Emitter::new();
        out.bytes([self.code(), 0, 0, 0]);
        out.u32s([self.offset, self.len, self.crc]);
        out.finish()
    }

    /// The number that the file has for its kind.
    #[must_use]
    pub const fn code(&self) -> u8 {
        match self.kind {
            // No section has it: the header is no row of its own table.
            SectionKind::Header => 0,
            SectionKind::Heads => 1,
            SectionKind::Lattice => 2,
            SectionKind::Masks => 3,
            SectionKind::Tables => 4,
            SectionKind::Context => 5,
            SectionKind::Manifest => 6,
            SectionKind::Directory => 7,
            SectionKind::Chunks => 8,
            SectionKind::Gaussians => 128,
            SectionKind::Other(code) => code,
        }
    }

    /// The bytes of the section, their checksum compared, and those up to the next section with 0.
    // Not inlined: it has seven callers.
    #[inline(never)]
    pub(super) fn bytes<'a>(&self, file: &'a [u8]) -> Result<&'a [u8], DecodeError> {
        let end = self.offset.saturating_add(self.len);
        let available = saturate(file.len()).saturating_sub(self.offset);
        let truncated = DecodeError::Truncated { section: self.kind, needed: self.len, available };
        let bytes = file.get(self.offset as usize..end as usize).ok_or(truncated)?;
        let computed = crc32(bytes);
        if computed != self.crc {
            return Err(DecodeError::SectionChecksum { section: self.kind, stored: self.crc, computed });
        }
        check_padding(file, end)?;
        Ok(bytes)
    }
}

/// Where what follows `end` begins, bytes.
pub(super) const fn padded(end: u32) -> u32 {
    end.saturating_add(ALIGNMENT.wrapping_sub(1)) & !ALIGNMENT.wrapping_sub(1)
}

/// The bytes from `end` up to what follows are 0; where `bytes` end before them, what follows is missing too.
// Not inlined: sections and chunks call it.
#[inline(never)]
pub(super) fn check_padding(bytes: &[u8], end: u32) -> Result<(), DecodeError> {
    let padding = bytes.get(end as usize..padded(end) as usize).unwrap_or_default();
    in_range(Field::Padding, padding.iter().fold(0, |any, byte| any | byte).into(), 0, 0)
}

/// The kind of a number: the reverse of [`Section::code`].
fn kind_of(code: u8) -> Result<SectionKind, DecodeError> {
    Ok(match code {
        1 => SectionKind::Heads,
        2 => SectionKind::Lattice,
        3 => SectionKind::Masks,
        4 => SectionKind::Tables,
        5 => SectionKind::Context,
        6 => SectionKind::Manifest,
        7 => SectionKind::Directory,
        8 => SectionKind::Chunks,
        128 => SectionKind::Gaussians,
        _ if code >= FIRST_OPTIONAL_CODE => SectionKind::Other(code),
        _ => {
            let limit = FIRST_OPTIONAL_CODE.into();
            return Err(DecodeError::OutOfRange { field: Field::SectionKind, found: code.into(), limit });
        }
    })
}
