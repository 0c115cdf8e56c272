//! Files that a reader must refuse: each a good one with one thing changed, and its checksums made right again.

use std::ops::Range;

use pocketsplat_core::bundle::{Effects, HEADER_FIXED_LEN, SECTION_LEN};
use pocketsplat_core::context::{GridFrame, LevelKind};
use pocketsplat_core::{Bundle, DecodeError, Residency};

use super::bundles::{anchors, front};
use super::contexts::{ContextDraft, ContextShape, level};
use super::draft::{CoderDraft, Draft, HeadCoding, n_channels, n_log_scales};
use super::expected::list;
use super::heads::Widths;
use super::models::Anchor;
use super::sample::NO_EFFECT;
use crate::frame::{budget_for, draw_by};
use crate::seal::reseal;

/// A file that must be refused.
#[derive(Clone, Debug)]
pub struct Refused {
    /// Its file's name without an ending.
    pub name: String,
    /// What is wrong with it, in words.
    pub reason: String,
    /// What the decoder's error begins with, as `Debug` prints it.
    pub expected: String,
    /// Its file.
    pub bytes: Vec<u8>,
}

/// How a file was refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// The chunk whose decoding ended with it; none when the file was not opened.
    pub chunk: Option<u32>,
    /// As `Debug` prints it.
    pub error: String,
    /// For people.
    pub message: String,
}

impl Refused {
    /// What the decoder says when it opens the file and decodes its chunks to keep their anchors; nothing if it finds no fault.
    pub fn refusal(&self) -> Option<Refusal> {
        let refusal =
            |chunk, error: DecodeError| Refusal { chunk, error: format!("{error:?}"), message: error.to_string() };
        let bundle = match Bundle::parse(&self.bytes) {
            Ok(bundle) => bundle,
            Err(error) => return Some(refusal(None, error)),
        };
        let preview = bundle.header().preview;
        let budget = budget_for(&preview).with_residency(Residency::Resident);
        match draw_by(&budget, &bundle, &preview).err()? {
            error @ (DecodeError::ChunkChecksum { chunk, .. } | DecodeError::ChunkStream { chunk, .. }) => {
                Some(refusal(Some(chunk), error))
            }
            error => panic!("{}: {error}", self.name),
        }
    }
}

const WIDTHS: Widths = Widths { features: 2, offsets: 2, colour_hidden: 2, detail_hidden: 0 };

/// The good files that others are made from.
struct Good {
    /// Masks, tables, two tiers of three chunks.
    tables: Draft,
    /// A grid of two levels, with taps.
    grid: Draft,
    following: Draft,
    coded_heads: Draft,
    detail: Draft,
    gaussians: Draft,
}

impl Good {
    fn new() -> Self {
        let of = |effects: Effects, widths: Widths, seed: u64| {
            let anchors = anchors(6, widths, effects, false, seed);
            let tiers = vec![vec![anchors[..2].to_vec(), anchors[2..4].to_vec()], vec![anchors[4..].to_vec()]];
            Draft::of(effects, widths, tiers, front(), seed)
        };
        let mut tables = of(NO_EFFECT, WIDTHS, 900);
        tables.masks = true;
        let n_scalars = WIDTHS.features + n_log_scales(NO_EFFECT);
        let hidden: &mut Anchor = &mut tables.tiers[0][0][0];
        hidden.drawn = 1;
        hidden.symbols[n_scalars + 3..].fill(0);
        tables.count_tables([1.0 / 16.0, 1.0 / 8.0, 1.0 / 16.0]);
        let shape = ContextShape {
            features: WIDTHS.features,
            log_scales: n_log_scales(NO_EFFECT),
            channels: n_channels(WIDTHS, NO_EFFECT),
            hidden: 2,
        };
        let frame = GridFrame { min: [-32; 3], scale: [1 << 26; 3] };
        let with_context = |context: ContextDraft| {
            let mut draft = of(NO_EFFECT, WIDTHS, 901);
            draft.coder = CoderDraft::Context(context.section());
            draft
        };
        let levels = vec![level(LevelKind::Volume, 2, 8), level(LevelKind::Xy, 9, 16)];
        let detailed = Widths { detail_hidden: 2, ..WIDTHS };
        Self {
            grid: with_context(ContextDraft::grid(shape, frame, levels, 1, 902)),
            following: with_context(ContextDraft::following(shape, frame, [2, 4, 6], 903)),
            coded_heads: Draft { head_coding: HeadCoding::Counted, ..of(NO_EFFECT, WIDTHS, 904) },
            detail: of(Effects { detail: true, ..NO_EFFECT }, detailed, 905),
            gaussians: Draft { gaussians: true, ..of(NO_EFFECT, WIDTHS, 906) },
            tables,
        }
    }
}

/// The row of a section in the section table, and the section, both in the file.
fn section(bytes: &[u8], kind: u8) -> (usize, Range<usize>) {
    let rows = (0..usize::from(bytes[39])).map(|row| HEADER_FIXED_LEN + row * SECTION_LEN);
    let row = rows.into_iter().find(|&row| bytes[row] == kind).unwrap_or_else(|| panic!("no section of kind {kind}"));
    let [offset, len] = [4, 8].map(|field| read_u32(bytes, row + field) as usize);
    (row, offset..offset + len)
}

fn read_u32(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(*bytes[at..].first_chunk().expect("inside the file"))
}

/// Collects files.
struct List(Vec<Refused>);

impl List {
    /// A file as it is.
    fn push(&mut self, name: &str, reason: &str, expected: &str, bytes: Vec<u8>) {
        let [name, reason, expected] = [name, reason, expected].map(str::to_owned);
        self.0.push(Refused { name, reason, expected, bytes });
    }

    /// A file with other bytes at `at`, sealed again.
    fn patched(&mut self, name: &str, reason: &str, expected: &str, good: &[u8], at: usize, other: &[u8]) {
        let mut bytes = good.to_vec();
        assert_ne!(&bytes[at..at + other.len()], other, "{name}: nothing changes");
        bytes[at..at + other.len()].copy_from_slice(other);
        reseal(&mut bytes);
        self.push(name, reason, expected, bytes);
    }

    /// The same, `at` counted from the start of a section.
    fn in_section(
        &mut self,
        name: &str,
        reason: &str,
        expected: &str,
        good: &[u8],
        (kind, at): (u8, usize),
        other: &[u8],
    ) {
        let start = section(good, kind).1.start;
        self.patched(name, reason, expected, good, start + at, other);
    }
}

/// All files.
pub fn files() -> Vec<Refused> {
    let good = Good::new();
    let mut list = List(Vec::new());
    header(&mut list, &good);
    section_table(&mut list, &good);
    heads(&mut list, &good);
    positions_and_masks(&mut list, &good);
    tables(&mut list, &good);
    contexts(&mut list, &good);
    directory(&mut list, &good);
    chunks(&mut list, &good);
    list.0
}

/// `refused.json`.
///
/// # Panics
/// If a file is not refused, or for another reason than it was made for.
pub fn json(files: &[Refused]) -> String {
    let entry = |file: &Refused| {
        let refusal = file.refusal().unwrap_or_else(|| panic!("{} is not refused: {}", file.name, file.reason));
        let Refused { name, reason, expected, .. } = file;
        assert!(refusal.error.starts_with(expected), "{name}, {reason}: {}, expected {expected}", refusal.error);
        let when = if refusal.chunk.is_some() { "decoded" } else { "opened" };
        let chunk = refusal.chunk.map_or("null".to_owned(), |chunk| chunk.to_string());
        format!(
            "{{\"file\": \"refused/{name}.psb\", \"when\": \"{when}\", \"chunk\": {chunk},\n   \"reason\": \"{reason}\",\n   \
             \"error\": \"{}\"}}",
            refusal.message.replace('"', "\\\"")
        )
    };
    let mut json = list(files.iter().map(entry));
    json.push('\n');
    json
}

const NAN: [u8; 4] = f32::NAN.to_le_bytes();
const INFINITE: [u8; 4] = f32::INFINITY.to_le_bytes();

fn header(list: &mut List, good: &Good) {
    let bytes = good.tables.clone().file();
    let (file, detail) = (bytes.as_slice(), good.detail.clone().file());
    list.push("empty", "The file has no bytes.", "NotABundle", Vec::new());
    list.patched("magic", "The first byte is another.", "NotABundle", file, 0, &[0x88]);
    list.patched(
        "magic-line-ends",
        "A text transfer changed the line ends of the magic.",
        "NotABundle",
        file,
        4,
        b"\n\x1a\n\x04",
    );
    list.push("cut-in-header", "The file ends in its header.", "Truncated { section: Header", file[..100].to_vec());
    for version in [3, pocketsplat_core::bundle::VERSION + 1] {
        let expected = format!("UnsupportedVersion {{ found: {version}");
        list.patched(
            &format!("version-{version}"),
            &format!("Version {version}."),
            &expected,
            file,
            8,
            &version.to_le_bytes(),
        );
    }
    let header_len = u16::from_le_bytes([file[10], file[11]]);
    for (name, len) in [("header-len-short", 164 + 5 * 16), ("header-len-of-another-table", header_len + 16)] {
        let expected = format!("OutOfRange {{ field: HeaderLen, found: {len}");
        let reason = format!("header_len is {len}.");
        list.patched(name, &reason, &expected, file, 10, &len.to_le_bytes());
    }
    let mut crc = file.to_vec();
    crc[44] ^= 1;
    list.push(
        "header-crc",
        "A bit of the header is flipped and its CRC is as it was.",
        "SectionChecksum { section: Header",
        crc,
    );
    for bit in [9, 11, 31] {
        let bits = read_u32(file, 16) | 1 << bit;
        let expected = format!("UnsupportedFeatures {{ unknown_bits: {}", 1_u32 << bit);
        let reason = format!("Bit {bit} of the required features, which is reserved, is set.");
        list.patched(&format!("feature-{bit}"), &reason, &expected, file, 16, &bits.to_le_bytes());
    }
    let out = |field: &str, found: u32| format!("OutOfRange {{ field: {field}, found: {found},");
    let u16s: [(&str, &str, usize, u16, &str); 13] = [
        ("f-0", "F is 0.", 24, 0, "FeatureDim"),
        ("f-257", "F is 257.", 24, 257, "FeatureDim"),
        ("k-0", "K is 0.", 26, 0, "NOffsets"),
        ("k-33", "K is 33.", 26, 33, "NOffsets"),
        ("max-chunk-anchors-0", "max_chunk_anchors is 0.", 36, 0, "MaxChunkAnchors"),
        ("max-chunk-anchors-1025", "max_chunk_anchors is 1025.", 36, 1025, "MaxChunkAnchors"),
        ("training-width-0", "The training width is 0.", 40, 0, "TrainingSize"),
        ("training-height-0", "The training height is 0.", 42, 0, "TrainingSize"),
        ("colour-hidden-0", "The colour head has no hidden unit.", 52, 0, "ColourHidden"),
        ("colour-hidden-257", "The colour head has 257 hidden units.", 52, 257, "ColourHidden"),
        ("detail-hidden-without-detail", "There is no detail head, and it has a hidden unit.", 54, 1, "DetailHidden"),
        ("detail-hidden-0", "The detail head has no hidden unit.", 54, 0, "DetailHidden"),
        ("detail-hidden-257", "The detail head has 257 hidden units.", 54, 257, "DetailHidden"),
    ];
    for (name, reason, at, value, field) in u16s {
        let of = if name == "detail-hidden-0" || name == "detail-hidden-257" { detail.as_slice() } else { file };
        list.patched(name, reason, &out(field, value.into()), of, at, &value.to_le_bytes());
    }
    let too_many = (1 << 24) + 1;
    let about_counts: [(&str, &str, usize, u32, &str); 2] = [
        ("n-anchors-too-many", "There are 2²⁴ + 1 anchors.", 28, too_many, "NAnchors"),
        ("n-chunks-above-anchors", "There are more chunks than anchors.", 32, 7, "NChunks"),
    ];
    for (name, reason, at, value, field) in about_counts {
        list.patched(name, reason, &out(field, value), file, at, &value.to_le_bytes());
    }
    let u8s: [(&str, &str, usize, u8, &str); 10] = [
        ("camera-convention-1", "The camera convention is 1.", 38, 1, "CameraConvention"),
        ("n-sections-5", "The section table has 5 rows.", 39, 5, "NSections"),
        ("background-without-feature", "There is a background without feature 8.", 45, 1, "Background"),
        ("n-tiers-0", "There are no tiers.", 47, 0, "NTiers"),
        ("n-tiers-9", "There are 9 tiers.", 47, 9, "NTiers"),
        ("symbol-bits-0", "Features have symbols of 0 bits.", 156, 0, "SymbolBits"),
        ("symbol-bits-17", "Features have symbols of 17 bits.", 156, 17, "SymbolBits"),
        ("log-scale-bits-17", "Log-scales have symbols of 17 bits.", 157, 17, "SymbolBits"),
        ("offset-bits-0", "Offsets have symbols of 0 bits.", 158, 0, "SymbolBits"),
        ("header-reserved", "The reserved byte of the header is 1.", 159, 1, "Reserved"),
    ];
    for (name, reason, at, value, field) in u8s {
        list.patched(name, reason, &out(field, value.into()), file, at, &[value]);
    }
    let float = |field: &str| format!("BadFloat {{ field: {field}");
    let floats: [(&str, &str, usize, f32, &str); 11] = [
        ("voxel-size-0", "The voxel size is 0.", 48, 0.0, "VoxelSize"),
        ("voxel-size-negative", "The voxel size is negative.", 48, -0.5, "VoxelSize"),
        ("voxel-size-infinite", "The voxel size is infinite.", 48, f32::INFINITY, "VoxelSize"),
        ("voxel-size-nan", "The voxel size is not a number.", 48, f32::NAN, "VoxelSize"),
        ("preview-rotation-nan", "A number of the preview's rotation is not a number.", 92, f32::NAN, "PreviewCamera"),
        ("preview-translation-infinite", "The preview's translation is infinite.", 128, f32::INFINITY, "PreviewCamera"),
        ("preview-focal-0", "A focal length of the preview is 0.", 136, 0.0, "PreviewCamera"),
        ("preview-focal-negative", "A focal length of the preview is negative.", 140, -60.0, "PreviewCamera"),
        ("preview-focal-infinite", "A focal length of the preview is infinite.", 140, f32::INFINITY, "PreviewCamera"),
        ("preview-principal-nan", "The preview's principal point is not a number.", 144, f32::NAN, "PreviewCamera"),
        (
            "preview-principal-infinite",
            "The preview's principal point is infinite.",
            148,
            f32::NEG_INFINITY,
            "PreviewCamera",
        ),
    ];
    for (name, reason, at, value, field) in floats {
        list.patched(name, reason, &float(field), file, at, &value.to_le_bytes());
    }
    let doubles: [(&str, &str, usize, f64); 4] = [
        ("normalisation-centre-infinite", "The normalisation's centre is infinite.", 64, f64::INFINITY),
        ("normalisation-scale-0", "The normalisation's scale is 0.", 80, 0.0),
        ("normalisation-scale-negative", "The normalisation's scale is negative.", 80, -1.0),
        ("normalisation-scale-nan", "The normalisation's scale is not a number.", 80, f64::NAN),
    ];
    for (name, reason, at, value) in doubles {
        list.patched(name, reason, &float("Normalisation"), file, at, &value.to_le_bytes());
    }
    for (name, at) in [("preview-width-0", 152), ("preview-height-0", 154)] {
        list.patched(name, "The preview has no pixels.", &float("PreviewCamera"), file, at, &[0, 0]);
    }
    let row = |x: [f32; 3]| x.map(f32::to_le_bytes).concat();
    let rows = [row([1.0, 0.0, 0.0]), row([0.0, 1.0, 0.0]), row([0.0, 0.0, -1.0])].concat();
    list.patched(
        "preview-mirrored",
        "The preview's rotation is a reflection.",
        &out("PreviewRotation", 20_000),
        file,
        88,
        &rows,
    );
    let rows = [row([1.0, 0.0, 0.0]), row([0.0, 1.0, 0.0]), row([0.0, 0.0, 1.0302])].concat();
    let reason = "The preview's rotation is off by 302 ten-thousandths; 300 are allowed.";
    list.patched("preview-not-quite-a-rotation", reason, &out("PreviewRotation", 302), file, 88, &rows);
}

fn section_table(list: &mut List, good: &Good) {
    let bytes = good.tables.clone().file();
    let file = bytes.as_slice();
    let out = |field: &str, found: u32| format!("OutOfRange {{ field: {field}, found: {found},");
    let row_of = |kind: u8| section(file, kind).0;
    list.patched(
        "row-reserved",
        "A reserved byte of a row of the section table is 1.",
        &out("Reserved", 1),
        file,
        row_of(2) + 2,
        &[1],
    );
    for kind in [0, 9, 127] {
        let reason = format!("A section is of kind {kind}, which is reserved.");
        list.patched(&format!("kind-{kind}"), &reason, &out("SectionKind", kind.into()), file, row_of(6), &[kind]);
    }
    let (header, sections) = good.tables.clone().parts();
    let of = |sections: &[(u8, Vec<u8>)]| super::draft::assembled(&header, sections);
    let swap = |a: usize, b: usize| {
        let mut swapped = sections.clone();
        swapped.swap(a, b);
        of(&swapped)
    };
    let unexpected = |found: &str, expected: &str| format!("UnexpectedSection {{ found: {found}, expected: {expected}");
    list.push("order-of-sections", "The lattice comes before the heads.", &unexpected("Lattice", "Heads"), swap(0, 1));
    list.push(
        "directory-before-manifest",
        "The directory comes before the manifest.",
        &unexpected("Directory", "Manifest"),
        swap(4, 5),
    );
    let without = |at: usize| {
        let mut fewer = sections.clone();
        fewer.remove(at);
        of(&fewer)
    };
    list.push("no-masks", "Feature 3 is set, and there are no masks.", &unexpected("Tables", "Masks"), without(2));
    list.push("no-manifest", "There is no manifest.", &unexpected("Directory", "Manifest"), without(4));
    list.push("no-chunks", "There are no chunks.", "MissingSection { section: Chunks", without(6));
    let with = |at: usize, kind: u8, content: &[u8]| {
        let mut more = sections.clone();
        more.insert(at, (kind, content.to_vec()));
        of(&more)
    };
    list.push(
        "heads-twice",
        "There are two sections of heads.",
        &unexpected("Heads", "Lattice"),
        with(1, 1, &sections[0].1),
    );
    list.push(
        "context-beside-tables",
        "There is a context without feature 4.",
        &unexpected("Context", "Manifest"),
        with(4, 5, &[0; 40]),
    );
    list.push(
        "section-behind-chunks",
        "A section follows the chunks.",
        &unexpected("Other(200)", "Chunks"),
        with(7, 200, &[1, 2, 3, 4]),
    );
    let features = read_u32(file, 16);
    let reason = "There are masks without feature 3.";
    list.patched(
        "masks-without-feature",
        reason,
        &unexpected("Masks", "Tables"),
        file,
        16,
        &(features & !8).to_le_bytes(),
    );
    let reason = "Feature 4 is set, and there are tables.";
    list.patched(
        "tables-with-context",
        reason,
        &unexpected("Tables", "Context"),
        file,
        16,
        &(features | 16).to_le_bytes(),
    );
    let baked = good.gaussians.clone().file();
    let counts = baked[section(&baked, 128).1].to_vec();
    let mut twice = good.gaussians.clone();
    twice.unknown = vec![(5, 128, counts)];
    list.push("gaussians-twice", "There are two sections gaussians.", &unexpected("Gaussians", "Chunks"), twice.file());

    let manifest = section(file, 6);
    let offset = manifest.1.start as u32;
    let misplaced = "Misplaced { section: Manifest";
    for (name, reason, offset) in [
        ("section-overlaps", "The manifest begins 4 bytes before the end of the section before it.", offset - 4),
        ("section-gap", "The manifest begins 4 bytes too late.", offset + 4),
        ("section-misaligned", "The manifest does not begin at a multiple of 4.", offset + 1),
    ] {
        list.patched(name, reason, misplaced, file, manifest.0 + 4, &offset.to_le_bytes());
    }
    let reason = "The first section does not begin behind the header.";
    let first = section(file, 1).1.start as u32 + 4;
    list.patched("first-section-gap", reason, "Misplaced { section: Heads", file, row_of(1) + 4, &first.to_le_bytes());
    let reason = "The heads reach beyond the file.";
    list.patched(
        "section-beyond-file",
        reason,
        "Truncated { section: Heads",
        file,
        row_of(1) + 8,
        &(1_u32 << 20).to_le_bytes(),
    );
    let reason = "A length that passes 2³² with its offset.";
    list.patched(
        "section-len-overflows",
        reason,
        "Truncated { section: Heads",
        file,
        row_of(1) + 8,
        &u32::MAX.to_le_bytes(),
    );
    for (kind, name) in [(1, "heads"), (4, "tables")] {
        let end = section(file, kind).1.end;
        if !end.is_multiple_of(4) {
            let (name, reason) = (format!("padding-behind-{name}"), format!("A byte behind the {name} is not 0."));
            list.patched(&name, &reason, "OutOfRange { field: Padding", file, end, &[1]);
        }
    }
    let end = file.len() as u32;
    for (name, reason, file_len, expected) in [
        ("file-len-inside-chunks", "file_len lies inside a tier.", end - 4, "Truncated { section: Chunks"),
        (
            "file-len-inside-directory",
            "file_len lies inside the directory.",
            section(file, 7).1.end as u32 - 4,
            "Truncated { section: Directory",
        ),
        (
            "file-len-beyond-chunks",
            "file_len is beyond the last tier, and bytes follow.",
            end + 4,
            "WrongLength { section: Chunks",
        ),
    ] {
        let longer = [file, &[0; 8]].concat();
        list.patched(name, reason, expected, &longer, 12, &file_len.to_le_bytes());
    }
    let reason = "The chunks have a CRC of their own in the section table.";
    list.patched("chunks-crc", reason, "SectionChecksum { section: Chunks", file, row_of(8) + 12, &[1]);
    for (kind, name) in [(1, "Heads"), (2, "Lattice"), (3, "Masks"), (4, "Tables"), (6, "Manifest"), (7, "Directory")] {
        let mut damaged = file.to_vec();
        damaged[section(file, kind).1.end - 1] ^= 0x10;
        let expected = format!("SectionChecksum {{ section: {name}");
        let lower = name.to_lowercase();
        list.push(&format!("{lower}-crc"), &format!("A bit of the {lower} is flipped."), &expected, damaged);
    }
    let mut skipped = good.tables.clone();
    skipped.unknown = vec![(3, 222, b"something".to_vec())];
    let mut skipped = skipped.file();
    let at = section(&skipped, 222).1.start;
    skipped[at] ^= 1;
    list.push(
        "unknown-crc",
        "A bit of a section of unknown kind is flipped.",
        "SectionChecksum { section: Other(222)",
        skipped,
    );
    let end = section(file, 7).1.start + 5;
    list.push(
        "cut-in-section",
        "The file ends in its directory.",
        "Truncated { section: Directory",
        file[..end].to_vec(),
    );
    let chunks = section(file, 8).1;
    for (name, reason, end) in [
        ("cut-in-chunk", "The file ends in its first chunk.", chunks.start + 2),
        ("cut-before-end", "The file lacks its last byte.", file.len() - 1),
    ] {
        list.push(name, reason, "Truncated { section: Chunks", file[..end].to_vec());
    }
}

/// The bytes of a half.
const HALF_INFINITE: [u8; 2] = 0x7C00_u16.to_le_bytes();
const HALF_NAN: [u8; 2] = 0xFE01_u16.to_le_bytes();

fn heads(list: &mut List, good: &Good) {
    let file = good.tables.clone().file();
    let reason = "A weight of the opacity head is infinite.";
    list.in_section("weight-infinite", reason, "BadFloat { field: HeadWeight, index: 1", &file, (1, 2), &HALF_INFINITE);
    let len = section(&file, 1).1.len();
    let reason = "The last bias of the colour head is not a number.";
    list.in_section("bias-nan", reason, "BadFloat { field: HeadWeight", &file, (1, len - 2), &HALF_NAN);
    for (name, reason, n, expected) in [
        ("heads-short", "The heads lack a number.", len - 2, "Truncated { section: Heads"),
        ("heads-long", "The heads have a number too many.", len + 2, "WrongLength { section: Heads"),
    ] {
        let resized = good.tables.clone().with_section(1, |bytes| bytes.resize(n, 0));
        list.push(name, reason, expected, resized);
    }
    let coded = good.coded_heads.clone().file();
    let step = "BadFloat { field: HeadStep, index: 0";
    for (name, reason, at, value) in [
        ("head-origin", "The table of W1 has an origin.", 0, 0.5_f32),
        ("head-step-0.75", "The step of W1 is not a power of two.", 4, 0.75),
        ("head-step-2", "The step of W1 is above 1.", 4, 2.0),
        ("head-step-2^-25", "The step of W1 is below 2⁻²⁴.", 4, 1.0 / 33_554_432.0),
    ] {
        list.in_section(name, reason, step, &coded, (1, at), &f32::to_le_bytes(value));
    }
    let reason = "The step of W1 is negative.";
    list.in_section("head-step-negative", reason, "BadFloat", &coded, (1, 4), &(-0.5_f32).to_le_bytes());
    let reason = "The first bound of the table of W1 is not 0.";
    list.in_section("head-bounds", reason, "BadBound { section: Heads, table: 0, entry: 0", &coded, (1, 12), &[1, 0]);
    let edited = |edit: fn(&mut Vec<u8>)| good.coded_heads.clone().with_section(1, edit);
    for (name, reason, edit) in [
        ("head-stream-odd", "The heads end in half a word.", (|bytes| bytes.push(0)) as fn(&mut Vec<u8>)),
        ("head-stream-short", "The stream of the heads lacks its last word.", |bytes| bytes.truncate(bytes.len() - 2)),
        ("head-stream-long", "Words are left behind the last weight.", |bytes| bytes.extend([1, 0])),
    ] {
        list.push(name, reason, "HeadStream", edited(edit));
    }
}

fn positions_and_masks(list: &mut List, good: &Good) {
    let file = good.tables.clone().file();
    let out = |field: &str, found: u32| format!("OutOfRange {{ field: {field}, found: {found},");
    let beyond = (1_i32 << 23) + 1;
    for (name, at, value) in [("lattice-min-beyond", 0, beyond), ("lattice-min-below", 8, -beyond)] {
        let reason = format!("The lattice begins at {value}.");
        list.in_section(name, &reason, &out("LatticeMin", beyond as u32), &file, (2, at), &value.to_le_bytes());
    }
    list.in_section(
        "lattice-min-lowest",
        "The lattice begins at −2³¹.",
        "OutOfRange { field: LatticeMin",
        &file,
        (2, 4),
        &i32::MIN.to_le_bytes(),
    );
    list.in_section(
        "lattice-bits-22",
        "The lattice has 22 bits an axis.",
        &out("LatticeBits", 22),
        &file,
        (2, 12),
        &[22],
    );
    list.in_section(
        "lattice-reserved",
        "A reserved byte of the lattice is 1.",
        &out("Reserved", 1),
        &file,
        (2, 14),
        &[1],
    );
    let reason = "Frequencies of a level that the lattice does not have.";
    let bits = file[section(&file, 2).1.start + 12];
    list.in_section("lattice-long", reason, "WrongLength { section: Lattice", &file, (2, 12), &[bits - 1]);
    list.in_section(
        "lattice-short",
        "The frequencies of three levels are missing.",
        "Truncated { section: Lattice",
        &file,
        (2, 12),
        &[bits + 1],
    );
    let ends = |both: u16, zero: u16| [both.to_le_bytes(), zero.to_le_bytes()].concat();
    list.in_section(
        "trie-beyond-4096",
        "end_zero is 4097.",
        &out("TrieFrequency", 4097),
        &file,
        (2, 16),
        &ends(0, 4097),
    );
    list.in_section(
        "trie-falls",
        "end_both is above end_zero.",
        &out("TrieFrequency", 2001),
        &file,
        (2, 16),
        &ends(2001, 2000),
    );
    list.in_section(
        "mask-0",
        "The frequency of a drawn offset is 0.",
        &out("MaskFrequency", 0),
        &file,
        (3, 8),
        &[0, 0],
    );
    list.in_section(
        "mask-4096",
        "The frequency of a drawn offset is 4096.",
        &out("MaskFrequency", 4096),
        &file,
        (3, 2),
        &[0, 16],
    );
    let long = good.tables.clone().with_section(3, |bytes| bytes.extend([1, 0]));
    list.push("masks-long", "There is a frequency too many.", "WrongLength { section: Masks", long);
    let short = good.tables.clone().with_section(3, |bytes| bytes.truncate(14));
    list.push("masks-short", "There is a frequency too few.", "Truncated { section: Masks", short);
}

fn tables(list: &mut List, good: &Good) {
    let file = good.tables.clone().file();
    let out = |field: &str, found: u32| format!("OutOfRange {{ field: {field}, found: {found},");
    let n_channels = good.tables.n_channels();
    list.in_section("no-tables", "There are no tables.", &out("NTables", 0), &file, (4, 0), &[0, 0]);
    list.in_section("361-tables", "There are 361 tables.", &out("NTables", 361), &file, (4, 0), &361_u16.to_le_bytes());
    let other = n_channels as u16 - 1;
    let reason = "The tables are of a channel less than C.";
    list.in_section("channels-of-tables", reason, &out("NChannels", other.into()), &file, (4, 2), &other.to_le_bytes());
    let reason = "Channel 1 has table 3 of 3.";
    list.in_section("no-such-table", reason, "NoSuchTable { channel: 1, table: 3", &file, (4, 6), &[3, 0]);
    let index = 4 + 2 * n_channels;
    let first = read_u32(&file, section(&file, 4).1.start + index);
    let second = read_u32(&file, section(&file, 4).1.start + index + 4);
    let reason = "The second table begins 2 bytes too late.";
    list.in_section(
        "table-gap",
        reason,
        &out("TableOffset", second + 2),
        &file,
        (4, index + 4),
        &(second + 2).to_le_bytes(),
    );
    let reason = "The first table begins inside the index.";
    list.in_section(
        "table-overlaps",
        reason,
        &out("TableOffset", first - 4),
        &file,
        (4, index),
        &(first - 4).to_le_bytes(),
    );
    let table = first as usize;
    let scale = "BadFloat { field: TableScale, index: 0";
    for (name, reason, at, value) in [
        ("table-step-0", "The step of a table is 0.", 4, 0.0_f32),
        ("table-step-negative", "The step of a table is negative.", 4, -1.0),
        ("table-step-nan", "The step of a table is not a number.", 4, f32::NAN),
        ("table-step-infinite", "The step of a table is infinite.", 4, f32::INFINITY),
        ("table-step-too-large", "32768 steps of a table are above 10¹⁸.", 4, 1e14),
        ("table-origin-nan", "The origin of a table is not a number.", 0, f32::NAN),
        ("table-origin-too-large", "The origin of a table is −10¹⁸.", 0, -1e18),
    ] {
        list.in_section(name, reason, scale, &file, (4, table + at), &f32::to_le_bytes(value));
    }
    let reason = "The last symbol of a table is 32768.";
    let n_symbols = u16::from_le_bytes(*file[section(&file, 4).1.start + table + 10..].first_chunk().expect("a table"));
    let min_symbol = (32769 - i32::from(n_symbols)) as i16;
    list.in_section(
        "table-symbols",
        reason,
        "OutOfRange { field: TableSymbols",
        &file,
        (4, table + 8),
        &min_symbol.to_le_bytes(),
    );
    let bound = |entry: u16| format!("BadBound {{ section: Tables, table: 0, entry: {entry}");
    let last = n_symbols + 1;
    for (name, reason, entry, value, blamed) in [
        ("bounds-begin", "The first bound of a table is 1.", 0, 1_u16, 0),
        ("bounds-fall", "A bound is below the one before it.", 2, 0, 2),
        ("bounds-reach-4096-early", "The escape has no slots.", last - 1, 4096, last - 1),
        ("bounds-beyond-4096", "A bound is 4097.", last - 1, 4097, last - 1),
        ("bounds-end", "The last bound is 4095.", last, 4095, last),
    ] {
        list.in_section(
            name,
            reason,
            &bound(blamed),
            &file,
            (4, table + 12 + 2 * usize::from(entry)),
            &value.to_le_bytes(),
        );
    }
    let long = good.tables.clone().with_section(4, |bytes| bytes.extend([0, 0]));
    list.push("tables-long", "Bytes are left behind the last table.", "WrongLength { section: Tables", long);
    let short = good.tables.clone().with_section(4, |bytes| bytes.truncate(bytes.len() - 2));
    list.push("tables-short", "The last table lacks its last bound.", "Truncated { section: Tables", short);
}

fn contexts(list: &mut List, good: &Good) {
    let file = good.grid.clone().file();
    let out = |field: &str, found: u32| format!("OutOfRange {{ field: {field}, found: {found},");
    let step = |index: u32| format!("BadFloat {{ field: ContextStep, index: {index}");
    for (name, reason, index, value) in [
        ("base-step-0", "The base step of features is 0.", 0, 0.0_f32),
        ("base-step-small", "The base step of features is 10⁻¹².", 0, 1e-12),
        ("base-step-large", "The base step of log-scales is 10¹².", 1, 1e12),
        ("base-step-nan", "The base step of offsets is not a number.", 2, f32::NAN),
    ] {
        list.in_section(name, reason, &step(index), &file, (5, 24 + 4 * index as usize), &value.to_le_bytes());
    }
    list.in_section("33-levels", "The grid has 33 levels.", &out("ContextLevels", 33), &file, (5, 36), &[33]);
    let hidden = |n: u16| n.to_le_bytes();
    list.in_section(
        "no-hidden-units",
        "The context has no hidden unit.",
        &out("ContextHidden", 0),
        &file,
        (5, 38),
        &hidden(0),
    );
    list.in_section(
        "257-hidden-units",
        "The context has 257 hidden units.",
        &out("ContextHidden", 257),
        &file,
        (5, 38),
        &hidden(257),
    );
    list.in_section("level-kind-4", "A level of the grid is of kind 4.", &out("GridKind", 4), &file, (5, 40), &[4]);
    list.in_section("level-reserved", "The reserved byte of a level is 1.", &out("Reserved", 1), &file, (5, 41), &[1]);
    list.in_section(
        "level-nodes-1",
        "A level has one node along an axis.",
        &out("GridResolution", 1),
        &file,
        (5, 42),
        &[1, 0],
    );
    let reason = "A level has 32769 nodes along an axis.";
    list.in_section(
        "level-nodes-32769",
        reason,
        &out("GridResolution", 32769),
        &file,
        (5, 42),
        &32769_u16.to_le_bytes(),
    );
    for n_rows in [0_u32, 7] {
        let reason = format!("A volume of 8 nodes has {n_rows} rows, which is no power of two either.");
        list.in_section(
            &format!("level-rows-{n_rows}"),
            &reason,
            &out("GridRows", n_rows),
            &file,
            (5, 44),
            &n_rows.to_le_bytes(),
        );
    }
    let shifts = 40 + 2 * 8;
    list.in_section(
        "shift1-32",
        "A shift of the hidden units is 32.",
        &out("ContextShift", 32),
        &file,
        (5, shifts),
        &[32],
    );
    let outputs = 2 * n_channels(WIDTHS, NO_EFFECT) + 3;
    list.in_section(
        "shift2-32",
        "A shift of the outputs is 32.",
        &out("ContextShift", 32),
        &file,
        (5, shifts + 2 + outputs - 1),
        &[32],
    );
    let biases = shifts + 2 + outputs;
    let too_large = (1_i32 << 29) + 1;
    for (name, reason, at, value) in [
        ("b1-too-large", "A bias of the hidden units is 2²⁹ + 1.", biases, too_large),
        ("b2-too-small", "A bias of the outputs is −2²⁹ − 1.", biases + 8, -too_large),
    ] {
        list.in_section(name, reason, &out("ContextBias", too_large as u32), &file, (5, at), &value.to_le_bytes());
    }
    let long = good.grid.clone().with_section(5, |bytes| bytes.push(0));
    list.push("context-long", "A byte is left behind the grid.", "WrongLength { section: Context", long);
    let short = good.grid.clone().with_section(5, |bytes| bytes.truncate(bytes.len() - 1));
    list.push("context-short", "The last row of the grid is missing.", "Truncated { section: Context", short);
    // 65 taps of a context of two features would have as many weights as one.
    list.in_section("65-taps", "The context has 65 taps.", &out("ContextTaps", 65), &file, (5, 37), &[65]);

    let file = good.following.clone().file();
    for (name, reason, at, value, field) in [
        ("levels-fall", "Cells of level 2 are smaller than those of level 1.", 41, 1, "LevelShift"),
        ("level-edge-16", "Cells of level 2 have edges of 2¹⁶.", 41, 16, "LevelShift"),
        ("level-span-26", "What level 2 lies in has edges of 2²⁶.", 42, 26, "LevelShift"),
        ("levels-reserved", "The reserved byte behind the levels is 1.", 43, 1, "Reserved"),
        ("levels-with-taps", "Anchors follow anchors, and there is a tap.", 37, 1, "ContextTaps"),
    ] {
        list.in_section(name, reason, &out(field, value.into()), &file, (5, at), &[value]);
    }
}

fn directory(list: &mut List, good: &Good) {
    let file = good.tables.clone().file();
    let out = |field: &str, found: u32| format!("OutOfRange {{ field: {field}, found: {found},");
    let float = |index: u32| format!("BadFloat {{ field: InkFrame, index: {index}");
    let psnr = "BadFloat { field: ManifestPsnr";
    list.in_section("psnr-infinite", "A PSNR is infinite.", psnr, &file, (6, 0), &INFINITE);
    let reason = "A PSNR is not a number, of other bits than those of \\\"not measured\\\".";
    list.in_section("psnr-nan", reason, psnr, &file, (6, 0), &0x7FC0_0001_u32.to_le_bytes());
    list.in_section("level-6", "The first tier declares level 6.", &out("TierLevel", 6), &file, (6, 60), &[6]);
    let reason = "A reserved byte behind the level of the second tier is 1.";
    list.in_section("level-reserved-byte", reason, "OutOfRange { field: TierLevel", &file, (6, 64 + 63), &[1]);
    let long = good.tables.clone().with_section(6, |bytes| bytes.extend([0; 4]));
    list.push("manifest-long", "The manifest has bytes of no tier.", "WrongLength { section: Manifest", long);
    let short = good.tables.clone().with_section(6, |bytes| bytes.truncate(bytes.len() - 4));
    list.push("manifest-short", "The manifest lacks bytes of the last tier.", "Truncated { section: Manifest", short);

    let tiers = 2 * 12;
    let start = section(&file, 7).1.start;
    let field = |at: usize| read_u32(&file, start + at);
    for (name, reason, at, value, named) in [
        ("tier-with-too-many-chunks", "The first tier has more chunks than there are.", 0, 4, "TierChunks"),
        ("tiers-fall", "The second tier has fewer chunks than the first.", 12, 1, "TierChunks"),
        ("tiers-lack-chunks", "The last tier does not have all chunks.", 12, 2, ""),
        ("tier-anchors", "The first tier has an anchor more than its chunks.", 4, field(4) + 1, "TierAnchors"),
        ("tier-end", "The first tier ends 4 bytes late.", 8, field(8) + 4, "TierEnd"),
    ] {
        let expected = if named.is_empty() { "OutOfRange".to_owned() } else { out(named, value) };
        list.in_section(name, reason, &expected, &file, (7, at), &value.to_le_bytes());
    }
    let reason = "The header has an anchor more than the last tier.";
    let n_anchors = read_u32(&file, 28);
    list.patched("n-anchors", reason, "OutOfRange { field: NAnchors", &file, 28, &(n_anchors + 1).to_le_bytes());
    list.in_section("ink-min-nan", "The ink's lowest corner is not a number.", &float(0), &file, (7, tiers), &NAN);
    list.in_section(
        "ink-min-infinite",
        "The ink's lowest corner is infinite.",
        &float(2),
        &file,
        (7, tiers + 8),
        &INFINITE,
    );
    list.in_section(
        "ink-step-negative",
        "A step of the ink is negative.",
        &float(1),
        &file,
        (7, tiers + 16),
        &(-0.1_f32).to_le_bytes(),
    );
    let reason = "The highest corner that the ink's steps reach is infinite.";
    list.in_section("ink-reach", reason, &float(0), &file, (7, tiers + 12), &1e35_f32.to_le_bytes());
    let record = tiers + 24;
    let len = field(record);
    list.in_section(
        "chunk-len-odd",
        "A chunk has an odd number of bytes.",
        &out("ChunkLen", 1),
        &file,
        (7, record),
        &(len + 1).to_le_bytes(),
    );
    let last = record + 2 * 24;
    let longer = (field(last) + 4).to_le_bytes();
    list.in_section(
        "chunk-len",
        "The last chunk ends behind its tier.",
        "OutOfRange { field: TierEnd",
        &file,
        (7, last),
        &longer,
    );
    list.in_section(
        "chunk-without-anchors",
        "A chunk has no anchors.",
        &out("ChunkAnchors", 0),
        &file,
        (7, record + 8),
        &[0, 0],
    );
    list.in_section(
        "chunk-too-large",
        "A chunk has more anchors than max_chunk_anchors.",
        &out("ChunkAnchors", 3),
        &file,
        (7, record + 8),
        &[3, 0],
    );
    list.in_section(
        "record-reserved",
        "The reserved number of a chunk record is not 0.",
        "OutOfRange { field: Reserved",
        &file,
        (7, record + 11),
        &[1],
    );
    let high = u16::from_le_bytes(*file[start + record + 18..].first_chunk().expect("a record"));
    let reason = "The lowest corner of an ink box is above its highest.";
    list.in_section(
        "ink-box",
        reason,
        &out("InkBox", u32::from(high) + 1),
        &file,
        (7, record + 12),
        &(high + 1).to_le_bytes(),
    );
    let long = good.tables.clone().with_section(7, |bytes| bytes.extend([0; 24]));
    list.push("directory-long", "There is a chunk record too many.", "WrongLength { section: Directory", long);
    let short = good.tables.clone().with_section(7, |bytes| bytes.truncate(bytes.len() - 24));
    list.push("directory-short", "There is a chunk record too few.", "Truncated { section: Directory", short);

    let baked = good.gaussians.clone().file();
    let too_many = 2 * 4 + 1;
    let reason = "There are more Gaussians in the first tier than offsets.";
    list.in_section(
        "gaussians-too-many",
        reason,
        &out("TierGaussians", too_many),
        &baked,
        (128, 0),
        &too_many.to_le_bytes(),
    );
    let first = read_u32(&baked, section(&baked, 128).1.start);
    let reason = "The first two tiers have fewer Gaussians than the first.";
    list.in_section(
        "gaussians-fall",
        reason,
        &out("TierGaussians", first - 1),
        &baked,
        (128, 4),
        &(first - 1).to_le_bytes(),
    );
    let long = good.gaussians.clone().with_section(128, |bytes| bytes.extend([0; 4]));
    list.push("gaussians-long", "There are Gaussians of a tier too many.", "WrongLength { section: Gaussians", long);
}

fn chunks(list: &mut List, good: &Good) {
    let file = good.tables.clone().file();
    let chunk = |index: usize| {
        let start = section(&file, 8).1.start;
        let bundle = Bundle::parse(&file).expect("a good file");
        let found = bundle.chunks().nth(index).expect("three chunks");
        start + found.offset() as usize..start + found.offset() as usize + found.n_bytes()
    };
    let padding =
        (0..2).map(chunk).find(|chunk| !chunk.end.is_multiple_of(4)).expect("a chunk with bytes behind it").end;
    let reason = "A byte between two chunks is not 0.";
    list.patched("padding-behind-chunk", reason, "OutOfRange { field: Padding", &file, padding, &[1]);
    let mut damaged = file.clone();
    damaged[chunk(1).start] ^= 4;
    list.push("chunk-crc", "A bit of the second chunk is flipped.", "ChunkChecksum { chunk: 1", damaged);
    let stream = |chunk: u32| format!("ChunkStream {{ chunk: {chunk}");
    list.patched(
        "chunk-stream",
        "The last word of the last chunk is another.",
        &stream(2),
        &file,
        chunk(2).end - 1,
        &[0xA5],
    );
    for (name, draft) in [("grid", &good.grid), ("following", &good.following)] {
        let file = draft.clone().file();
        let bundle = Bundle::parse(&file).expect("a good file");
        let first = bundle.chunks().next().expect("three chunks");
        let end = section(&file, 8).1.start + first.n_bytes();
        let reason = "The last word of the first chunk is another.";
        list.patched(&format!("chunk-stream-{name}"), reason, &stream(0), &file, end - 1, &[0x5A]);
    }
    let edited = |edit: fn(usize, &mut Vec<u8>)| Draft { edit_chunk: Some(edit), ..good.tables.clone() }.file();
    for (name, reason, edit) in [
        (
            "chunk-words-left",
            "Words are left behind the last symbol of the first chunk.",
            (|chunk, words| {
                if chunk == 0 {
                    words.extend([1, 0]);
                }
            }) as fn(usize, &mut Vec<u8>),
        ),
        ("chunk-words-missing", "The last word of the first chunk is missing.", |chunk, words| {
            if chunk == 0 {
                words.truncate(words.len() - 2);
            }
        }),
        (
            "chunk-first-word-0",
            "The first chunk begins with a word of 0 and is otherwise as it should be.",
            |chunk, words| {
                if chunk == 0 {
                    words.splice(0..0, [0, 0]);
                }
            },
        ),
        ("chunk-empty", "The first chunk has no words, though its symbols take some.", |chunk, words| {
            if chunk == 0 {
                words.clear();
            }
        }),
    ] {
        list.push(name, reason, &stream(0), edited(edit));
    }
    // Two anchors of a trie become one, or three, wherever they are counted.
    for (name, reason, n) in [
        ("trie-with-more-leaves", "The trie of the first chunk has two leaves, its record has one anchor.", 1_u16),
        ("trie-with-fewer-leaves", "The trie of the first chunk has two leaves, its record has three anchors.", 3),
    ] {
        let mut counted = file.clone();
        let directory = section(&file, 7).1.start;
        counted[36] = 3;
        for at in [28, directory + 4, directory + 16] {
            let other = read_u32(&file, at) + u32::from(n) - 2;
            counted[at..at + 4].copy_from_slice(&other.to_le_bytes());
        }
        let record = directory + 2 * 12 + 24;
        counted[record + 8..record + 10].copy_from_slice(&n.to_le_bytes());
        reseal(&mut counted);
        list.push(name, reason, &stream(0), counted);
    }
    let mut one_cell = good.tables.clone();
    for anchor in one_cell.tiers.iter_mut().flatten().flatten() {
        anchor.cell = [1, 2, 3];
    }
    let reason = "Two anchors of a chunk in a lattice of one cell.";
    list.push("one-cell-twice", reason, &stream(0), one_cell.file());
    for group in 0..3 {
        let what = ["feature", "log-scale", "coordinate of an offset"][group];
        let name = ["feature-beyond-its-bits", "log-scale-beyond-its-bits", "offset-beyond-its-bits"][group];
        let mut bits = [16; 3];
        bits[group] = 2;
        let narrow = Draft { symbol_bits: Some(bits), ..good.tables.clone() };
        list.push(
            name,
            &format!("A {what} has a symbol beyond the 2 bits that the header says."),
            &stream(0),
            narrow.file(),
        );
    }
}
