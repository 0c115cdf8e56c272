//! The header: fixed fields, then the section table, then its own checksum.

use super::features::Features;
use super::section::{SECTION_LEN, Section};
use crate::bytes::{Cursor, Emitter, Fields, crc32, crc32_of};
use crate::camera::{Camera, MOST_OFF, Rotation};
use crate::context::N_GROUPS;
use crate::error::{DecodeError, Field, SectionKind, in_range, saturate};

/// The first bytes of every bundle. As in PNG: not ASCII, then a name, then line ends that text transfers would change.
pub const MAGIC: [u8; 8] = *b"\x89PSB\r\n\x1a\n";
/// The format version this crate reads.
pub const VERSION: u16 = 4;
/// Length of the header's fields before the section table, bytes.
pub const HEADER_FIXED_LEN: usize = 160;
/// Length of those behind magic, version and length.
const HEADER_FIELDS_LEN: usize = HEADER_FIXED_LEN - 12;
/// Widest feature and hidden layer; bounds the work of an anchor.
pub const MAX_FEATURE_DIM: u16 = 256;
/// No voxel is as large, so that no position is too far from any camera for f32.
const VOXEL_SIZE_END: f32 = 1e9;
/// Most offsets, that is splats, of an anchor.
pub const MAX_OFFSETS: u16 = 32;
/// Most anchors; with [`MAX_OFFSETS`] the number of splats stays below 2³².
pub const MAX_ANCHORS: u32 = 1 << 24;
/// Most anchors in a chunk. A directory record takes 24 bytes, so these bound the anchors that a hostile file of a given
/// length can ask to be evaluated.
pub const MAX_CHUNK_ANCHORS: u16 = 1024;
/// Most tiers.
pub const MAX_TIERS: u8 = 8;
/// The only camera convention: OpenCV, x right, y down, z forward.
const CONVENTION_OPENCV: u8 = 0;
/// Heads, lattice, tables or context, manifest, directory, chunks.
const MIN_SECTIONS: u8 = 6;

/// Length of a header with `n_sections` sections, its section table and checksum included, bytes.
#[must_use]
pub const fn header_len(n_sections: u8) -> usize {
    // At most 164 + 16·255.
    (n_sections as usize).wrapping_mul(SECTION_LEN).wrapping_add(HEADER_FIXED_LEN).wrapping_add(4)
}

/// The scene-wide facts of a bundle, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Header {
    /// Length of the header, bytes.
    pub header_len: u16,
    /// Length of the bundle, bytes: up to its last tier, or up to the one that it was cut after.
    pub file_len: u32,
    /// What it requires of a decoder.
    pub features: Features,
    /// Feature width F of an anchor, 1..=[`MAX_FEATURE_DIM`].
    pub feature_dim: u16,
    /// Offsets K of an anchor, 1..=[`MAX_OFFSETS`].
    pub n_offsets: u16,
    /// Anchors of all tiers.
    pub n_anchors: u32,
    /// Chunks of all tiers.
    pub n_chunks: u32,
    /// No chunk has more anchors than this, 1..=[`MAX_CHUNK_ANCHORS`].
    pub max_chunk_anchors: u16,
    /// Tiers the bundle was written with, 1..=[`MAX_TIERS`].
    pub n_tiers: u8,
    /// Size `[width, height]` of the images the scene was trained on, pixels; drawn at other sizes it loses quality.
    pub training_px: [u16; 2],
    /// What lies behind everything; black without its feature.
    pub background: [u8; 3],
    /// Edge of a lattice cell, normalised units.
    pub voxel_size: f32,
    /// Hidden width of the colour head, 1..=[`MAX_FEATURE_DIM`]; the other two have F.
    pub colour_hidden: u16,
    /// Hidden width of the detail head, 1..=[`MAX_FEATURE_DIM`]; 0 where the scene has none.
    pub detail_hidden: u16,
    /// Bits that hold, as a signed number, every symbol of a feature, of a log-scale, of a coordinate of an offset, 1..=16.
    pub symbol_bits: [u8; N_GROUPS],
    /// Centre of the normalisation `p_norm = (p_world − centre)·scale`, capture units.
    pub normalisation_centre: [f64; 3],
    /// Scale of the normalisation, normalised units per capture unit.
    pub normalisation_scale: f64,
    /// One of the training views, so that a device can draw something by itself.
    pub preview: Camera,
}

impl Header {
    /// Inputs of the opacity and of the covariance head: feature, then distance (1), then direction (3), the last two if these
    /// heads see them.
    #[must_use]
    pub fn geometry_inputs(&self) -> usize {
        self.head_inputs(self.features.effects.view_geometry)
    }

    /// Inputs of the colour head, as [`Self::geometry_inputs`].
    #[must_use]
    pub fn colour_inputs(&self) -> usize {
        self.head_inputs(self.features.effects.view_colour)
    }

    fn head_inputs(&self, sees_direction: bool) -> usize {
        let distance = usize::from(self.features.effects.view_distance);
        let direction = if sees_direction { 3 } else { 0 };
        usize::from(self.feature_dim).saturating_add(distance).saturating_add(direction)
    }

    /// Bits that hold every symbol of a channel as a signed number.
    #[must_use]
    pub fn symbol_bits_of(&self, channel: usize) -> u8 {
        let [feature, log_scale, offset] = self.symbol_bits;
        if channel < self.feature_dim.into() {
            feature
        } else if channel < self.n_scalars() {
            log_scale
        } else {
            offset
        }
    }

    /// Channels of an anchor: F features, log-scales, 3K offsets.
    #[must_use]
    pub fn n_channels(&self) -> usize {
        self.n_scalars().saturating_add(usize::from(self.n_offsets).saturating_mul(3))
    }

    /// Channels of an anchor before those of its offsets: F features, log-scales.
    #[must_use]
    pub fn n_scalars(&self) -> usize {
        usize::from(self.feature_dim).saturating_add(self.n_log_scales().into())
    }

    /// Log-scales of an anchor: three of its extent, and the base size of its Gaussians, which where they are anisotropic is
    /// three as well.
    #[must_use]
    pub fn n_log_scales(&self) -> u16 {
        n_log_scales(self.features.effects.anisotropic)
    }

    /// Reads and checks the header; returns it with the section table.
    pub(super) fn parse(bytes: &[u8]) -> Result<(Self, &[[u8; SECTION_LEN]]), DecodeError> {
        let mut cursor = Cursor::new(bytes, SectionKind::Header);
        if cursor.record() != Ok(&MAGIC) {
            return Err(DecodeError::NotABundle);
        }
        let [found, len] = Fields::new(cursor.record::<4>()?).u16s();
        if found != VERSION {
            return Err(DecodeError::UnsupportedVersion { found, supported: VERSION });
        }
        let [least, most] = [MIN_SECTIONS, u8::MAX].map(|n| header_len(n) as u32);
        in_range(Field::HeaderLen, len.into(), least, most)?;
        let checked_len = usize::from(len).saturating_sub(4);
        let mut whole = Cursor::new(bytes, SectionKind::Header);
        let computed = crc32(whole.bytes(checked_len)?);
        let stored = Fields::new(whole.record::<4>()?).u32();
        if stored != computed {
            return Err(DecodeError::SectionChecksum { section: SectionKind::Header, stored, computed });
        }
        let (header, n_sections) = Self::parse_fields(cursor.record()?, len)?;
        let expected = header_len(n_sections) as u32;
        in_range(Field::HeaderLen, len.into(), expected, expected)?;
        let (table, _) = cursor.bytes(usize::from(n_sections).saturating_mul(SECTION_LEN))?.as_chunks();
        Ok((header, table))
    }

    /// The header's bytes, its section table and checksum included: the reverse of `parse`.
    ///
    /// * `sections`: the rows of the table; [`header_len`](Self::header_len) and [`file_len`](Self::file_len) are the caller's to
    ///   keep true to them.
    pub fn emit<S: Iterator<Item = Section> + Clone>(&self, sections: S) -> impl Iterator<Item = u8> + use<S> {
        // A table of 255 rows is the longest.
        let n_sections = sections.clone().count() as u8;
        let rows = sections.flat_map(|section| section.emit());
        let checked = self.emit_fields(n_sections).into_iter().chain(rows);
        let crc = crc32_of(checked.clone());
        checked.chain(crc.to_le_bytes())
    }

    fn emit_fields(&self, n_sections: u8) -> [u8; HEADER_FIXED_LEN] {
        let mut out = Emitter::new();
        out.bytes(MAGIC);
        out.u16s([VERSION, self.header_len]);
        // No optional features yet.
        out.u32s([self.file_len, self.features.to_bits(), 0]);
        out.u16s([self.feature_dim, self.n_offsets]);
        out.u32s([self.n_anchors, self.n_chunks]);
        out.u16s([self.max_chunk_anchors]);
        out.bytes([CONVENTION_OPENCV, n_sections]);
        out.u16s(self.training_px);
        out.bytes(self.background);
        out.bytes([self.n_tiers]);
        out.f32s([self.voxel_size]);
        out.u16s([self.colour_hidden, self.detail_hidden]);
        out.f64s(self.normalisation_centre);
        out.f64s([self.normalisation_scale]);
        let Camera { rotation, translation, focal_px, principal_px, width_px, height_px } = self.preview;
        out.f32s(rotation.to_array());
        out.f32s(translation);
        out.f32s(focal_px);
        out.f32s(principal_px);
        out.u16s([width_px, height_px]);
        out.bytes(self.symbol_bits);
        out.bytes([0]);
        out.finish()
    }

    fn parse_fields(record: &[u8; HEADER_FIELDS_LEN], header_len: u16) -> Result<(Self, u8), DecodeError> {
        let mut fields = Fields::new(record);
        let [file_len, features, _optional_features] = fields.u32s();
        let features = Features::from_bits(features)?;
        let [feature_dim, n_offsets] = fields.u16s();
        let [n_anchors, n_chunks] = fields.u32s();
        let max_chunk_anchors = fields.u16();
        let [convention, n_sections] = fields.bytes();
        let training_px = fields.u16s();
        let background = fields.bytes();
        let [n_tiers] = fields.bytes();
        let voxel_size = fields.f32();
        let [colour_hidden, detail_hidden] = fields.u16s();
        let normalisation_centre = fields.f64s();
        let [normalisation_scale] = fields.f64s();
        let (rotation, translation) = (Rotation::new_unchecked(fields.f32s()), fields.f32s());
        let (focal_px, principal_px) = (fields.f32s(), fields.f32s());
        let [width_px, height_px] = fields.u16s();
        let preview = Camera { rotation, translation, focal_px, principal_px, width_px, height_px };
        let [feature_bits, log_scale_bits, offset_bits, reserved] = fields.bytes();
        in_range(Field::CameraConvention, convention.into(), 0, CONVENTION_OPENCV.into())?;
        in_range(Field::NSections, n_sections.into(), MIN_SECTIONS.into(), u8::MAX.into())?;
        in_range(Field::Reserved, reserved.into(), 0, 0)?;
        let header = Self {
            header_len,
            file_len,
            features,
            feature_dim,
            n_offsets,
            n_anchors,
            n_chunks,
            max_chunk_anchors,
            n_tiers,
            training_px,
            background,
            voxel_size,
            colour_hidden,
            detail_hidden,
            symbol_bits: [feature_bits, log_scale_bits, offset_bits],
            normalisation_centre,
            normalisation_scale,
            preview,
        };
        header.check()?;
        Ok((header, n_sections))
    }

    /// The limits of the fields, each for itself.
    pub(super) fn check(&self) -> Result<(), DecodeError> {
        let Self { feature_dim, n_offsets, n_anchors, n_chunks, max_chunk_anchors, n_tiers, .. } = *self;
        let Self { training_px, background, voxel_size, colour_hidden, detail_hidden, symbol_bits, .. } = *self;
        let Self { features, normalisation_centre, normalisation_scale, ref preview, .. } = *self;
        in_range(Field::FeatureDim, feature_dim.into(), 1, MAX_FEATURE_DIM.into())?;
        in_range(Field::NOffsets, n_offsets.into(), 1, MAX_OFFSETS.into())?;
        in_range(Field::NAnchors, n_anchors, 0, MAX_ANCHORS)?;
        in_range(Field::NChunks, n_chunks, 0, n_anchors)?;
        in_range(Field::MaxChunkAnchors, max_chunk_anchors.into(), 1, MAX_CHUNK_ANCHORS.into())?;
        in_range(Field::NTiers, n_tiers.into(), 1, MAX_TIERS.into())?;
        in_range(Field::ColourHidden, colour_hidden.into(), 1, MAX_FEATURE_DIM.into())?;
        let [least, most] = if features.effects.detail { [1, MAX_FEATURE_DIM.into()] } else { [0, 0] };
        in_range(Field::DetailHidden, detail_hidden.into(), least, most)?;
        for bits in symbol_bits {
            in_range(Field::SymbolBits, bits.into(), 1, 16)?;
        }
        for channel in background {
            in_range(Field::Background, channel.into(), 0, if features.effects.background { 255 } else { 0 })?;
        }
        for size_px in training_px {
            in_range(Field::TrainingSize, size_px.into(), 1, u32::from(u16::MAX))?;
        }
        if !(voxel_size > 0.0 && voxel_size < VOXEL_SIZE_END) {
            return Err(DecodeError::BadFloat { field: Field::VoxelSize, index: 0 });
        }
        let scale_is_sound = normalisation_scale.is_finite() && normalisation_scale > 0.0;
        let [x, y, z] = normalisation_centre.map(f64::is_finite);
        if let Some(index) = [x, y, z, scale_is_sound].iter().position(|sound| !sound) {
            return Err(DecodeError::BadFloat { field: Field::Normalisation, index: saturate(index) });
        }
        if let Some(index) = preview.first_unusable() {
            return Err(DecodeError::BadFloat { field: Field::PreviewCamera, index });
        }
        in_range(Field::PreviewCamera, preview.width_px.min(preview.height_px).into(), 1, u32::MAX)?;
        in_range(Field::PreviewRotation, preview.rotation.off(), 0, MOST_OFF)
    }
}

/// Log-scales of an anchor.
pub const fn n_log_scales(anisotropic: bool) -> u16 {
    if anisotropic { 6 } else { 4 }
}

/// Outputs of the covariance head for an offset: three scale logits and a quaternion, or one scale logit.
pub const fn covariance_outputs(anisotropic: bool) -> u16 {
    if anisotropic { 7 } else { 1 }
}
