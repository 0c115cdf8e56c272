//! Files that a reader must refuse: each a good one with one thing changed, and its checksums made right again.

mod chunks;
mod contexts;
mod directory;
mod header;
mod heads;
mod positions;
mod sections;
mod tables;

use pocketsplat_core::{Bundle, DecodeError, Residency};
use pocketsplat_format::bundle::{Effects, HEADER_FIXED_LEN, SECTION_LEN};
use pocketsplat_format::context::{GridFrame, LevelKind};
use std::ops::Range;

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
    /// What the decoder says when it opens the file and decodes its chunks, to keep their anchors or to draw them; nothing if it finds no fault.
    pub fn refusal(&self) -> Option<Refusal> {
        let refusal =
            |chunk, error: DecodeError| Refusal { chunk, error: format!("{error:?}"), message: error.to_string() };
        let bundle = match Bundle::parse(&self.bytes) {
            Ok(bundle) => bundle,
            Err(error) => return Some(refusal(None, error)),
        };
        let preview = bundle.header().preview;
        let [kept, drawn] = [Residency::Resident, Residency::Streamed]
            .map(|residency| draw_by(&budget_for(&preview).with_residency(residency), &bundle, &preview).err());
        assert_eq!(kept, drawn, "{}: where anchors wait changes nothing", self.name);
        match kept? {
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

/// A file of a [`List`] that waits for its bytes.
struct Entry<'a> {
    list: &'a mut List,
    name: &'a str,
    reason: &'a str,
    expected: &'a str,
}

impl List {
    /// A file whose bytes the next call gives.
    fn file<'a>(&'a mut self, name: &'a str, reason: &'a str, expected: &'a str) -> Entry<'a> {
        Entry { list: self, name, reason, expected }
    }
}

impl Entry<'_> {
    /// These bytes as they are.
    fn of(self, bytes: Vec<u8>) {
        let [name, reason, expected] = [self.name, self.reason, self.expected].map(str::to_owned);
        self.list.0.push(Refused { name, reason, expected, bytes });
    }

    /// A good file with other bytes at `at`, sealed again.
    fn patched(self, (good, at): (&[u8], usize), other: &[u8]) {
        let mut bytes = good.to_vec();
        assert_ne!(&bytes[at..at + other.len()], other, "{}: nothing changes", self.name);
        bytes[at..at + other.len()].copy_from_slice(other);
        reseal(&mut bytes);
        self.of(bytes);
    }

    /// The same, `at` counted from the start of a section.
    fn in_section(self, (good, kind, at): (&[u8], u8, usize), other: &[u8]) {
        let start = section(good, kind).1.start;
        self.patched((good, start + at), other);
    }
}

/// All files.
pub fn files() -> Vec<Refused> {
    let good = Good::new();
    let mut list = List(Vec::new());
    header::add(&mut list, &good);
    sections::add(&mut list, &good);
    heads::add(&mut list, &good);
    positions::add(&mut list, &good);
    tables::add(&mut list, &good);
    contexts::add(&mut list, &good);
    directory::add(&mut list, &good);
    chunks::add(&mut list, &good);
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
