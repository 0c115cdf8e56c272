//! The directory: the tiers, and one record a chunk.

use super::header::Header;
use super::section::{check_padding, padded};
use crate::bytes::{Cursor, Emitter, Fields};
use crate::error::{DecodeError, Field, SectionKind, in_range};

/// Length of a tier's record, bytes.
pub const TIER_RECORD_LEN: usize = 12;
/// Length of the ink frame, bytes.
pub const INK_FRAME_LEN: usize = 24;
/// Length of a chunk's record, bytes.
pub const CHUNK_RECORD_LEN: usize = 24;

/// What a scene consists of up to the end of a tier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tier {
    /// Chunks of this tier and those before it.
    pub n_chunks: u32,
    /// Anchors in them.
    pub n_anchors: u32,
    /// Where what follows the last of them begins, bytes from the start of the chunks section.
    pub end: u32,
}

/// What the corners of ink boxes are counted in, normalised frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct InkFrame {
    /// The corner of all zeros.
    pub min: [f32; 3],
    /// Distance of neighbouring coordinates.
    pub step: [f32; 3],
}

/// The tiers, the ink frame and the chunk records, checked.
#[derive(Clone, Copy, Debug)]
pub struct Directory<'a> {
    tiers: &'a [[u8; TIER_RECORD_LEN]],
    /// What the corners of ink boxes are counted in.
    pub ink_frame: InkFrame,
    records: &'a [[u8; CHUNK_RECORD_LEN]],
}

/// One chunk's record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ChunkRecord {
    /// Bytes of the chunk.
    pub len: u32,
    /// Its checksum.
    pub crc: u32,
    /// Anchors it holds.
    pub n_anchors: u16,
    /// Lowest corner of its ink box, in steps of the [`InkFrame`].
    pub low: [u16; 3],
    /// Highest corner.
    pub high: [u16; 3],
}

impl Tier {
    pub(super) fn parse(record: &[u8; TIER_RECORD_LEN]) -> Self {
        let [n_chunks, n_anchors, end] = Fields::new(record).u32s();
        Self { n_chunks, n_anchors, end }
    }

    /// The record's bytes: the reverse of `parse`.
    #[must_use]
    pub fn emit(&self) -> [u8; TIER_RECORD_LEN] {
        let mut out = Emitter::new();
        out.u32s([self.n_chunks, self.n_anchors, self.end]);
        out.finish()
    }
}

impl InkFrame {
    /// The point at coordinates `q`: `min + f32(q)·step`, multiplied, rounded, then added.
    #[inline]
    #[must_use]
    pub fn corner(&self, q: [u16; 3]) -> [f32; 3] {
        let ([x, y, z], [step_x, step_y, step_z]) = (self.min, self.step);
        let [q_x, q_y, q_z] = q.map(f32::from);
        [x + q_x * step_x, y + q_y * step_y, z + q_z * step_z]
    }

    pub(super) fn parse(record: &[u8; INK_FRAME_LEN]) -> Self {
        let mut fields = Fields::new(record);
        Self { min: fields.f32s(), step: fields.f32s() }
    }

    /// The frame's bytes: the reverse of `parse`.
    #[must_use]
    pub fn emit(&self) -> [u8; INK_FRAME_LEN] {
        let mut out = Emitter::new();
        out.f32s(self.min);
        out.f32s(self.step);
        out.finish()
    }

    fn check(&self) -> Result<(), DecodeError> {
        let farthest = self.corner([u16::MAX; 3]);
        for (index, ((min, step), farthest)) in (0..).zip(self.min.iter().zip(&self.step).zip(farthest)) {
            if !(min.is_finite() && *step >= 0.0 && farthest.is_finite()) {
                return Err(DecodeError::BadFloat { field: Field::InkFrame, index });
            }
        }
        Ok(())
    }
}

impl ChunkRecord {
    /// The record, and what it has in reserve, which must be 0.
    pub(super) fn parse(record: &[u8; CHUNK_RECORD_LEN]) -> (Self, u16) {
        let mut fields = Fields::new(record);
        let [len, crc] = fields.u32s();
        let [n_anchors, reserved] = fields.u16s();
        (Self { len, crc, n_anchors, low: fields.u16s(), high: fields.u16s() }, reserved)
    }

    /// The record's bytes: the reverse of `parse`.
    #[must_use]
    pub fn emit(&self) -> [u8; CHUNK_RECORD_LEN] {
        let mut out = Emitter::new();
        out.u32s([self.len, self.crc]);
        out.u16s([self.n_anchors, 0]);
        out.u16s(self.low);
        out.u16s(self.high);
        out.finish()
    }

    fn check(&self, header: &Header) -> Result<(), DecodeError> {
        in_range(Field::ChunkAnchors, self.n_anchors.into(), 1, header.max_chunk_anchors.into())?;
        in_range(Field::ChunkLen, self.len & 1, 0, 0)?;
        for (low, high) in self.low.into_iter().zip(self.high) {
            in_range(Field::InkBox, low.into(), 0, high.into())?;
        }
        Ok(())
    }
}

impl<'a> Directory<'a> {
    /// Reads the section.
    ///
    /// * `chunks`: the chunks section, as far as it is in the file. * `chunks_len`: its length.
    pub(super) fn parse(
        section: &'a [u8],
        header: &Header,
        chunks: &[u8],
        chunks_len: u32,
    ) -> Result<Self, DecodeError> {
        let mut cursor = Cursor::new(section, SectionKind::Directory);
        let (tiers, _) = cursor.bytes(usize::from(header.n_tiers).saturating_mul(TIER_RECORD_LEN))?.as_chunks();
        let ink_frame = InkFrame::parse(cursor.record()?);
        ink_frame.check()?;
        let records_len = usize::try_from(header.n_chunks).unwrap_or(usize::MAX).saturating_mul(CHUNK_RECORD_LEN);
        let (records, _) = cursor.bytes(records_len)?.as_chunks();
        cursor.end()?;
        let directory = Self { tiers, ink_frame, records };
        directory.check(header, chunks, chunks_len)?;
        Ok(directory)
    }

    /// Tier number `tier`.
    #[must_use]
    pub fn tier(&self, tier: u8) -> Option<Tier> {
        self.tiers.get(usize::from(tier)).map(Tier::parse)
    }

    /// The record of chunk number `index`.
    // Not inlined: every loop over chunks calls it.
    #[inline(never)]
    pub(super) fn record(&self, index: u32) -> Option<ChunkRecord> {
        self.records.get(index as usize).map(|record| ChunkRecord::parse(record).0)
    }

    /// Tiers and chunks add up, chunk by chunk and tier by tier, and between chunks there is nothing.
    fn check(&self, header: &Header, chunks: &[u8], chunks_len: u32) -> Result<(), DecodeError> {
        let mut sums = Tier::default();
        let mut records = self.records.iter();
        for tier in 0..header.n_tiers {
            let stored = self.tier(tier).ok_or(DecodeError::Internal)?;
            in_range(Field::TierChunks, stored.n_chunks, sums.n_chunks, header.n_chunks)?;
            let n_new = stored.n_chunks.saturating_sub(sums.n_chunks);
            for record in records.by_ref().take(n_new as usize) {
                let (record, reserved) = ChunkRecord::parse(record);
                in_range(Field::Reserved, reserved.into(), 0, 0)?;
                record.check(header)?;
                sums.n_anchors = sums.n_anchors.saturating_add(record.n_anchors.into());
                let end = sums.end.saturating_add(record.len);
                check_padding(chunks, end)?;
                sums.end = padded(end);
            }
            sums.n_chunks = stored.n_chunks;
            in_range(Field::TierAnchors, stored.n_anchors, sums.n_anchors, sums.n_anchors)?;
            in_range(Field::TierEnd, stored.end, sums.end, sums.end)?;
        }
        in_range(Field::TierChunks, sums.n_chunks, header.n_chunks, header.n_chunks)?;
        in_range(Field::NAnchors, sums.n_anchors, header.n_anchors, header.n_anchors)?;
        if sums.end != chunks_len {
            let [expected, found] = [sums.end, chunks_len];
            return Err(DecodeError::WrongLength { section: SectionKind::Chunks, expected, found });
        }
        Ok(())
    }
}
