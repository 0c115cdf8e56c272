//! The header: fixed fields, then the section table, then its own checksum.

use super::cursor::Cursor;
use super::{crc32, section::Section};
use crate::camera::Camera;
use crate::error::{DecodeError, Field, SectionKind};

/// The first bytes of every bundle. As in PNG: not ASCII, then a name, then line ends that text transfers would change.
pub const MAGIC: [u8; 8] = *b"\x89PSB\r\n\x1a\n";
/// The format version this crate reads.
pub const VERSION: u16 = 0;
/// Length of the header with its section table and checksum, bytes.
pub const HEADER_LEN: usize = 216;
/// The part of the header that its checksum covers: all but the checksum.
const CHECKED_LEN: usize = HEADER_LEN - 4;
/// Widest feature: a hidden layer has as many units, so it bounds the work of an anchor.
pub const MAX_FEATURE_DIM: u16 = 256;
/// Most offsets, that is splats, of an anchor.
pub const MAX_OFFSETS: u16 = 32;
/// Most anchors; with [`MAX_OFFSETS`] the number of splats stays below 2³².
pub const MAX_ANCHORS: u32 = 1 << 24;
/// Most anchors in a chunk. A directory record and a chunk without words take 56 bytes, so these bound the anchors that a
/// hostile file of a given length can ask to be evaluated.
pub const MAX_CHUNK_ANCHORS: u16 = 1024;
/// The only camera convention: OpenCV, x right, y down, z forward.
const CONVENTION_OPENCV: u8 = 0;

/// What a scene's heads and opacities take into account; anything else is absent and costs nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Effects {
    /// The heads see the unit vector from the camera to the anchor.
    pub view_direction: bool,
    /// The heads see the distance from the camera to the anchor, normalised units.
    pub view_distance: bool,
    /// Opacity is multiplied by √(det Σ / det(Σ + 0.3 I)) (Yu et al. 2024, Mip-Splatting, eq. 8).
    pub dilation_compensation: bool,
}

impl Effects {
    const VIEW_DIRECTION: u32 = 1;
    const VIEW_DISTANCE: u32 = 2;
    const DILATION_COMPENSATION: u32 = 4;

    /// The bits as the header stores them.
    #[must_use]
    pub const fn to_bits(self) -> u32 {
        (if self.view_direction { Self::VIEW_DIRECTION } else { 0 })
            | (if self.view_distance { Self::VIEW_DISTANCE } else { 0 })
            | (if self.dilation_compensation { Self::DILATION_COMPENSATION } else { 0 })
    }

    /// The effects that `bits` stand for.
    ///
    /// # Errors
    /// [`DecodeError::UnsupportedEffects`] with the bits that have no meaning in this version.
    pub const fn from_bits(bits: u32) -> Result<Self, DecodeError> {
        let unknown_bits = bits & !(Self::VIEW_DIRECTION | Self::VIEW_DISTANCE | Self::DILATION_COMPENSATION);
        if unknown_bits != 0 {
            return Err(DecodeError::UnsupportedEffects { unknown_bits });
        }
        Ok(Self {
            view_direction: bits & Self::VIEW_DIRECTION != 0,
            view_distance: bits & Self::VIEW_DISTANCE != 0,
            dilation_compensation: bits & Self::DILATION_COMPENSATION != 0,
        })
    }
}

/// The scene-wide facts of a bundle, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Header {
    /// Length of the bundle, bytes.
    pub file_len: u32,
    /// What the scene takes into account.
    pub effects: Effects,
    /// Feature width F of an anchor, 1..=[`MAX_FEATURE_DIM`].
    pub feature_dim: u16,
    /// Offsets K of an anchor, 1..=[`MAX_OFFSETS`].
    pub n_offsets: u16,
    /// Anchors of the scene.
    pub n_anchors: u32,
    /// Chunks of the scene.
    pub n_chunks: u32,
    /// No chunk has more anchors than this, 1..=[`MAX_CHUNK_ANCHORS`].
    pub max_chunk_anchors: u16,
    /// Size `[width, height]` of the images the scene was trained on, pixels; drawn at other sizes it loses quality.
    pub training_px: [u16; 2],
    /// What lies behind everything.
    pub background: [u8; 3],
    /// Edge of a lattice cell, normalised units.
    pub voxel_size: f32,
    /// Centre of the normalisation `p_norm = (p_world − centre)·scale`, capture units.
    pub normalisation_centre: [f64; 3],
    /// Scale of the normalisation, normalised units per capture unit.
    pub normalisation_scale: f64,
    /// One of the training views, so that a device can draw something by itself.
    pub preview: Camera,
}

impl Header {
    /// Inputs of every head: feature, then direction (3), then distance (1), the last two if present.
    #[must_use]
    pub fn head_inputs(&self) -> usize {
        let direction = if self.effects.view_direction { 3 } else { 0 };
        usize::from(self.feature_dim).saturating_add(direction).saturating_add(usize::from(self.effects.view_distance))
    }

    /// Channels of an anchor: F features, 6 log-scales, 3K offsets.
    #[must_use]
    pub fn n_channels(&self) -> usize {
        usize::from(self.feature_dim).saturating_add(6).saturating_add(usize::from(self.n_offsets).saturating_mul(3))
    }

    /// Splats that the scene holds at most: one per offset.
    #[must_use]
    pub fn n_splats_worst(&self) -> u32 {
        self.n_anchors.saturating_mul(u32::from(self.n_offsets))
    }

    /// Reads and checks the header and the section table.
    pub(super) fn parse(bytes: &[u8]) -> Result<(Self, [Section; 4]), DecodeError> {
        let mut cursor = Cursor::new(bytes, SectionKind::Header);
        if cursor.array() != Ok(MAGIC) {
            return Err(DecodeError::NotABundle);
        }
        let found = cursor.u16()?;
        if found != VERSION {
            return Err(DecodeError::UnsupportedVersion { found, supported: VERSION });
        }
        let header_len = cursor.u16()?;
        in_range(Field::HeaderLen, header_len.into(), HEADER_LEN as u32, HEADER_LEN as u32)?;
        let mut whole = Cursor::new(bytes, SectionKind::Header);
        let computed = crc32(whole.bytes(CHECKED_LEN)?);
        let stored = whole.u32()?;
        if stored != computed {
            return Err(DecodeError::SectionChecksum { section: SectionKind::Header, stored, computed });
        }
        let header = Self::parse_fields(&mut cursor)?;
        let sections = Section::parse_table(&mut cursor, header.file_len)?;
        Ok((header, sections))
    }

    fn parse_fields(cursor: &mut Cursor<'_>) -> Result<Self, DecodeError> {
        let file_len = cursor.u32()?;
        let effects = Effects::from_bits(cursor.u32()?)?;
        let [feature_dim, n_offsets] = [cursor.u16()?, cursor.u16()?];
        let [n_anchors, n_chunks] = [cursor.u32()?, cursor.u32()?];
        let max_chunk_anchors = cursor.u16()?;
        let [convention, n_sections] = cursor.array()?;
        let training_px = [cursor.u16()?, cursor.u16()?];
        let background = cursor.array()?;
        let reserved = cursor.u8()?;
        let voxel_size = cursor.f32()?;
        let normalisation_centre = [cursor.f64()?, cursor.f64()?, cursor.f64()?];
        let normalisation_scale = cursor.f64()?;
        let preview = Camera {
            rotation: cursor.f32s()?,
            translation: cursor.f32s()?,
            focal_px: cursor.f32s()?,
            principal_px: cursor.f32s()?,
            width_px: cursor.u16()?,
            height_px: cursor.u16()?,
        };
        in_range(Field::FeatureDim, feature_dim.into(), 1, MAX_FEATURE_DIM.into())?;
        in_range(Field::NOffsets, n_offsets.into(), 1, MAX_OFFSETS.into())?;
        in_range(Field::NAnchors, n_anchors, 0, MAX_ANCHORS)?;
        in_range(Field::NChunks, n_chunks, 0, n_anchors)?;
        in_range(Field::MaxChunkAnchors, max_chunk_anchors.into(), 1, MAX_CHUNK_ANCHORS.into())?;
        in_range(Field::CameraConvention, convention.into(), 0, CONVENTION_OPENCV.into())?;
        in_range(Field::NSections, n_sections.into(), 4, 4)?;
        in_range(Field::Reserved, reserved.into(), 0, 0)?;
        for size_px in training_px {
            in_range(Field::TrainingSize, size_px.into(), 1, u32::from(u16::MAX))?;
        }
        if !(voxel_size.is_finite() && voxel_size > 0.0) {
            return Err(DecodeError::BadFloat { field: Field::VoxelSize, index: 0 });
        }
        let normal = normalisation_centre.iter().all(|x| x.is_finite());
        if !(normal && normalisation_scale.is_finite() && normalisation_scale > 0.0) {
            return Err(DecodeError::BadFloat { field: Field::Normalisation, index: 0 });
        }
        if preview.check().is_err() {
            return Err(DecodeError::BadFloat { field: Field::PreviewCamera, index: 0 });
        }
        Ok(Self {
            file_len,
            effects,
            feature_dim,
            n_offsets,
            n_anchors,
            n_chunks,
            max_chunk_anchors,
            training_px,
            background,
            voxel_size,
            normalisation_centre,
            normalisation_scale,
            preview,
        })
    }
}

/// Checks `least <= found <= most` and names the limit that does not hold.
pub(crate) fn in_range(field: Field, found: u32, least: u32, most: u32) -> Result<(), DecodeError> {
    if found < least {
        return Err(DecodeError::OutOfRange { field, found, limit: least });
    }
    if found > most {
        return Err(DecodeError::OutOfRange { field, found, limit: most });
    }
    Ok(())
}
