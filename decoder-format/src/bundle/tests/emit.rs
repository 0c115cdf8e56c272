//! What is emitted parses to itself, and what was parsed is emitted byte by byte.

use std::vec;
use std::vec::Vec;

use super::builder::{LATTICE_MIN, Variant, bundle, variants};
use super::symbols;
use crate::bundle::{
    Bundle, ChunkRecord, Coder, Effects, Features, FrequencyTable, Header, InkFrame, Lattice, SECTION_LEN, STRIPS,
    Section, SectionBytes, Tables, Tier, TierMeasures, header_len, manifest,
};
use crate::camera::{Camera, Rotation};
use crate::context::{Context, ContextHead};
use crate::entropy::TrieModel;
use crate::error::{DecodeError, SectionKind};

/// Random bits, and now and then all of them or none.
struct Bits(u64);

impl Bits {
    fn u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        match self.0 >> 60 {
            0 => 0,
            1 => u64::MAX,
            _ => self.0.rotate_right(7),
        }
    }

    fn u32(&mut self) -> u32 {
        self.u64() as u32
    }

    fn u16(&mut self) -> u16 {
        self.u64() as u16
    }

    /// A finite number of any magnitude.
    fn f32(&mut self) -> f32 {
        let x = f32::from_bits(self.u32());
        if x.is_finite() { x } else { f32::MAX.copysign(x) }
    }

    fn u16s<const N: usize>(&mut self) -> [u16; N] {
        std::array::from_fn(|_| self.u16())
    }

    fn u32s<const N: usize>(&mut self) -> [u32; N] {
        std::array::from_fn(|_| self.u32())
    }

    fn f32s<const N: usize>(&mut self) -> [f32; N] {
        std::array::from_fn(|_| self.f32())
    }

    /// A number from 1 to `most`, often one of both.
    fn up_to(&mut self, most: u32) -> u32 {
        match self.u64() {
            0 => 1,
            u64::MAX => most,
            bits => 1 + bits as u32 % most,
        }
    }
}

fn section(bytes: &[u8], kind: SectionKind) -> &[u8] {
    let bundle = Bundle::parse(bytes).expect("sound");
    let section = bundle.sections().find(|section| section.kind == kind).expect("the bundle has one");
    &bytes[section.offset as usize..][..section.len as usize]
}

#[test]
fn sections_are_a_bundle_before_there_is_a_file_and_then_are_that_file() {
    for variant in variants().filter(|variant| !variant.unknown_section) {
        let bytes = bundle(variant);
        let file = Bundle::parse(&bytes).expect("sound");
        let sections = SectionBytes {
            heads: section(&bytes, SectionKind::Heads),
            lattice: section(&bytes, SectionKind::Lattice),
            masks: variant.masks.then(|| section(&bytes, SectionKind::Masks)),
            coder: section(&bytes, if variant.context { SectionKind::Context } else { SectionKind::Tables }),
            manifest: section(&bytes, SectionKind::Manifest),
            directory: section(&bytes, SectionKind::Directory),
            gaussians: None,
            protocol: None,
            chunks: section(&bytes, SectionKind::Chunks),
        };
        let header = Header { header_len: 0, file_len: 0, ..*file.header() };
        let view = Bundle::of_sections(header, &sections).expect("sound");
        assert_eq!(symbols(&view), symbols(&file), "{variant:?}");
        assert_eq!(sections.file_len(), bytes.len(), "{variant:?}");
        let emitted: Vec<u8> = sections.emit(&header).collect();
        let header_len = usize::from(file.header().header_len);
        assert_eq!(emitted[header_len..], bytes[header_len..], "{variant:?}");
        assert_eq!(Bundle::parse(&emitted).expect("sound").header(), file.header(), "{variant:?}");
        let unsound = Header { n_offsets: 33, ..header };
        assert!(matches!(Bundle::of_sections(unsound, &sections), Err(DecodeError::OutOfRange { .. })), "33 offsets");
    }
}

fn random_header(bits: &mut Bits) -> Header {
    let built = Bundle::parse(&bundle(plain())).expect("sound").header().features.effects;
    let mut flag = || bits.u16() & 1 == 1;
    let features = Features {
        effects: Effects { detail: cfg!(feature = "detail") && flag(), ..built },
        masks: flag(),
        context: cfg!(feature = "context") && flag(),
        coded_heads: flag(),
    };
    let n_anchors = bits.up_to(1 << 24);
    let finite = |bits: &mut Bits| f64::from(bits.f32()) * 1e-60;
    Header {
        header_len: 0,
        file_len: bits.u32(),
        features,
        feature_dim: bits.up_to(256) as u16,
        n_offsets: bits.up_to(32) as u16,
        n_anchors,
        n_chunks: bits.up_to(n_anchors),
        max_chunk_anchors: bits.up_to(1024) as u16,
        n_tiers: bits.up_to(8) as u8,
        training_px: std::array::from_fn(|_| bits.up_to(65_535) as u16),
        background: if built.background { bits.u32s().map(|channel: u32| channel as u8) } else { [0; 3] },
        voxel_size: bits.f32().abs().clamp(f32::from_bits(1), 1e9_f32.next_down()),
        colour_hidden: bits.up_to(256) as u16,
        detail_hidden: if features.effects.detail { bits.up_to(256) as u16 } else { 0 },
        symbol_bits: std::array::from_fn(|_| bits.up_to(16) as u8),
        normalisation_centre: std::array::from_fn(|_| finite(bits)),
        normalisation_scale: finite(bits).abs() + f64::from_bits(1),
        preview: Camera {
            rotation: Rotation::new([1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0]).expect("a rotation"),
            translation: [0.5, -3.25, 7.0],
            focal_px: [bits.up_to(9999) as f32, 0.125],
            principal_px: [-4.5, bits.up_to(9999) as f32],
            width_px: bits.up_to(2048) as u16,
            height_px: bits.up_to(2048) as u16,
        },
    }
}

fn plain() -> Variant {
    variants().next().expect("some")
}

#[test]
fn a_header_and_its_sections_come_back() {
    let mut bits = Bits(1);
    for n_sections in (6..=255).chain([255; 50]) {
        let section = |bits: &mut Bits| {
            let [offset, len, crc] = bits.u32s();
            Section { kind: SectionKind::Other(129 + bits.u16() as u8 % 127), offset, len, crc }
        };
        let sections: Vec<Section> = (0..n_sections).map(|_| section(&mut bits)).collect();
        let header = Header { header_len: header_len(n_sections) as u16, ..random_header(&mut bits) };
        let bytes: Vec<u8> = header.emit(sections.iter().copied()).collect();
        assert_eq!(bytes.len(), header_len(n_sections), "{n_sections} sections");
        let (parsed, table) = Header::parse(&bytes).unwrap_or_else(|error| panic!("{header:?}: {error}"));
        assert_eq!(parsed, header, "{n_sections} sections");
        let rows: Vec<Section> = table.iter().map(|row| Section::parse(row).expect("a row")).collect();
        assert_eq!(rows, sections, "{n_sections} sections");
    }
}

#[test]
fn each_kind_of_section_has_one_number() {
    for code in 0..=255 {
        let mut row = [0; SECTION_LEN];
        row[0] = code;
        match Section::parse(&row) {
            Ok(section) => assert_eq!((section.code(), section.emit()), (code, row)),
            Err(_) => assert!(code == 0 || (9..128).contains(&code), "{code}"),
        }
    }
}

#[test]
fn records_come_back_whatever_they_say() {
    let mut bits = Bits(2);
    for _ in 0..1000 {
        let [n_chunks, n_anchors, end] = bits.u32s();
        let tier = Tier { n_chunks, n_anchors, end };
        assert_eq!(Tier::parse(&tier.emit()), tier);
        let [len, crc] = bits.u32s();
        let record = ChunkRecord { len, crc, n_anchors: bits.u16(), low: bits.u16s(), high: bits.u16s() };
        assert_eq!(ChunkRecord::parse(&record.emit()), (record, 0));
        let frame = InkFrame { min: bits.f32s(), step: bits.f32s() };
        assert_eq!(InkFrame::parse(&frame.emit()), frame);
        let psnr_db = bits.f32();
        let measures = TierMeasures {
            psnr_db: (bits.u16() & 3 > 0).then_some(psnr_db),
            n_views: bits.u16(),
            n_cameras: bits.u16(),
            max_visible_anchors: bits.u32(),
            max_splats: bits.u32(),
            max_strip_splats: bits.u32s(),
            max_strip_pairs: bits.u32s(),
            max_head_kilo_macs: bits.u32(),
            max_kilo_pixels: bits.u32(),
            max_decoded_anchors: bits.u32(),
            level: bits.up_to(5) as u8,
        };
        assert_eq!(TierMeasures::parse(&measures.emit(), 0), Ok(measures));
    }
}

#[test]
fn tables_come_back() {
    let halves: [Vec<[u8; 2]>; 3] = [vec![0, 4096], vec![0, 4095, 4096], (0..4096).chain([4096]).collect()]
        .map(|bounds: Vec<u16>| bounds.into_iter().map(u16::to_le_bytes).collect());
    let tables = [
        FrequencyTable::new(0.0, f32::MIN_POSITIVE, i16::MAX, &halves[0]),
        FrequencyTable::new(-1e17, 1.0, i16::MIN, &halves[1]),
        FrequencyTable::new(1e17, 1e12, -2048, &halves[2]),
    ];
    let channel_tables: Vec<u16> = (0..360).map(|channel| channel % 3).collect();
    for n_tables in 1..=3 {
        let channel_tables: Vec<u16> = channel_tables.iter().map(|table| table % n_tables).collect();
        let tables = &tables[..usize::from(n_tables)];
        let bytes: Vec<u8> = Tables::emit(tables, &channel_tables).collect();
        let parsed = Tables::parse(&bytes, 360).expect("sound tables");
        assert_eq!(parsed.len(), tables.len());
        for (index, table) in tables.iter().enumerate() {
            let found = parsed.get(index).expect("a table");
            assert_eq!([found.origin, found.step], [table.origin, table.step]);
            assert_eq!(found.min_symbol, table.min_symbol);
            assert!(found.bounds().eq(table.bounds()), "table {index}");
        }
        for (channel, &table) in channel_tables.iter().enumerate() {
            assert_eq!(parsed.table_of(channel), Some(table.into()), "channel {channel}");
        }
    }
}

#[test]
fn lattices_come_back() {
    let mut bits = Bits(4);
    for n_bits in 0..=21 {
        let node = |bits: &mut Bits| {
            let ends: [u16; 2] = bits.u16s().map(|end: u16| end % 4097);
            [ends[0].min(ends[1]), ends[0].max(ends[1])].map(u16::to_le_bytes)
        };
        let levels: Vec<_> = (0..3 * n_bits).map(|_| std::array::from_fn(|_| node(&mut bits))).collect();
        let min = [1 << 23, -(1 << 23), LATTICE_MIN[0]];
        let lattice = Lattice { min, bits: n_bits, trie: TrieModel::new(&levels) };
        let bytes: Vec<u8> = lattice.emit().collect();
        let parsed = Lattice::parse(&bytes).expect("a sound lattice");
        assert_eq!((parsed.min, parsed.bits, parsed.trie.levels()), (min, n_bits, &levels[..]));
    }
}

#[test]
fn a_bundle_is_emitted_as_it_was_parsed() {
    for variant in variants() {
        let bytes = bundle(variant);
        let bundle = Bundle::parse(&bytes).expect("sound");
        let header = bundle.header();
        let mut emitted: Vec<u8> = header.emit(bundle.sections()).collect();
        // Optional features are not kept; the checksum follows them.
        let checked_len = emitted.len() - 4;
        emitted[20..24].copy_from_slice(&bytes[20..24]);
        assert_eq!(emitted[..checked_len], bytes[..checked_len], "{variant:?}");
        assert_eq!(bundle.lattice().emit().collect::<Vec<u8>>(), section(&bytes, SectionKind::Lattice), "{variant:?}");
        if let Some(model) = bundle.masks() {
            let stored = section(&bytes, SectionKind::Masks);
            assert_eq!(model.emit().collect::<Vec<u8>>(), stored, "{variant:?}");
        }
        match bundle.coder() {
            Coder::Static(tables) => {
                let all: Vec<FrequencyTable<'_>> = (0..tables.len()).filter_map(|table| tables.get(table)).collect();
                let of_channel = (0..tables.n_channels()).filter_map(|channel| tables.table_of(channel));
                let of_channel: Vec<u16> = of_channel.map(|table| table as u16).collect();
                let emitted: Vec<u8> = Tables::emit(&all, &of_channel).collect();
                assert_eq!(emitted, section(&bytes, SectionKind::Tables), "{variant:?}");
            }
            Coder::Context(context) => {
                let mut emitted = context_head(context).emit().to_vec();
                emitted.extend(context.levels().flat_map(|level| level.emit()));
                assert!(section(&bytes, SectionKind::Context).starts_with(&emitted), "{variant:?}");
            }
        }
        if let Some(coded) = bundle.heads().coded() {
            let tables: Vec<u8> = coded.tables.iter().flat_map(FrequencyTable::emit).collect();
            assert!(section(&bytes, SectionKind::Heads).starts_with(&tables), "{variant:?}");
        }
        let measures = (0..header.n_tiers).filter_map(|tier| bundle.measures(tier));
        let emitted: Vec<u8> = measures.flat_map(|measures| measures.emit()).collect();
        assert_eq!(emitted, section(&bytes, SectionKind::Manifest), "{variant:?}");
        assert!(manifest::parse(&emitted, header.n_tiers).is_ok(), "{variant:?}");
        let directory = bundle.directory();
        let tiers = (0..header.n_tiers).filter_map(|tier| directory.tier(tier));
        let mut emitted: Vec<u8> = tiers.flat_map(|tier| tier.emit()).collect();
        emitted.extend(directory.ink_frame.emit());
        let records = (0..header.n_chunks).filter_map(|chunk| directory.record(chunk));
        emitted.extend(records.flat_map(|record| record.emit()));
        assert_eq!(emitted, section(&bytes, SectionKind::Directory), "{variant:?}");
    }
    assert_eq!(STRIPS.len(), TierMeasures::default().max_strip_splats.len());
}

fn context_head(context: &Context<'_>) -> ContextHead {
    ContextHead {
        frame: context.frame(),
        base_steps: context.base_steps(),
        n_levels: context.levels().count() as u8,
        n_taps: context.n_taps() as u8,
        n_hidden: context.n_hidden() as u16,
    }
}
