//! A bundle put together number by number.
//!
//! The trainer's writer makes only what a training ends in; a draft makes everything that the format allows, and with
//! [`assembled`] what it does not.

use pocketsplat_core::{Bundle, Camera, SectionKind, count_gaussians, count_scratch_len};
use pocketsplat_format::bundle::{
    ChunkRecord, Effects, Features, Header, InkFrame, PROTOCOL_CODE, Section, SectionBytes, Tier, TierMeasures, crc32,
    header_len,
};
use pocketsplat_format::context::{Context, N_GROUPS};
use pocketsplat_format::entropy::{FREQUENCY_TOTAL, MaskModel, N_MASK_CONTEXTS};

use super::heads::{HeadDraft, Widths, coded_section, plain_section};
use super::ink::{self, InkBox};
use super::models::{Anchor, TableDraft, tables_section, walk};
use super::numbers::Numbers;
use super::stream::{Slots, frequencies, words};
use super::{heads, positions};

/// What codes the channels.
#[derive(Clone, Debug, PartialEq)]
pub enum CoderDraft {
    /// Tables, and which channel has which.
    Tables(Vec<TableDraft>, Vec<u16>),
    /// The context section.
    Context(Vec<u8>),
}

/// How heads are stored.
#[derive(Clone, Debug, PartialEq)]
pub enum HeadCoding {
    /// As halves.
    Plain,
    /// With tables of their own statistics.
    Counted,
    /// With these.
    Tables([TableDraft; 2]),
}

/// What a stream says instead of the usual slots of a symbol, by index of the anchor in the file and channel.
pub type Recode = fn(anchor: usize, channel: usize, usual: Vec<Slots>) -> Vec<Slots>;

/// A bundle that is no file yet.
#[derive(Clone, Debug)]
pub struct Draft {
    /// What heads and drawing take into account.
    pub effects: Effects,
    /// Whether there is a section of masks.
    pub masks: bool,
    /// Widths of the heads.
    pub widths: Widths,
    /// The heads.
    pub heads: Vec<HeadDraft>,
    /// How they are stored.
    pub head_coding: HeadCoding,
    /// The cell of code 0 and the bits of a cell's coordinate; those that the anchors need where none are given.
    pub lattice: Option<([i32; 3], u8)>,
    /// `[tier][chunk][anchor]`; anchors of a chunk are brought into file order.
    pub tiers: Vec<Vec<Vec<Anchor>>>,
    /// What codes the channels.
    pub coder: CoderDraft,
    /// What streams say instead of the usual.
    pub recode: Option<Recode>,
    /// What is done to the words of each chunk, so that a reader must refuse them.
    pub edit_chunk: Option<fn(chunk: usize, words: &mut Vec<u8>)>,
    /// No chunk has more.
    pub max_chunk_anchors: u16,
    /// Bits of symbols; those that are needed where none are given.
    pub symbol_bits: Option<[u8; N_GROUPS]>,
    /// Edge of a cell.
    pub voxel_size: f32,
    /// Behind the scene.
    pub background: [u8; 3],
    /// The preview.
    pub preview: Camera,
    /// Size of the training images.
    pub training_px: [u16; 2],
    /// Centre and scale of the normalisation.
    pub normalisation: ([f64; 3], f64),
    /// What the manifest says of each tier; nothing where empty.
    pub measures: Vec<TierMeasures>,
    /// Whether there is a section gaussians.
    pub gaussians: bool,
    /// The section protocol.
    pub protocol: Option<Vec<u8>>,
    /// Sections of other kinds: before which of the other sections they stand, their kind and bytes.
    pub unknown: Vec<(usize, u8, Vec<u8>)>,
    /// Bits without a meaning yet.
    pub optional_features: u32,
}

/// Groups of a channel: 0 features, 1 log-scales, 2 offsets.
pub fn group_of(widths: Widths, effects: Effects, channel: usize) -> usize {
    let n_scalars = widths.features + n_log_scales(effects);
    usize::from(channel >= widths.features) + usize::from(channel >= n_scalars)
}

/// S.
pub fn n_log_scales(effects: Effects) -> usize {
    if effects.anisotropic { 6 } else { 4 }
}

/// C.
pub fn n_channels(widths: Widths, effects: Effects) -> usize {
    widths.features + n_log_scales(effects) + 3 * widths.offsets
}

/// Whether a channel is coded of an anchor with these drawn offsets.
pub fn is_coded(widths: Widths, effects: Effects, channel: usize, drawn: u32) -> bool {
    let n_scalars = widths.features + n_log_scales(effects);
    channel.checked_sub(n_scalars).is_none_or(|coordinate| drawn >> (coordinate / 3) & 1 == 1)
}

impl Draft {
    /// A draft of these anchors, everything else as usual: plain heads of random weights, tables of the symbols' statistics with
    /// steps of a sixteenth, an eighth and a sixteenth, no masks and the smallest lattice.
    pub fn of(effects: Effects, widths: Widths, tiers: Vec<Vec<Vec<Anchor>>>, preview: Camera, seed: u64) -> Self {
        let mut draft = Self {
            effects,
            masks: false,
            widths,
            heads: heads::random(widths, effects, &mut Numbers::of(seed)),
            head_coding: HeadCoding::Plain,
            lattice: None,
            max_chunk_anchors: tiers.iter().flatten().map(Vec::len).max().unwrap_or(1).max(1) as u16,
            tiers,
            coder: CoderDraft::Tables(Vec::new(), Vec::new()),
            recode: None,
            edit_chunk: None,
            symbol_bits: None,
            voxel_size: 1.0 / 64.0,
            background: if effects.background { [13, 77, 200] } else { [0; 3] },
            training_px: [preview.width_px, preview.height_px],
            preview,
            normalisation: ([0.5, -0.25, 2.0], 0.75),
            measures: Vec::new(),
            gaussians: false,
            protocol: None,
            unknown: Vec::new(),
            optional_features: 0,
        };
        draft.count_tables([1.0 / 16.0, 1.0 / 8.0, 1.0 / 16.0]);
        draft
    }

    /// Codes the channels with one table a group, of the symbols' statistics.
    pub fn count_tables(&mut self, steps: [f32; N_GROUPS]) {
        let symbols = |group: usize| {
            let mut found = self.symbols_of_group(group);
            found.sort_unstable();
            // Without anchors any table will do.
            if found.is_empty() { vec![0] } else { found }
        };
        let table = |group: usize| {
            let symbols = symbols(group);
            TableDraft::counting(steps[group], [symbols[0], symbols[symbols.len() - 1]], symbols.into_iter())
        };
        let of_channel = (0..self.n_channels()).map(|c| group_of(self.widths, self.effects, c) as u16);
        self.coder = CoderDraft::Tables((0..N_GROUPS).map(table).collect(), of_channel.collect());
    }

    fn symbols_of_group(&self, group: usize) -> Vec<i16> {
        let (widths, effects) = (self.widths, self.effects);
        let anchors = self.tiers.iter().flatten().flatten();
        anchors
            .flat_map(|anchor| anchor.symbols.iter().enumerate().map(move |(c, &symbol)| (c, symbol, anchor.drawn)))
            .filter(|&(c, _, drawn)| is_coded(widths, effects, c, drawn) && group_of(widths, effects, c) == group)
            .map(|(_, symbol, _)| symbol)
            .collect()
    }

    /// C.
    pub fn n_channels(&self) -> usize {
        n_channels(self.widths, self.effects)
    }

    fn features(&self) -> Features {
        Features {
            effects: self.effects,
            masks: self.masks,
            context: matches!(self.coder, CoderDraft::Context(_)),
            coded_heads: self.head_coding != HeadCoding::Plain,
        }
    }

    /// The lattice that is given, or the smallest one.
    fn lattice(&self) -> ([i32; 3], u8) {
        let along = |axis: usize| self.tiers.iter().flatten().flatten().map(move |anchor| anchor.cell[axis]);
        let min: [i32; 3] = std::array::from_fn(|axis| along(axis).min().unwrap_or(0));
        let span = (0..3).filter_map(|axis| along(axis).max().map(|most| most.abs_diff(min[axis]))).max();
        self.lattice.unwrap_or((min, (u32::BITS - span.unwrap_or(0).leading_zeros()) as u8))
    }

    /// Brings the anchors of each chunk into the order of their codes.
    fn sort(&mut self) {
        let (min, bits) = self.lattice();
        for anchors in self.tiers.iter_mut().flatten() {
            anchors.sort_by_key(|anchor| positions::code(min, bits, anchor.cell));
        }
    }

    /// Its anchors in file order.
    pub fn anchors(mut self) -> Vec<Anchor> {
        self.sort();
        self.tiers.concat().concat()
    }

    /// The header, whose lengths are not filled in, and the sections in order, each its kind and bytes.
    pub fn parts(mut self) -> (Header, Vec<(u8, Vec<u8>)>) {
        self.sort();
        self.sections()
    }

    /// Its file with one section edited.
    pub fn with_section(self, kind: u8, edit: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
        let (header, mut sections) = self.parts();
        let (_, bytes) = sections.iter_mut().find(|section| section.0 == kind).expect("a section of this kind");
        edit(bytes);
        assembled(&header, &sections)
    }

    /// Its file.
    pub fn file(mut self) -> Vec<u8> {
        self.sort();
        let (header, sections) = self.sections();
        let mut bytes = assembled(&header, &sections);
        if self.optional_features != 0 {
            bytes[20..24].copy_from_slice(&self.optional_features.to_le_bytes());
            crate::seal::reseal(&mut bytes);
        }
        bytes
    }

    /// The header, whose lengths are not filled in, and the sections in order.
    fn sections(&self) -> (Header, Vec<(u8, Vec<u8>)>) {
        let chunks: Vec<&Vec<Anchor>> = self.tiers.iter().flatten().collect();
        let (min, bits) = self.lattice();
        let codes: Vec<Vec<u64>> = chunks
            .iter()
            .map(|anchors| anchors.iter().map(|anchor| positions::code(min, bits, anchor.cell)).collect())
            .collect();
        let levels = positions::count(&codes, 3 * usize::from(bits));
        let masks = self.mask_frequencies();
        let mut first = 0;
        let (mut coded, mut boxes) = (Vec::new(), Vec::new());
        for (anchors, codes) in chunks.iter().zip(&codes) {
            let (channels, steps) = self.channel_slots(anchors, first);
            let mut slots = Vec::new();
            for (at, (anchor, channels)) in anchors.iter().zip(channels).enumerate() {
                slots.extend(positions::slots(&levels, codes, at));
                if let Some(masks) = &masks {
                    slots.extend(mask_slots(masks, anchor.drawn));
                }
                slots.extend(channels);
            }
            let mut chunk = words(&slots);
            if let Some(edit) = self.edit_chunk {
                edit(coded.len(), &mut chunk);
            }
            coded.push(chunk);
            boxes.push(InkBox::of(
                self.voxel_size,
                [self.widths.features, n_log_scales(self.effects)],
                anchors,
                &steps,
            ));
            first += anchors.len();
        }
        let directory = self.directory(&coded, &boxes);
        let mut chunk_bytes = Vec::new();
        for chunk in &coded {
            chunk_bytes.extend(chunk);
            chunk_bytes.resize(padded(chunk_bytes.len()), 0);
        }
        let coder = match &self.coder {
            CoderDraft::Tables(tables, of_channel) => (4, tables_section(tables, of_channel)),
            CoderDraft::Context(section) => (5, section.clone()),
        };
        let heads = match &self.head_coding {
            HeadCoding::Plain => plain_section(&self.heads),
            HeadCoding::Counted => coded_section(&self.heads, None),
            HeadCoding::Tables(tables) => coded_section(&self.heads, Some(tables.clone())),
        };
        let mask_bytes = masks.as_ref().map(|masks| {
            let offsets: Vec<_> = masks.iter().map(|contexts| contexts.map(u16::to_le_bytes)).collect();
            (3, MaskModel::new(&offsets).emit().collect())
        });
        let mut measures = self.measures.clone();
        measures.resize(self.tiers.len(), TierMeasures::default());
        let mut sections: Vec<(u8, Vec<u8>)> = vec![(1, heads), (2, positions::section(min, bits, &levels))];
        sections.extend(mask_bytes);
        sections.extend([coder, (6, measures.iter().flat_map(TierMeasures::emit).collect()), (7, directory)]);
        sections.push((8, chunk_bytes));
        let header = self.header();
        if self.gaussians {
            let counts = gaussian_counts(header, &sections);
            sections.insert(sections.len() - 1, (128, counts));
        }
        if let Some(protocol) = &self.protocol {
            sections.insert(sections.len() - 1, (PROTOCOL_CODE, protocol.clone()));
        }
        for (at, kind, bytes) in self.unknown.iter().rev() {
            sections.insert(*at, (*kind, bytes.clone()));
        }
        (header, sections)
    }

    fn header(&self) -> Header {
        let n = |count: usize| count as u32;
        let bits = |group: usize| {
            let magnitudes = self.symbols_of_group(group).into_iter().map(|x| if x < 0 { !x } else { x });
            magnitudes.map(|x| 17 - x.leading_zeros() as u8).max().unwrap_or(1)
        };
        Header {
            header_len: 0,
            file_len: 0,
            features: self.features(),
            feature_dim: self.widths.features as u16,
            n_offsets: self.widths.offsets as u16,
            n_anchors: n(self.tiers.iter().flatten().map(Vec::len).sum()),
            n_chunks: n(self.tiers.iter().map(Vec::len).sum()),
            max_chunk_anchors: self.max_chunk_anchors,
            n_tiers: self.tiers.len() as u8,
            training_px: self.training_px,
            background: self.background,
            voxel_size: self.voxel_size,
            colour_hidden: self.widths.colour_hidden as u16,
            detail_hidden: self.widths.detail_hidden as u16,
            symbol_bits: self.symbol_bits.unwrap_or_else(|| std::array::from_fn(bits)),
            normalisation_centre: self.normalisation.0,
            normalisation_scale: self.normalisation.1,
            preview: self.preview,
        }
    }

    /// For each offset and context the frequency of "drawn".
    fn mask_frequencies(&self) -> Option<Vec<[u16; N_MASK_CONTEXTS]>> {
        let mut counts = vec![[[0_u32; 2]; N_MASK_CONTEXTS]; self.widths.offsets];
        for anchor in self.tiers.iter().flatten().flatten() {
            for (k, context, is_drawn) in mask_contexts(anchor.drawn, self.widths.offsets) {
                counts[k][context][usize::from(!is_drawn)] += 1;
            }
        }
        // Both stay possible.
        let drawn = |counts: [u32; 2]| match frequencies(&counts, FREQUENCY_TOTAL)[0] {
            _ if counts == [0; 2] => FREQUENCY_TOTAL / 2,
            drawn => drawn.clamp(1, FREQUENCY_TOTAL - 1),
        };
        self.masks.then(|| counts.into_iter().map(|contexts| contexts.map(drawn)).collect())
    }

    /// The slots of the channels of each anchor of a chunk, and its steps.
    ///
    /// * `first`: index of the first of them in the file.
    fn channel_slots(&self, anchors: &[Anchor], first: usize) -> (Vec<Vec<Slots>>, Vec<[f32; N_GROUPS]>) {
        let is_coded = |channel: usize, drawn: u32| is_coded(self.widths, self.effects, channel, drawn);
        let recoded = |at: usize, channel: usize, slots: Vec<Slots>| match self.recode {
            Some(recode) => recode(first + at, channel, slots),
            None => slots,
        };
        match &self.coder {
            CoderDraft::Tables(tables, of_channel) => {
                let of = |channel: usize| &tables[usize::from(of_channel[channel])];
                let slots = anchors.iter().enumerate().map(|(at, anchor)| {
                    let coded = anchor.symbols.iter().enumerate().filter(|(c, _)| is_coded(*c, anchor.drawn));
                    coded.flat_map(|(c, &symbol)| recoded(at, c, of(c).slots(symbol))).collect()
                });
                let step = |group: usize| {
                    let channel = (0..self.n_channels()).find(|&c| group_of(self.widths, self.effects, c) == group);
                    channel.map_or(1.0, |channel| of(channel).step)
                };
                (slots.collect(), vec![std::array::from_fn(step); anchors.len()])
            }
            CoderDraft::Context(section) => {
                let n_log_scales = n_log_scales(self.effects);
                let context = Context::parse(section, self.widths.features, n_log_scales, self.n_channels());
                let coded = walk(&context.expect("a sound context"), anchors, is_coded);
                let slots = coded.iter().enumerate().map(|(at, anchor)| {
                    anchor.channels.iter().flat_map(|c| recoded(at, c.channel, c.slots.clone())).collect()
                });
                (slots.collect(), coded.iter().map(|anchor| anchor.steps).collect())
            }
        }
    }

    fn directory(&self, chunks: &[Vec<u8>], boxes: &[InkBox]) -> Vec<u8> {
        let (mut bytes, mut up_to) = (Vec::new(), Tier::default());
        let mut rest = chunks.iter();
        for tier in &self.tiers {
            up_to.n_chunks += tier.len() as u32;
            up_to.n_anchors += tier.iter().map(|anchors| anchors.len() as u32).sum::<u32>();
            up_to.end += rest.by_ref().take(tier.len()).map(|chunk| padded(chunk.len()) as u32).sum::<u32>();
            bytes.extend(up_to.emit());
        }
        let frame: InkFrame = ink::frame_around(boxes);
        bytes.extend(frame.emit());
        for ((anchors, chunk), ink) in self.tiers.iter().flatten().zip(chunks).zip(boxes) {
            let [low, high] = ink::quantised(ink, &frame);
            let (len, n_anchors) = (chunk.len() as u32, anchors.len() as u16);
            bytes.extend(ChunkRecord { len, crc: crc32(chunk), n_anchors, low, high }.emit());
        }
        bytes
    }
}

/// Which offsets are drawn, each with its context.
fn mask_contexts(drawn: u32, n_offsets: usize) -> impl Iterator<Item = (usize, usize, bool)> {
    (0..n_offsets).map(move |k| {
        let before = (drawn & ((1_u64 << k) - 1) as u32).count_ones() as usize;
        (k, before.min(N_MASK_CONTEXTS - 1), drawn >> k & 1 == 1)
    })
}

fn mask_slots(masks: &[[u16; N_MASK_CONTEXTS]], drawn: u32) -> impl Iterator<Item = Slots> {
    mask_contexts(drawn, masks.len()).map(|(k, context, is_drawn)| {
        let end = masks[k][context];
        if is_drawn { (0, end) } else { (end, FREQUENCY_TOTAL - end) }
    })
}

/// The section gaussians: what a decoder makes of the scene.
fn gaussian_counts(header: Header, sections: &[(u8, Vec<u8>)]) -> Vec<u8> {
    let of = |kind: u8| sections.iter().find(|section| section.0 == kind).map(|section| section.1.as_slice());
    let parts = SectionBytes {
        heads: of(1).unwrap_or_default(),
        lattice: of(2).unwrap_or_default(),
        masks: of(3),
        coder: of(4).or(of(5)).unwrap_or_default(),
        manifest: of(6).unwrap_or_default(),
        directory: of(7).unwrap_or_default(),
        gaussians: None,
        protocol: None,
        chunks: of(8).unwrap_or_default(),
    };
    let bundle = Bundle::of_sections(header, &parts).expect("a sound draft");
    let counts = count_gaussians(&bundle, &mut vec![0; count_scratch_len(&bundle)]).expect("sound chunks");
    counts.iter().take(header.n_tiers.into()).flat_map(|count| count.to_le_bytes()).collect()
}

/// The kind of a number of the section table.
fn kind_of(code: u8) -> SectionKind {
    use SectionKind::{Chunks, Context, Directory, Gaussians, Heads, Lattice, Manifest, Masks, Other, Tables};
    let known = [Heads, Lattice, Masks, Tables, Context, Manifest, Directory, Chunks, Gaussians];
    let code_of = |kind: &SectionKind| Section { kind: *kind, offset: 0, len: 0, crc: 0 }.code();
    known.into_iter().find(|kind| code_of(kind) == code).unwrap_or(Other(code))
}

/// The next multiple of four: where the next section or chunk begins.
fn padded(end: usize) -> usize {
    end.next_multiple_of(4)
}

/// A file of any sections in any order, each at the next multiple of four behind the one before.
pub fn assembled(header: &Header, sections: &[(u8, Vec<u8>)]) -> Vec<u8> {
    let header_len = header_len(sections.len() as u8);
    let mut end = header_len as u32;
    let rows: Vec<Section> = sections
        .iter()
        .map(|(code, bytes)| {
            let (offset, kind) = (end, kind_of(*code));
            end = padded((end as usize) + bytes.len()) as u32;
            let crc = if kind == SectionKind::Chunks { 0 } else { crc32(bytes) };
            Section { kind, offset, len: bytes.len() as u32, crc }
        })
        .collect();
    let header = Header { header_len: header_len as u16, file_len: end, ..*header };
    let mut file: Vec<u8> = header.emit(rows.iter().copied()).collect();
    for (_, bytes) in sections {
        file.extend(bytes);
        file.resize(padded(file.len()), 0);
    }
    file
}
