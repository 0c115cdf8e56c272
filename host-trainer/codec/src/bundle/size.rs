//! Where the bytes of a bundle went.

use pocketsplat_format::bundle::ALIGNMENT;
use pocketsplat_format::{Bundle, DecodeError, SectionKind};

use super::PartBits;
use super::chunk::{ChunkRows, Models};
use super::decoded::for_each_chunk;

/// Bytes of a bundle by what they hold; all of them together are the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct SizeReport {
    /// Anchors of the scene.
    pub n_anchors: usize,
    /// Offsets that are drawn.
    pub n_drawn_offsets: usize,
    /// The whole file, up to the last tier that it has.
    pub total: usize,
    /// Header with the section table.
    pub header: usize,
    /// Weights of the heads.
    pub heads: usize,
    /// Frame and frequencies of the lattice trie.
    pub lattice_model: usize,
    /// Frequencies of the masks.
    pub mask_model: usize,
    /// Static tables.
    pub tables: usize,
    /// Network and levels of the context model.
    pub context_weights: usize,
    /// Signs of the context model's grid.
    pub grid: usize,
    /// Measures of the tiers.
    pub manifest: usize,
    /// Ends of the tiers, records of the chunks.
    pub directory: usize,
    /// Sections that say nothing about the scene: the protocol, and what this version does not know.
    pub other: usize,
    /// Zeros between sections and between chunks.
    pub padding: usize,
    /// ANS streams: what the models leave of positions, masks and channels.
    pub streams: usize,
    /// Bits of the streams by the models' own frequencies, before ANS rounds each of them to words.
    pub ideal: PartBits,
}

/// One line of the account.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SizePart {
    /// What it is.
    pub name: &'static str,
    /// Its bytes; those of the streams' parts are the ideal ones, and [`SizeReport::states`] what comes on top.
    pub bytes: f64,
    /// The same over the anchors of the scene.
    pub bits_per_anchor: f64,
    /// It belongs to the container: no anchor's data, but what makes them a file.
    pub container: bool,
}

impl SizeReport {
    /// Adds up the parts of `bundle`; decodes all of it, and codes it again in mind.
    ///
    /// # Errors
    /// [`DecodeError`] naming a damaged chunk.
    pub fn of(bundle: &Bundle<'_>) -> Result<Self, DecodeError> {
        let mut report = Self {
            n_anchors: bundle.n_anchors() as usize,
            header: bundle.header().header_len.into(),
            ..Self::default()
        };
        for section in bundle.sections() {
            let part = match section.kind {
                SectionKind::Heads => &mut report.heads,
                SectionKind::Lattice => &mut report.lattice_model,
                SectionKind::Masks => &mut report.mask_model,
                SectionKind::Tables => &mut report.tables,
                SectionKind::Context => &mut report.context_weights,
                // What was measured, as the manifest.
                SectionKind::Manifest | SectionKind::Gaussians => &mut report.manifest,
                SectionKind::Directory => &mut report.directory,
                // Counted below, as far as it is there.
                SectionKind::Chunks => continue,
                _ => &mut report.other,
            };
            *part += section.len as usize;
            report.padding += n_padding(section.len as usize);
        }
        if let Some(context) = bundle.context() {
            let n_rows: usize = context.levels().map(|level| level.n_rows as usize).sum();
            report.grid = n_rows.div_ceil(2);
            report.context_weights -= report.grid;
        }
        report.add_chunks(bundle)?;
        report.total = report.fixed_bytes() + report.padding + report.streams;
        Ok(report)
    }

    fn add_chunks(&mut self, bundle: &Bundle<'_>) -> Result<(), DecodeError> {
        let coders = Models::of(bundle);
        for_each_chunk(bundle, |chunk, sites, symbols| {
            let lattice: Vec<[i32; 3]> = sites.iter().map(|site| site.lattice).collect();
            let drawn: Vec<u32> = sites.iter().map(|site| site.mask).collect();
            self.n_drawn_offsets += drawn.iter().map(|drawn| drawn.count_ones() as usize).sum::<usize>();
            self.streams += chunk.n_bytes();
            self.padding += n_padding(chunk.n_bytes());
            self.ideal += coders.slots(ChunkRows { lattice: &lattice, drawn: &drawn, symbols }).bits;
        })
    }

    fn fixed_bytes(&self) -> usize {
        let models = self.heads + self.lattice_model + self.mask_model + self.tables + self.context_weights + self.grid;
        self.header + models + self.manifest + self.directory + self.other
    }

    /// Bytes of the streams beyond their ideal length: the coder's states and its rounding.
    pub fn states(&self) -> f64 {
        self.streams as f64 - self.ideal.total() / 8.0
    }

    /// The account, line by line.
    pub fn parts(&self) -> Vec<SizePart> {
        let PartBits { positions, masks, features, log_scales, offsets } = self.ideal;
        let bytes = |n: usize| n as f64;
        [
            ("heads", bytes(self.heads), false),
            ("lattice model", bytes(self.lattice_model), false),
            ("positions", positions / 8.0, false),
            ("mask model", bytes(self.mask_model), false),
            ("masks", masks / 8.0, false),
            ("tables", bytes(self.tables), false),
            ("context weights", bytes(self.context_weights), false),
            ("grid", bytes(self.grid), false),
            ("features", features / 8.0, false),
            ("log-scales", log_scales / 8.0, false),
            ("offsets", offsets / 8.0, false),
            ("header", bytes(self.header), true),
            ("manifest", bytes(self.manifest), true),
            ("directory", bytes(self.directory), true),
            ("other sections", bytes(self.other), true),
            ("padding", bytes(self.padding), true),
            ("states", self.states(), true),
        ]
        .map(|(name, bytes, container)| {
            let bits_per_anchor = 8.0 * bytes / self.n_anchors.max(1) as f64;
            SizePart { name, bytes, bits_per_anchor, container }
        })
        .to_vec()
    }

    /// Bytes of the container: header, manifest, directory, unknown sections, padding, states.
    pub fn container(&self) -> f64 {
        self.parts().iter().filter(|part| part.container).map(|part| part.bytes).sum()
    }

    /// Bits an anchor that positions take with everything that finds them: model, directory, boxes.
    pub fn position_bits_per_anchor(&self) -> f64 {
        let bytes = self.ideal.positions / 8.0 + (self.lattice_model + self.directory) as f64;
        8.0 * bytes / self.n_anchors.max(1) as f64
    }
}

/// Zeros behind a section or a chunk of `len` bytes.
fn n_padding(len: usize) -> usize {
    len.next_multiple_of(ALIGNMENT as usize) - len
}
