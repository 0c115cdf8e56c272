//! The section table: where each part lies, and its checksum.

use super::features::Features;
use super::header::{Header, header_len};
use crate::bytes::{Cursor, Emitter, crc32};
use crate::error::{DecodeError, Field, SectionKind, in_range, saturate};

/// Length of a row of the section table, bytes.
pub const SECTION_LEN: usize = 16;
/// Sections of this kind and above may be skipped by a decoder that does not know them.
const FIRST_OPTIONAL_CODE: u8 = 128;

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

/// The bytes of the sections that a decoder reads.
#[derive(Clone, Copy, Debug)]
pub struct SectionBytes<'a> {
    /// The heads' weights.
    pub heads: &'a [u8],
    /// The lattice and the model of its cells.
    pub lattice: &'a [u8],
    /// The model of the masks, where some offset is not drawn.
    pub masks: Option<&'a [u8]>,
    /// Tables or context, as the header's features say.
    pub coder: &'a [u8],
    /// The measures of the tiers.
    pub manifest: &'a [u8],
    /// Tiers and chunk records.
    pub directory: &'a [u8],
    /// Counts of Gaussians, where they are the same from everywhere.
    pub gaussians: Option<&'a [u8]>,
    /// The chunks.
    pub chunks: &'a [u8],
}

impl<'a> SectionBytes<'a> {
    /// The bytes of a bundle of these sections: the reverse of [`Bundle::parse`](super::Bundle::parse).
    ///
    /// * `header`: its lengths are filled in.
    pub fn emit(&self, header: &Header) -> impl Iterator<Item = u8> + use<'a> {
        let sections = self.in_order(header.features);
        // At most nine.
        let header_len = header_len(sections.clone().count() as u8);
        let rows = sections.clone().scan(saturate(header_len), |next, (kind, bytes)| {
            let (offset, len) = (*next, saturate(bytes.len()));
            *next = offset.saturating_add(len);
            // Each chunk has its own checksum, so that a device need not read all of them to draw some.
            let crc = if kind == SectionKind::Chunks { 0 } else { crc32(bytes) };
            Some(Section { kind, offset, len, crc })
        });
        let header = Header { header_len: header_len as u16, file_len: saturate(self.file_len()), ..*header };
        header.emit(rows).chain(sections.flat_map(|(_, bytes)| bytes.iter().copied()))
    }

    /// How many bytes [`emit`](Self::emit) makes; a bundle has less than 4 GiB.
    #[must_use]
    pub fn file_len(&self) -> usize {
        let sections = self.in_order(Features::default());
        let header_len = header_len(sections.clone().count() as u8);
        sections.fold(header_len, |sum, (_, bytes)| sum.saturating_add(bytes.len()))
    }

    /// The sections as the file has them.
    fn in_order(&self, features: Features) -> impl Iterator<Item = (SectionKind, &'a [u8])> + Clone + use<'a> {
        let coder = if features.context { SectionKind::Context } else { SectionKind::Tables };
        [
            Some((SectionKind::Heads, self.heads)),
            Some((SectionKind::Lattice, self.lattice)),
            self.masks.map(|bytes| (SectionKind::Masks, bytes)),
            Some((coder, self.coder)),
            Some((SectionKind::Manifest, self.manifest)),
            Some((SectionKind::Directory, self.directory)),
            self.gaussians.map(|bytes| (SectionKind::Gaussians, bytes)),
            Some((SectionKind::Chunks, self.chunks)),
        ]
        .into_iter()
        .flatten()
    }
}

/// Where the sections that a decoder reads lie.
pub(super) struct Sections {
    pub(super) heads: Section,
    pub(super) lattice: Section,
    pub(super) masks: Option<Section>,
    /// Tables or context.
    pub(super) coder: Section,
    pub(super) manifest: Section,
    pub(super) directory: Section,
    pub(super) gaussians: Option<Section>,
    pub(super) chunks: Section,
}

impl Section {
    pub(super) fn parse(row: &[u8; SECTION_LEN]) -> Result<Self, DecodeError> {
        let mut cursor = Cursor::new(row, SectionKind::Header);
        let [code, reserved @ ..] = cursor.array::<4>()?;
        in_range(Field::Reserved, u8::from(reserved != [0; 3]).into(), 0, 0)?;
        let [offset, len, crc] = [cursor.u32()?, cursor.u32()?, cursor.u32()?];
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

    /// The bytes of the section, their checksum compared.
    pub(super) fn bytes<'a>(&self, file: &'a [u8]) -> Result<&'a [u8], DecodeError> {
        let end = self.offset.saturating_add(self.len);
        let available = saturate(file.len()).saturating_sub(self.offset);
        let truncated = DecodeError::Truncated { section: self.kind, needed: self.len, available };
        let bytes = file.get(self.offset as usize..end as usize).ok_or(truncated)?;
        let computed = crc32(bytes);
        if computed != self.crc {
            return Err(DecodeError::SectionChecksum { section: self.kind, stored: self.crc, computed });
        }
        Ok(bytes)
    }
}

impl Sections {
    /// Reads the table: sections follow the header in order, without gaps, and end at `file_len`. Compares the checksums
    /// of those that are to be skipped.
    pub(super) fn parse(
        table: &[[u8; SECTION_LEN]],
        features: Features,
        header_len: u16,
        file_len: u32,
        file: &[u8],
    ) -> Result<Self, DecodeError> {
        let mut rows = table.iter();
        let mut start = u32::from(header_len);
        let mut gaussians = None;
        let mut next = |wanted: SectionKind| {
            for row in rows.by_ref() {
                let section = Section::parse(row)?;
                if section.offset != start {
                    let Section { kind: section, offset: found, .. } = section;
                    return Err(DecodeError::Misplaced { section, expected: start, found });
                }
                let Some(end) = start.checked_add(section.len).filter(|&end| end <= file_len) else {
                    let available = file_len.saturating_sub(start);
                    return Err(DecodeError::Truncated { section: section.kind, needed: section.len, available });
                };
                start = end;
                if section.kind == wanted {
                    return Ok(section);
                }
                match section.kind {
                    SectionKind::Gaussians if gaussians.is_none() => gaussians = Some(section),
                    SectionKind::Other(_) => {}
                    found => return Err(DecodeError::UnexpectedSection { found, expected: wanted }),
                }
                section.bytes(file)?;
            }
            Err(DecodeError::MissingSection { section: wanted })
        };
        let mut sections = Self {
            gaussians: None,
            heads: next(SectionKind::Heads)?,
            lattice: next(SectionKind::Lattice)?,
            masks: if features.masks { Some(next(SectionKind::Masks)?) } else { None },
            coder: next(if features.context { SectionKind::Context } else { SectionKind::Tables })?,
            manifest: next(SectionKind::Manifest)?,
            directory: next(SectionKind::Directory)?,
            chunks: next(SectionKind::Chunks)?,
        };
        sections.gaussians = gaussians;
        if let Some(row) = rows.next() {
            let Section { kind: found, .. } = Section::parse(row)?;
            return Err(DecodeError::UnexpectedSection { found, expected: SectionKind::Chunks });
        }
        if start != file_len {
            return Err(DecodeError::WrongLength { section: SectionKind::Chunks, expected: file_len, found: start });
        }
        if sections.chunks.crc != 0 {
            let stored = sections.chunks.crc;
            return Err(DecodeError::SectionChecksum { section: SectionKind::Chunks, stored, computed: 0 });
        }
        Ok(sections)
    }

    /// The bytes of the sections, their checksums compared; those of the chunks go on to the end of the file, wherever that is.
    pub(super) fn bytes<'a>(&self, file: &'a [u8]) -> Result<SectionBytes<'a>, DecodeError> {
        let some = |section: &Option<Section>| section.as_ref().map(|section| section.bytes(file)).transpose();
        Ok(SectionBytes {
            heads: self.heads.bytes(file)?,
            lattice: self.lattice.bytes(file)?,
            masks: some(&self.masks)?,
            coder: self.coder.bytes(file)?,
            manifest: self.manifest.bytes(file)?,
            directory: self.directory.bytes(file)?,
            gaussians: some(&self.gaussians)?,
            chunks: file.get(self.chunks.offset as usize..).unwrap_or_default(),
        })
    }
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
