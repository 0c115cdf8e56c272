//! A chunk: up to a few hundred neighbouring anchors that decode by themselves.

use core::ops::Range;

use super::directory::{ChunkRecord, Directory, InkFrame};
use super::section::padded;
use super::{AnchorModels, AnchorReader, AnchorSite};
use crate::bytes::crc32;
use crate::error::{DecodeError, Field, saturate};

/// One record of the directory and the bytes it stands for.
#[derive(Clone, Copy, Debug)]
pub struct Chunk<'a> {
    index: u32,
    offset: u32,
    record: ChunkRecord,
    ink_frame: InkFrame,
    words: &'a [[u8; 2]],
}

/// The chunks of a file, one after the other; made by [`Bundle::chunks`](super::Bundle::chunks).
#[derive(Clone, Debug)]
pub struct Chunks<'a> {
    pub(super) directory: Directory<'a>,
    /// The chunks section.
    pub(super) chunks: &'a [u8],
    /// Those to come.
    pub(super) numbers: Range<u32>,
    /// Where the first of them begins.
    pub(super) offset: u32,
}

impl<'a> Iterator for Chunks<'a> {
    type Item = Chunk<'a>;

    // Not inlined: there are many loops over chunks.
    #[inline(never)]
    fn next(&mut self) -> Option<Chunk<'a>> {
        let index = self.numbers.next()?;
        let record = self.directory.record(index)?;
        let offset = self.offset;
        self.offset = padded(offset.saturating_add(record.len));
        Chunk::new(index, offset, record, self.directory.ink_frame, self.chunks)
    }
}

impl<'a> Chunk<'a> {
    /// The chunk of `record`, whose bytes begin at `offset` of the section `chunks`.
    pub(super) fn new(
        index: u32,
        offset: u32,
        record: ChunkRecord,
        ink_frame: InkFrame,
        chunks: &'a [u8],
    ) -> Option<Self> {
        let bytes = chunks.get(offset as usize..)?.get(..record.len as usize)?;
        let (words, _) = bytes.as_chunks();
        Some(Self { index, offset, record, ink_frame, words })
    }

    /// Its number in the directory.
    #[must_use]
    pub fn index(&self) -> u32 {
        self.index
    }

    /// Anchors it holds.
    #[must_use]
    pub fn n_anchors(&self) -> u16 {
        self.record.n_anchors
    }

    /// Its coded length, bytes, without those up to the next chunk.
    #[must_use]
    pub fn n_bytes(&self) -> usize {
        self.words.as_flattened().len()
    }

    /// Where it begins, bytes from the start of the chunks section.
    #[must_use]
    pub fn offset(&self) -> u32 {
        self.offset
    }

    /// Corners of the box that encloses all its anchors can draw, normalised frame: splat centres ± 3.33 base scales.
    #[must_use]
    pub fn ink_box(&self) -> ([f32; 3], [f32; 3]) {
        (self.ink_frame.corner(self.record.low), self.ink_frame.corner(self.record.high))
    }

    /// Compares the chunk's checksum.
    ///
    /// # Errors
    /// [`DecodeError::ChunkChecksum`] naming the chunk.
    ///
    /// # Budget
    /// About 8 instructions a byte.
    pub fn check(&self) -> Result<(), DecodeError> {
        let computed = crc32(self.words.as_flattened());
        if computed != self.record.crc {
            return Err(DecodeError::ChunkChecksum { chunk: self.index, stored: self.record.crc, computed });
        }
        Ok(())
    }

    /// Starts decoding without comparing the checksum, which [`check`](Self::check) did before.
    ///
    /// * `models`: of the same bundle; of another one the anchors have no meaning.
    pub fn anchors<'m, 's>(&self, models: &'m mut AnchorModels<'a, 's>) -> AnchorReader<'a, 's, 'm> {
        AnchorReader::new(self.index, self.words, models)
    }

    /// Decodes all anchors of the chunk as symbols, its checksum compared first.
    ///
    /// * `sites`: `[n_anchors]`, filled.
    /// * `symbols`: `[n_anchors, n_channels]` row-major, filled; channels as [`Header::n_channels`] lists them.
    ///
    /// [`Header::n_channels`]: super::Header::n_channels
    ///
    /// # Errors
    /// [`DecodeError::BufferTooShort`]; [`DecodeError::ChunkChecksum`] or [`DecodeError::ChunkStream`] for damage.
    pub fn decode_symbols(
        &self,
        models: &mut AnchorModels<'a, '_>,
        sites: &mut [AnchorSite],
        symbols: &mut [i16],
    ) -> Result<(), DecodeError> {
        self.decode(models, sites, symbols, AnchorReader::symbols)
    }

    /// Decodes all anchors of the chunk as values, its checksum compared first.
    ///
    /// * `sites`: `[n_anchors]`, filled.
    /// * `values`: `[n_anchors, n_channels]` row-major, filled: F features, the log-scales, 3K offsets.
    ///
    /// # Errors
    /// [`DecodeError::BufferTooShort`]; [`DecodeError::ChunkChecksum`] or [`DecodeError::ChunkStream`] for damage.
    pub fn decode_values(
        &self,
        models: &mut AnchorModels<'a, '_>,
        sites: &mut [AnchorSite],
        values: &mut [f32],
    ) -> Result<(), DecodeError> {
        self.decode(models, sites, values, AnchorReader::values)
    }

    fn decode<'s, 'm, T>(
        &self,
        models: &'m mut AnchorModels<'a, 's>,
        sites: &mut [AnchorSite],
        rows: &mut [T],
        read_row: impl Fn(&mut AnchorReader<'a, 's, 'm>, &mut [T]),
    ) -> Result<(), DecodeError> {
        let n_anchors = usize::from(self.n_anchors());
        let row_len = models.n_channels();
        let n_values = n_anchors.saturating_mul(row_len);
        let too_short = |field, needed, available| DecodeError::BufferTooShort {
            field,
            needed: saturate(needed),
            available: saturate(available),
        };
        let [n_sites, n_rows] = [sites.len(), rows.len()];
        let sites = sites.get_mut(..n_anchors).ok_or(too_short(Field::SiteBuffer, n_anchors, n_sites))?;
        let rows = rows.get_mut(..n_values).ok_or(too_short(Field::ChannelBuffer, n_values, n_rows))?;
        self.check()?;
        let mut reader = self.anchors(models);
        // `max(1)`: a chunk size of zero would panic; there are always at least 8 channels.
        for (site, row) in sites.iter_mut().zip(rows.chunks_exact_mut(row_len.max(1))) {
            *site = reader.site();
            read_row(&mut reader, row);
        }
        reader.finish()
    }
}
