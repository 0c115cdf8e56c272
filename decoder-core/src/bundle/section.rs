//! The section table: where each part lies, and its checksum.

use super::cursor::Cursor;
use super::header::{HEADER_LEN, in_range};
use crate::error::{DecodeError, Field, SectionKind};

/// One row of the section table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Section {
    kind: SectionKind,
    offset: u32,
    len: u32,
    crc: u32,
}

/// The sections in file order and the code of each.
const ORDER: [(SectionKind, u8); 4] =
    [(SectionKind::Heads, 1), (SectionKind::Tables, 2), (SectionKind::Directory, 3), (SectionKind::Chunks, 4)];

impl Section {
    /// Reads the table; the sections follow the header in order, without gaps, and end at `file_len`.
    pub(super) fn parse_table(cursor: &mut Cursor<'_>, file_len: u32) -> Result<[Self; 4], DecodeError> {
        let mut expected = HEADER_LEN as u32;
        let mut sections = [Self { kind: SectionKind::Header, offset: 0, len: 0, crc: 0 }; 4];
        for (section, (kind, code)) in sections.iter_mut().zip(ORDER) {
            let [found, reserved @ ..] = cursor.array::<4>()?;
            in_range(Field::SectionKind, found.into(), code.into(), code.into())?;
            in_range(Field::Reserved, u8::from(reserved != [0; 3]).into(), 0, 0)?;
            let [offset, len, crc] = [cursor.u32()?, cursor.u32()?, cursor.u32()?];
            if offset != expected {
                return Err(DecodeError::Misplaced { section: kind, expected, found: offset });
            }
            let Some(end) = offset.checked_add(len).filter(|&end| end <= file_len) else {
                let needed = offset.saturating_add(len);
                return Err(DecodeError::Truncated { section: kind, needed, available: file_len });
            };
            expected = end;
            *section = Self { kind, offset, len, crc };
        }
        if expected != file_len {
            return Err(DecodeError::WrongLength { section: SectionKind::Chunks, expected: file_len, found: expected });
        }
        Ok(sections)
    }

    /// The bytes of the section, their checksum compared; the chunks have theirs in the directory.
    pub(super) fn bytes<'a>(&self, file: &'a [u8]) -> Result<&'a [u8], DecodeError> {
        let needed = self.offset.saturating_add(self.len);
        let truncated =
            DecodeError::Truncated { section: self.kind, needed, available: super::cursor::saturate(file.len()) };
        let bytes = file.get(self.offset as usize..needed as usize).ok_or(truncated)?;
        let computed = if self.kind == SectionKind::Chunks { 0 } else { super::crc32(bytes) };
        if computed != self.crc {
            return Err(DecodeError::SectionChecksum { section: self.kind, stored: self.crc, computed });
        }
        Ok(bytes)
    }
}
