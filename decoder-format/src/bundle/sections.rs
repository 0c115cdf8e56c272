//! The sections of a bundle: their bytes, and the table that says where they lie.

use super::features::Features;
use super::header::{Header, header_len};
use super::section::{ALIGNMENT, PROTOCOL_CODE, SECTION_LEN, Section, padded};
use crate::bytes::crc32;
use crate::error::{DecodeError, SectionKind, saturate};

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
    /// How the photographs were prepared, in words that no decoder reads.
    pub protocol: Option<&'a [u8]>,
    /// The chunks.
    pub chunks: &'a [u8],
}

impl<'a> SectionBytes<'a> {
    /// The bytes of a bundle of these sections: the reverse of [`Bundle::parse`](super::Bundle::parse).
    ///
    /// * `header`: its lengths are filled in.
    pub fn emit(&self, header: &Header) -> impl Iterator<Item = u8> + use<'a> {
        let sections = self.in_order(header.features);
        // At most ten.
        let header_len = header_len(sections.clone().count() as u8);
        let rows = sections.clone().scan(saturate(header_len), |next, (kind, bytes)| {
            let (offset, len) = (*next, saturate(bytes.len()));
            *next = padded(offset.saturating_add(len));
            // Each chunk has its own checksum, so that a device need not read all of them to draw some.
            let crc = if kind == SectionKind::Chunks { 0 } else { crc32(bytes) };
            Some(Section { kind, offset, len, crc })
        });
        let header = Header { header_len: header_len as u16, file_len: saturate(self.file_len()), ..*header };
        header.emit(rows).chain(sections.flat_map(|(_, bytes)| {
            let n_padding = padded_len(bytes).saturating_sub(bytes.len());
            bytes.iter().copied().chain(core::iter::repeat_n(0, n_padding))
        }))
    }

    /// How many bytes [`emit`](Self::emit) makes; a bundle has less than 4 GiB.
    #[must_use]
    pub fn file_len(&self) -> usize {
        let sections = self.in_order(Features::default());
        let header_len = header_len(sections.clone().count() as u8);
        sections.fold(header_len, |sum, (_, bytes)| sum.saturating_add(padded_len(bytes)))
    }

    /// Finds the sections in a file, and compares their checksums but for the chunks', which have their own; also returns the length
    /// of the chunks, of which a file that was cut has less.
    ///
    /// * `table`: its rows follow the header in order, each at the next multiple of [`ALIGNMENT`].
    pub(super) fn parse(
        table: &[[u8; SECTION_LEN]],
        header: &Header,
        file: &'a [u8],
    ) -> Result<(Self, u32), DecodeError> {
        let Header { features, file_len, header_len, .. } = *header;
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
                // Of the chunks the file may have less.
                let is_whole = |end: &u32| *end <= file_len || section.kind == SectionKind::Chunks;
                let Some(end) = start.checked_add(section.len).filter(is_whole) else {
                    let available = file_len.saturating_sub(start);
                    return Err(DecodeError::Truncated { section: section.kind, needed: section.len, available });
                };
                start = padded(end);
                match section.kind {
                    found if found == wanted => return Ok(section),
                    SectionKind::Gaussians if gaussians.is_none() => gaussians = Some(section.bytes(file)?),
                    SectionKind::Other(_) => _ = section.bytes(file)?,
                    found => return Err(DecodeError::UnexpectedSection { found, expected: wanted }),
                }
            }
            Err(DecodeError::MissingSection { section: wanted })
        };
        let mut bytes_of = |wanted| next(wanted)?.bytes(file);
        let mut sections = Self {
            heads: bytes_of(SectionKind::Heads)?,
            lattice: bytes_of(SectionKind::Lattice)?,
            masks: if features.masks { Some(bytes_of(SectionKind::Masks)?) } else { None },
            coder: bytes_of(if features.context { SectionKind::Context } else { SectionKind::Tables })?,
            manifest: bytes_of(SectionKind::Manifest)?,
            directory: bytes_of(SectionKind::Directory)?,
            gaussians: None,
            protocol: None,
            chunks: &[],
        };
        let Section { offset, len, crc: stored, .. } = next(SectionKind::Chunks)?;
        sections.gaussians = gaussians;
        let truncated = DecodeError::Truncated { section: SectionKind::Chunks, needed: len, available: 0 };
        let n_counted = file_len.checked_sub(offset).ok_or(truncated)?;
        let rest = file.get(offset as usize..).ok_or(truncated)?;
        sections.chunks = rest.get(..n_counted as usize).unwrap_or(rest);
        if let Some(row) = rows.next() {
            let Section { kind: found, .. } = Section::parse(row)?;
            return Err(DecodeError::UnexpectedSection { found, expected: SectionKind::Chunks });
        }
        if n_counted > len {
            return Err(DecodeError::WrongLength { section: SectionKind::Chunks, expected: n_counted, found: len });
        }
        if stored != 0 {
            return Err(DecodeError::SectionChecksum { section: SectionKind::Chunks, stored, computed: 0 });
        }
        Ok((sections, len))
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
            self.protocol.map(|bytes| (SectionKind::Other(PROTOCOL_CODE), bytes)),
            Some((SectionKind::Chunks, self.chunks)),
        ]
        .into_iter()
        .flatten()
    }
}

/// Bytes that a section takes up, those before the next one included.
fn padded_len(section: &[u8]) -> usize {
    section.len().next_multiple_of(ALIGNMENT as usize)
}
