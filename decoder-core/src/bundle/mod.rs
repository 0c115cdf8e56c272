//! The view of a bundle's bytes: parsed and checked once, read in place ever after.
//!
//! [`Bundle::parse`] checks every offset, length, count, float and checksum but those of the chunks, so that nothing
//! after it can read outside the bytes. [`format`] (`FORMAT.md` beside this file) is the normative description. The module knows
//! nothing of rendering.
#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::panic)]

#[doc = include_str!("FORMAT.md")]
pub mod format {}

mod chunk;
mod crc;
mod cursor;
mod header;
mod heads;
mod section;
mod table;

pub use chunk::{AnchorReader, Chunk};
pub use crc::crc32;
pub(crate) use cursor::{Cursor, saturate};
pub(crate) use header::in_range;
pub use header::{
    Effects, HEADER_LEN, Header, MAGIC, MAX_ANCHORS, MAX_CHUNK_ANCHORS, MAX_FEATURE_DIM, MAX_OFFSETS, VERSION,
};
pub use heads::{Halves, HeadView, HeadsView};
pub use table::{Table, Tables};

use crate::error::{DecodeError, SectionKind};

/// A bundle in memory or flash, checked.
#[derive(Clone, Copy, Debug)]
pub struct Bundle<'a> {
    header: Header,
    heads: HeadsView<'a>,
    tables: Tables<'a>,
    directory: &'a [[u8; chunk::RECORD_LEN]],
    chunks: &'a [u8],
}

impl<'a> Bundle<'a> {
    /// Checks `bytes` and returns the view of them; bytes after the bundle's end are ignored, so a whole flash partition
    /// can be passed.
    ///
    /// # Errors
    /// [`DecodeError`] of class malformed or unsupported, naming the section and the numbers that disagree.
    ///
    /// # Budget
    /// No scratch. Reads header, heads, tables and directory once; the chunks' checksums wait for
    /// [`Decoder::bind`](crate::Decoder::bind).
    pub fn parse(bytes: &'a [u8]) -> Result<Self, DecodeError> {
        let (header, [heads, tables, directory, chunks]) = Header::parse(bytes)?;
        let heads = HeadsView::parse(heads.bytes(bytes)?, &header)?;
        let tables = Tables::parse(tables.bytes(bytes)?, header.n_channels())?;
        let (directory, odd_bytes) = directory.bytes(bytes)?.as_chunks();
        let found = saturate(directory.as_flattened().len()).saturating_add(saturate(odd_bytes.len()));
        let expected = header.n_chunks.saturating_mul(saturate(chunk::RECORD_LEN));
        if found != expected {
            return Err(DecodeError::WrongLength { section: SectionKind::Directory, expected, found });
        }
        let bundle = Self { header, heads, tables, directory, chunks: chunks.bytes(bytes)? };
        bundle.check_directory()?;
        Ok(bundle)
    }

    /// The scene-wide facts.
    #[must_use]
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The weights of the heads.
    #[must_use]
    pub fn heads(&self) -> &HeadsView<'a> {
        &self.heads
    }

    /// Quantisation and frequencies of the channels.
    #[must_use]
    pub fn tables(&self) -> &Tables<'a> {
        &self.tables
    }

    /// Chunk number `index`.
    ///
    /// # Errors
    /// [`DecodeError::NoSuchChunk`].
    pub fn chunk(&self, index: u32) -> Result<Chunk<'a>, DecodeError> {
        let no_such = DecodeError::NoSuchChunk { chunk: index, n_chunks: self.header.n_chunks };
        let record = self.directory.get(index as usize).ok_or(no_such)?;
        let (chunk, _, _) = Chunk::parse(record, index, &self.header, self.chunks)?;
        Ok(chunk)
    }

    /// All chunks in order.
    pub fn chunks(&self) -> impl Iterator<Item = Chunk<'a>> + use<'a> {
        let bundle = *self;
        (0..bundle.header.n_chunks).filter_map(move |index| bundle.chunk(index).ok())
    }

    /// Position of a lattice cell, normalised frame.
    #[inline]
    #[must_use]
    pub fn position(&self, lattice: [i32; 3]) -> [f32; 3] {
        lattice.map(|cell| cell as f32 * self.header.voxel_size)
    }

    /// The chunks lie one after the other and hold all anchors.
    fn check_directory(&self) -> Result<(), DecodeError> {
        let mut expected = 0;
        let mut n_anchors = 0_u32;
        for (index, record) in (0..).zip(self.directory) {
            let (chunk, found, end) = Chunk::parse(record, index, &self.header, self.chunks)?;
            if found != expected {
                return Err(DecodeError::Misplaced { section: SectionKind::Chunks, expected, found });
            }
            expected = end;
            n_anchors = n_anchors.saturating_add(chunk.n_anchors().into());
        }
        if expected != saturate(self.chunks.len()) {
            let found = saturate(self.chunks.len());
            return Err(DecodeError::WrongLength { section: SectionKind::Chunks, expected, found });
        }
        header::in_range(crate::error::Field::NAnchors, n_anchors, self.header.n_anchors, self.header.n_anchors)
    }
}
