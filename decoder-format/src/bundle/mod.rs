//! The view of a bundle's bytes: parsed and checked once, read in place ever after.
//!
//! [`Bundle::parse`] checks every offset, length, count, float and checksum but those of the chunks, so that nothing
//! after it can read outside the bytes. [`format`] (`FORMAT.md` beside this file) is the normative description, [`drawing`]
//! (`DRAWING.md`) that of the pixels that are made of it, [`levels`] (`MANIFEST.md`) of measures, profiles and levels. Beside each
//! `parse` stands the `emit` that a writer calls: the bytes that `parse` reads, as an array where their number is fixed, else as an
//! iterator, so that neither needs an allocator. The module knows nothing of rendering.
// Tests may index and add as they like; this is about bytes that nobody vouches for.
#![cfg_attr(not(test), deny(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::panic))]

#[doc = include_str!("FORMAT.md")]
pub mod format {}

#[doc = include_str!("DRAWING.md")]
pub mod drawing {}

#[doc = include_str!("MANIFEST.md")]
pub mod levels {}

mod anchor;
mod chunk;
mod cut;
mod directory;
mod features;
mod gaussians;
mod header;
mod heads;
mod lattice;
mod manifest;
mod masks;
mod model_cost;
mod section;
mod sections;
mod tables;

pub use crate::bytes::crc32;
pub use anchor::{
    AnchorModels, AnchorReader, AnchorRecords, AnchorSite, RecordLayout, RecordMemory, SuspendedReader, model_words,
};
pub use chunk::{Chunk, Chunks};
pub use cut::cut_after;
pub use directory::{CHUNK_RECORD_LEN, ChunkRecord, Directory, INK_FRAME_LEN, InkFrame, TIER_RECORD_LEN, Tier};
pub use features::{Effects, Features};
pub use header::{
    HEADER_FIXED_LEN, Header, MAGIC, MAX_ANCHORS, MAX_CHUNK_ANCHORS, MAX_FEATURE_DIM, MAX_OFFSETS, MAX_TIERS, VERSION,
    covariance_outputs, header_len, n_log_scales,
};
pub use heads::{CodedHeads, Halves, HeadView, HeadsView, LayerWeights, WeightReader};
pub use lattice::{Lattice, MAX_LATTICE_BITS, MAX_LATTICE_MIN};
pub use manifest::{MANIFEST_RECORD_LEN, MAX_LEVEL, STRIPS, TierMeasures};
pub use model_cost::ModelCost;
pub use section::{ALIGNMENT, PROTOCOL_CODE, SECTION_LEN, Section};
pub use sections::SectionBytes;
pub use tables::{FrequencyTable, Tables};

use crate::context::Context;
use crate::entropy::MaskModel;
use crate::error::{DecodeError, SectionKind, saturate};
use gaussians::GaussianCounts;

/// Where the models of the channels come from.
#[derive(Clone, Copy, Debug)]
pub enum Coder<'a> {
    /// From tables, the same for all anchors.
    Static(Tables<'a>),
    /// From what lies around each anchor.
    Context(Context<'a>),
}

/// A bundle in memory or flash, checked.
#[derive(Clone, Copy, Debug)]
pub struct Bundle<'a> {
    header: Header,
    section_table: &'a [[u8; SECTION_LEN]],
    heads: HeadsView<'a>,
    lattice: Lattice<'a>,
    masks: Option<MaskModel<'a>>,
    coder: Coder<'a>,
    manifest: &'a [[u8; MANIFEST_RECORD_LEN]],
    directory: Directory<'a>,
    gaussians: Option<GaussianCounts<'a>>,
    /// Tiers in the file.
    n_tiers: u8,
    /// The chunks of these tiers.
    chunks: &'a [u8],
}

impl<'a> Bundle<'a> {
    /// Checks `bytes` and returns the view of them; bytes after the bundle's end are ignored, so a whole flash partition
    /// can be passed. A file that ends where a tier ends, by its own end or by what the header says, is a smaller scene, of
    /// [`n_tiers`](Self::n_tiers) tiers.
    ///
    /// # Errors
    /// [`DecodeError`] of class malformed or unsupported, naming the section and the numbers that disagree.
    ///
    /// # Budget
    /// No scratch. Reads everything outside of the chunks once, coded heads twice; the chunks' checksums wait for
    /// `Decoder::bind`.
    // Not inlined: a caller's stack frame would keep what only parsing needs.
    #[inline(never)]
    pub fn parse(bytes: &'a [u8]) -> Result<Self, DecodeError> {
        let (header, section_table) = Header::parse(bytes)?;
        let (sections, chunks_len) = SectionBytes::parse(section_table, &header, bytes)?;
        Self::of_parts(header, section_table, &sections, chunks_len)
    }

    /// Checks sections that are in no file yet and returns the view of them, for a writer that measures a scene before it writes
    /// it; [`sections`](Self::sections) lists none.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    ///
    /// # Budget
    /// No scratch. Reads everything before the chunks once, coded heads twice.
    pub fn of_sections(header: Header, sections: &SectionBytes<'a>) -> Result<Self, DecodeError> {
        Features::from_bits(header.features.to_bits())?;
        header.check()?;
        Self::of_parts(header, &[], sections, saturate(sections.chunks.len()))
    }

    /// * `chunks_len`: length of the chunks section, of which the file may have less.
    fn of_parts(
        header: Header,
        section_table: &'a [[u8; SECTION_LEN]],
        sections: &SectionBytes<'a>,
        chunks_len: u32,
    ) -> Result<Self, DecodeError> {
        let heads = HeadsView::parse(sections.heads, &header)?;
        let lattice = Lattice::parse(sections.lattice)?;
        let masks = match sections.masks {
            Some(section) => Some(MaskModel::parse(section, header.n_offsets)?),
            None => None,
        };
        let coder = if cfg!(feature = "context") && header.features.context {
            Coder::Context(Context::parse(
                sections.coder,
                header.feature_dim.into(),
                header.n_log_scales().into(),
                header.n_channels(),
            )?)
        } else {
            Coder::Static(Tables::parse(sections.coder, header.n_channels())?)
        };
        let manifest = manifest::parse(sections.manifest, header.n_tiers)?;
        let directory = Directory::parse(sections.directory, &header, sections.chunks, chunks_len)?;
        let gaussians = match sections.gaussians {
            // Without the feature it is a section like any other that a decoder does not know.
            Some(section) if cfg!(feature = "baked") => Some(GaussianCounts::parse(section, &header, &directory)?),
            _ => None,
        };
        let (n_tiers, chunks) = tiers_in(sections.chunks, chunks_len, &directory, header.n_tiers)?;
        Ok(Self {
            header,
            section_table,
            heads,
            lattice,
            masks,
            coder,
            manifest,
            directory,
            gaussians,
            n_tiers,
            chunks,
        })
    }

    /// The scene-wide facts.
    #[must_use]
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The section table, those that this decoder skips included.
    pub fn sections(&self) -> impl Iterator<Item = Section> + Clone + use<'a> {
        self.section_table.iter().filter_map(|row| Section::parse(row).ok())
    }

    /// The weights of the heads.
    #[must_use]
    pub fn heads(&self) -> &HeadsView<'a> {
        &self.heads
    }

    /// The cells of the anchors and the model of their positions.
    #[must_use]
    pub fn lattice(&self) -> &Lattice<'a> {
        &self.lattice
    }

    /// The model of which offsets are drawn; without it all are.
    #[must_use]
    pub fn masks(&self) -> Option<&MaskModel<'a>> {
        self.masks.as_ref()
    }

    /// Where the models of the channels come from.
    #[must_use]
    pub fn coder(&self) -> &Coder<'a> {
        &self.coder
    }

    /// Quantisation and frequencies of the channels, unless they follow from a context.
    #[must_use]
    pub fn tables(&self) -> Option<&Tables<'a>> {
        match &self.coder {
            Coder::Static(tables) => Some(tables),
            Coder::Context(_) => None,
        }
    }

    /// The context model, unless the channels have tables.
    #[must_use]
    pub fn context(&self) -> Option<&Context<'a>> {
        match &self.coder {
            Coder::Static(_) => None,
            Coder::Context(context) => Some(context),
        }
    }

    /// What tier `tier` and those before it were measured to look like and to cost, whether they are in the file or not.
    #[must_use]
    pub fn measures(&self, tier: u8) -> Option<TierMeasures> {
        TierMeasures::parse(self.manifest.get(usize::from(tier))?, tier.into()).ok()
    }

    /// Tiers and chunk records.
    #[must_use]
    pub fn directory(&self) -> &Directory<'a> {
        &self.directory
    }

    /// Gaussians that the first `n_tiers` tiers consist of, those beyond the file's left out, if they are the same in every
    /// frame: the heads see neither direction nor distance of view, the bundle says how many they make, and the decoder is built
    /// with the feature `baked`.
    #[must_use]
    pub fn n_gaussians(&self, n_tiers: u8) -> Option<u32> {
        let sees_view = self.header.features.effects.see_view();
        let counts = self.gaussians.filter(|_| cfg!(feature = "baked") && !sees_view)?;
        Some(counts.up_to(n_tiers.min(self.n_tiers)))
    }

    /// Tiers in the file; fewer than [`Header::n_tiers`] when it was cut where a tier ends.
    #[must_use]
    pub fn n_tiers(&self) -> u8 {
        self.n_tiers
    }

    /// Tier number `tier`, whether it is in the file or not.
    #[must_use]
    pub fn tier(&self, tier: u8) -> Option<Tier> {
        self.directory.tier(tier)
    }

    /// Anchors in the file.
    #[must_use]
    pub fn n_anchors(&self) -> u32 {
        self.up_to_tier(self.n_tiers).n_anchors
    }

    /// Chunks in the file.
    #[must_use]
    pub fn n_chunks(&self) -> u32 {
        self.up_to_tier(self.n_tiers).n_chunks
    }

    /// What the first `n_tiers` tiers consist of, those beyond the file's left out.
    pub fn up_to_tier(&self, n_tiers: u8) -> Tier {
        let last = n_tiers.min(self.n_tiers).checked_sub(1);
        last.and_then(|last| self.tier(last)).unwrap_or_default()
    }

    /// Chunk number `index`.
    ///
    /// # Errors
    /// [`DecodeError::NoSuchChunk`] beyond the tiers in the file.
    ///
    /// # Budget
    /// Adds up the lengths of all chunks before it.
    pub fn chunk(&self, index: u32) -> Result<Chunk<'a>, DecodeError> {
        let no_such = DecodeError::NoSuchChunk { chunk: index, n_chunks: self.n_chunks() };
        self.chunks().nth(index as usize).ok_or(no_such)
    }

    /// All chunks in the file, in order.
    pub fn chunks(&self) -> Chunks<'a> {
        Chunks { directory: self.directory, chunks: self.chunks, numbers: 0..self.n_chunks(), offset: 0 }
    }

    /// Position of a lattice cell, normalised frame.
    #[inline]
    #[must_use]
    pub fn position(&self, lattice: [i32; 3]) -> [f32; 3] {
        lattice.map(|cell| cell as f32 * self.header.voxel_size)
    }
}

/// How many tiers a file holds, and their chunks: all of them, or those up to a tier at whose end the file ends.
///
/// * `available`: the file from where its chunks begin up to where it ends.
fn tiers_in<'a>(
    available: &'a [u8],
    chunks_len: u32,
    directory: &Directory<'_>,
    n_tiers: u8,
) -> Result<(u8, &'a [u8]), DecodeError> {
    for tier in (0..n_tiers).rev() {
        let end = directory.tier(tier).map(|tier| tier.end as usize);
        if end == Some(available.len()) {
            return Ok((tier.saturating_add(1), available));
        }
    }
    let available = saturate(available.len());
    Err(DecodeError::Truncated { section: SectionKind::Chunks, needed: chunks_len, available })
}

#[cfg(test)]
mod tests;
