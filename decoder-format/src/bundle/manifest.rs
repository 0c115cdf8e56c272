//! The manifest: what each tier was measured to look like and to cost.

use crate::bytes::{Cursor, Emitter, Fields};
use crate::error::{DecodeError, Field, SectionKind, in_range};

/// Length of a tier's record, bytes.
pub const MANIFEST_RECORD_LEN: usize = 64;

/// Highest level that a tier may declare.
pub const MAX_LEVEL: u8 = 5;

/// Numbers of horizontal strips that a frame is cut into to measure it, and that plans try.
pub const STRIPS: [u8; 4] = [1, 2, 4, 8];

/// The bits that stand for "not measured".
const NOT_MEASURED: u32 = 0x7FC0_0000;

/// Quality and work of the scene that consists of a tier and those before it.
///
/// The maxima are over [`n_cameras`](Self::n_cameras) views, each at the training size; another view may need more. By
/// default nothing is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TierMeasures {
    /// Mean PSNR over held-out training views, dB; `None` when not measured.
    pub psnr_db: Option<f32>,
    /// Views it is the mean of.
    pub n_views: u16,
    /// Views over which the maxima below were taken.
    pub n_cameras: u16,
    /// Anchors of a frame that pass the prefilter.
    pub max_visible_anchors: u32,
    /// Splats of a frame.
    pub max_splats: u32,
    /// Splats of a strip when the frame is cut into [`STRIPS`] horizontal strips.
    pub max_strip_splats: [u32; 4],
    /// Pairs of a 16×16 tile and a splat in such a strip.
    pub max_strip_pairs: [u32; 4],
    /// Multiply-adds of the heads in a frame, in units of 1024.
    pub max_head_kilo_macs: u32,
    /// Pixel evaluations of a frame, in units of 1024.
    pub max_kilo_pixels: u32,
    /// Anchors in the chunks in view.
    pub max_decoded_anchors: u32,
    /// Level whose limits the scene keeps, 1..=[`MAX_LEVEL`]; 0 where none is declared.
    pub level: u8,
}

impl TierMeasures {
    /// Reads the record of tier number `tier`.
    pub(super) fn parse(record: &[u8; MANIFEST_RECORD_LEN], tier: u32) -> Result<Self, DecodeError> {
        let mut fields = Fields::new(record);
        let psnr_bits = fields.u32();
        let psnr_db = (psnr_bits != NOT_MEASURED).then_some(f32::from_bits(psnr_bits));
        if psnr_db.is_some_and(|psnr_db| !psnr_db.is_finite()) {
            return Err(DecodeError::BadFloat { field: Field::ManifestPsnr, index: tier });
        }
        // What is reserved behind the level is 0.
        let [.., level, a, b, c] = *record;
        in_range(Field::TierLevel, u32::from_le_bytes([level, a, b, c]), 0, MAX_LEVEL.into())?;
        Ok(Self {
            psnr_db,
            n_views: fields.u16(),
            n_cameras: fields.u16(),
            max_visible_anchors: fields.u32(),
            max_splats: fields.u32(),
            max_strip_splats: fields.u32s(),
            max_strip_pairs: fields.u32s(),
            max_head_kilo_macs: fields.u32(),
            max_kilo_pixels: fields.u32(),
            max_decoded_anchors: fields.u32(),
            level,
        })
    }

    /// The record's bytes: the reverse of `parse`.
    #[must_use]
    pub fn emit(&self) -> [u8; MANIFEST_RECORD_LEN] {
        let mut out = Emitter::new();
        out.u32s([self.psnr_db.map_or(NOT_MEASURED, f32::to_bits)]);
        out.u16s([self.n_views, self.n_cameras]);
        out.u32s([self.max_visible_anchors, self.max_splats]);
        out.u32s(self.max_strip_splats);
        out.u32s(self.max_strip_pairs);
        out.u32s([self.max_head_kilo_macs, self.max_kilo_pixels, self.max_decoded_anchors]);
        out.bytes([self.level, 0, 0, 0]);
        out.finish()
    }
}

/// Reads and checks the records of all tiers.
pub(super) fn parse(section: &[u8], n_tiers: u8) -> Result<&[[u8; MANIFEST_RECORD_LEN]], DecodeError> {
    let mut cursor = Cursor::new(section, SectionKind::Manifest);
    let (records, _) = cursor.bytes(usize::from(n_tiers).saturating_mul(MANIFEST_RECORD_LEN))?.as_chunks();
    cursor.end()?;
    for (tier, record) in (0..).zip(records) {
        TierMeasures::parse(record, tier)?;
    }
    Ok(records)
}
