//! A chunk: up to a few hundred neighbouring anchors that decode by themselves.

use super::cursor::{Cursor, saturate};
use super::header::{Header, in_range};
use super::{Tables, crc32};
use crate::entropy::{AnsReader, BitReader};
use crate::error::{DecodeError, Field, SectionKind};

/// Length of a directory record, bytes.
pub(super) const RECORD_LEN: usize = 40;
/// Length of a chunk's fixed fields, bytes.
const FIXED_LEN: usize = 16;
/// Lattice coordinates stay within ±2²⁴, where f32 still holds every integer.
const MAX_LATTICE_BASE: u32 = 1 << 23;
/// Most bits of a packed lattice coordinate.
const MAX_LATTICE_BITS: u8 = 23;

/// One record of the directory and the bytes it points to.
#[derive(Clone, Copy, Debug)]
pub struct Chunk<'a> {
    index: u32,
    n_anchors: u16,
    ink_min: [f32; 3],
    ink_max: [f32; 3],
    crc: u32,
    bytes: &'a [u8],
}

/// Decodes the anchors of one chunk in their order, one at a time.
#[derive(Clone, Copy, Debug)]
#[must_use = "only `finish` tells whether the anchors were sound"]
pub struct AnchorReader<'a> {
    chunk: u32,
    tables: Tables<'a>,
    base: [i32; 3],
    bits: [u8; 3],
    lattice: BitReader<'a>,
    symbols: AnsReader<'a>,
    n_word_bytes: usize,
}

impl<'a> Chunk<'a> {
    /// Reads record `index`; `expected` is where its bytes must begin. Returns it with where they end.
    pub(super) fn parse(
        record: &[u8; RECORD_LEN],
        index: u32,
        header: &Header,
        chunks: &'a [u8],
    ) -> Result<(Self, u32, u32), DecodeError> {
        let mut cursor = Cursor::new(record, SectionKind::Directory);
        let [offset, len, crc] = [cursor.u32()?, cursor.u32()?, cursor.u32()?];
        let [n_anchors, reserved] = [cursor.u16()?, cursor.u16()?];
        let [ink_min, ink_max] = [cursor.f32s::<3>()?, cursor.f32s::<3>()?];
        in_range(Field::ChunkAnchors, n_anchors.into(), 1, header.max_chunk_anchors.into())?;
        in_range(Field::Reserved, reserved.into(), 0, 0)?;
        let ordered = ink_min.iter().zip(&ink_max).all(|(min, max)| min.is_finite() && max.is_finite() && min <= max);
        if !ordered {
            return Err(DecodeError::BadFloat { field: Field::InkBox, index });
        }
        let end = offset.saturating_add(len);
        let bytes = chunks.get(offset as usize..end as usize).ok_or(DecodeError::Truncated {
            section: SectionKind::Chunks,
            needed: end,
            available: saturate(chunks.len()),
        })?;
        Ok((Self { index, n_anchors, ink_min, ink_max, crc, bytes }, offset, end))
    }

    /// Its number in the directory.
    #[must_use]
    pub fn index(&self) -> u32 {
        self.index
    }

    /// Anchors it holds.
    #[must_use]
    pub fn n_anchors(&self) -> u16 {
        self.n_anchors
    }

    /// Its coded length, bytes.
    #[must_use]
    pub fn n_bytes(&self) -> usize {
        self.bytes.len()
    }

    /// Corners of the box that encloses all its anchors can draw, normalised frame: splat centres ± 3.33 base scales.
    #[must_use]
    pub fn ink_box(&self) -> ([f32; 3], [f32; 3]) {
        (self.ink_min, self.ink_max)
    }

    /// Compares the chunk's checksum.
    ///
    /// # Errors
    /// [`DecodeError::ChunkChecksum`] naming the chunk.
    ///
    /// # Budget
    /// About 8 instructions a byte.
    pub fn check(&self) -> Result<(), DecodeError> {
        let computed = crc32(self.bytes);
        if computed != self.crc {
            return Err(DecodeError::ChunkChecksum { chunk: self.index, stored: self.crc, computed });
        }
        Ok(())
    }

    /// Starts decoding without comparing the checksum, which [`check`](Self::check) did before.
    ///
    /// # Errors
    /// [`DecodeError::ChunkTooShort`] or [`DecodeError::OutOfRange`] for a chunk that no writer makes.
    pub fn anchors(&self, tables: &Tables<'a>) -> Result<AnchorReader<'a>, DecodeError> {
        let mut cursor = Cursor::new(self.bytes, SectionKind::Chunks);
        let too_short = |needed: usize| DecodeError::ChunkTooShort {
            chunk: self.index,
            needed: saturate(needed),
            available: saturate(self.bytes.len()),
        };
        let (Ok(x), Ok(y), Ok(z)) = (cursor.i32(), cursor.i32(), cursor.i32()) else {
            return Err(too_short(FIXED_LEN));
        };
        let Ok([bits @ .., reserved]) = cursor.array::<4>() else { return Err(too_short(FIXED_LEN)) };
        in_range(Field::Reserved, reserved.into(), 0, 0)?;
        let mut bits_per_anchor = 0_usize;
        for (base, bits) in [x, y, z].into_iter().zip(bits) {
            in_range(Field::LatticeBase, base.unsigned_abs(), 0, MAX_LATTICE_BASE)?;
            in_range(Field::LatticeBits, bits.into(), 0, MAX_LATTICE_BITS.into())?;
            bits_per_anchor = bits_per_anchor.saturating_add(bits.into());
        }
        let lattice_len = bits_per_anchor.saturating_mul(self.n_anchors.into()).div_ceil(16).saturating_mul(2);
        let lattice = cursor.bytes(lattice_len).map_err(|_| too_short(FIXED_LEN.saturating_add(lattice_len)))?;
        let (words, odd_byte) = cursor.rest().as_chunks();
        if !odd_byte.is_empty() {
            return Err(DecodeError::ChunkStream { chunk: self.index, left_bytes: 1 });
        }
        Ok(AnchorReader {
            chunk: self.index,
            tables: *tables,
            base: [x, y, z],
            bits,
            lattice: BitReader::new(lattice),
            symbols: AnsReader::new(words),
            n_word_bytes: words.as_flattened().len(),
        })
    }

    /// Decodes all anchors of the chunk as symbols, its checksum compared first.
    ///
    /// * `lattice`: `[n_anchors]`, filled with lattice coordinates; the position is `lattice · voxel_size`.
    /// * `symbols`: `[n_anchors, n_channels]` row-major, filled; channels as [`Header::n_channels`] lists them.
    ///
    /// # Errors
    /// [`DecodeError::BufferTooShort`]; [`DecodeError::ChunkChecksum`] or [`DecodeError::ChunkStream`] for damage.
    pub fn decode_symbols(
        &self,
        tables: &Tables<'a>,
        lattice: &mut [[i32; 3]],
        symbols: &mut [i16],
    ) -> Result<(), DecodeError> {
        self.decode(tables, lattice, symbols, AnchorReader::symbols)
    }

    /// Decodes all anchors of the chunk as values, its checksum compared first.
    ///
    /// * `lattice`: `[n_anchors]`, filled with lattice coordinates; the position is `lattice · voxel_size`.
    /// * `values`: `[n_anchors, n_channels]` row-major, filled: F features, 6 log-scales, 3K offsets.
    ///
    /// # Errors
    /// [`DecodeError::BufferTooShort`]; [`DecodeError::ChunkChecksum`] or [`DecodeError::ChunkStream`] for damage.
    pub fn decode_values(
        &self,
        tables: &Tables<'a>,
        lattice: &mut [[i32; 3]],
        values: &mut [f32],
    ) -> Result<(), DecodeError> {
        self.decode(tables, lattice, values, AnchorReader::values)
    }

    fn decode<T>(
        &self,
        tables: &Tables<'a>,
        lattice: &mut [[i32; 3]],
        rows: &mut [T],
        read_row: impl Fn(&mut AnchorReader<'a>, &mut [T]),
    ) -> Result<(), DecodeError> {
        let n_anchors = usize::from(self.n_anchors);
        let row_len = tables.n_channels();
        let n_values = n_anchors.saturating_mul(row_len);
        let too_short = |field, needed, available| DecodeError::BufferTooShort {
            field,
            needed: saturate(needed),
            available: saturate(available),
        };
        let [n_lattice, n_rows] = [lattice.len(), rows.len()];
        let lattice = lattice.get_mut(..n_anchors).ok_or(too_short(Field::LatticeBuffer, n_anchors, n_lattice))?;
        let rows = rows.get_mut(..n_values).ok_or(too_short(Field::ChannelBuffer, n_values, n_rows))?;
        self.check()?;
        let mut reader = self.anchors(tables)?;
        // `max(1)`: a chunk size of zero would panic; there are always at least 6 channels.
        for (cell, row) in lattice.iter_mut().zip(rows.chunks_exact_mut(row_len.max(1))) {
            *cell = reader.lattice();
            read_row(&mut reader, row);
        }
        reader.finish()
    }
}

impl AnchorReader<'_> {
    /// The next anchor's lattice coordinates; one call an anchor.
    #[inline]
    pub fn lattice(&mut self) -> [i32; 3] {
        let [x, y, z] = self.base;
        let [bits_x, bits_y, bits_z] = self.bits;
        // |base| ≤ 2²³ and an offset has at most 23 bits, so the sums stay below 2²⁴.
        let mut add = |base: i32, bits: u8| base.wrapping_add(self.lattice.take(bits.into()) as i32);
        [add(x, bits_x), add(y, bits_y), add(z, bits_z)]
    }

    /// The next anchor's symbols, one a channel.
    pub fn symbols(&mut self, row: &mut [i16]) {
        for (symbol, table) in row.iter_mut().zip(self.tables.of_channels()) {
            *symbol = table.symbol(&mut self.symbols);
        }
    }

    /// The next anchor's values, one a channel.
    pub fn values(&mut self, row: &mut [f32]) {
        for (value, table) in row.iter_mut().zip(self.tables.of_channels()) {
            *value = table.value(table.symbol(&mut self.symbols));
        }
    }

    /// Bytes of all the chunk's symbols.
    #[must_use]
    pub fn n_word_bytes(&self) -> usize {
        self.n_word_bytes
    }

    /// Ends the chunk after its last anchor.
    ///
    /// # Errors
    /// [`DecodeError::ChunkStream`] when the symbols do not end where the bytes end.
    pub fn finish(self) -> Result<(), DecodeError> {
        self.symbols.finish().map_err(|left| DecodeError::ChunkStream { chunk: self.chunk, left_bytes: saturate(left) })
    }
}
