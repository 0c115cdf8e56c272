//! A bundle byte by byte: every field with its offset, its bytes and its meaning.

use std::fmt::{Display, Write};

use half::f16;
use pocketsplat_core::bundle::{Chunk, HEADER_LEN};
use pocketsplat_core::{Bundle, DecodeError};

/// Bytes on a line of the dump.
const LINE_BYTES: usize = 8;

/// Walks over the file and writes a line for every few bytes.
struct Dump<'f> {
    bytes: &'f [u8],
    position: usize,
    text: String,
}

/// Returns the annotated dump of a bundle; each of its bytes appears exactly once.
///
/// # Errors
/// [`DecodeError`] when `bytes` is not a sound bundle.
pub fn annotate(bytes: &[u8]) -> Result<String, DecodeError> {
    let bundle = Bundle::parse(bytes)?;
    let mut dump = Dump { bytes, position: 0, text: String::new() };
    dump.header();
    dump.heads(&bundle);
    dump.tables(&bundle);
    for chunk in bundle.chunks() {
        dump.record(&chunk);
    }
    for chunk in bundle.chunks() {
        chunk.check()?;
        dump.chunk(&bundle, &chunk)?;
    }
    Ok(dump.text)
}

impl Dump<'_> {
    fn heading(&mut self, title: &str) {
        let rule = if self.position == 0 { "" } else { "\n" };
        // Writing to a string never fails.
        let _ = writeln!(self.text, "{rule}{:06x}  -- {title}", self.position);
    }

    /// The next `N` bytes, one field.
    fn field<const N: usize, T: Display>(&mut self, name: &str, meaning: impl Fn([u8; N]) -> T) {
        let bytes: [u8; N] = std::array::from_fn(|i| self.bytes.get(self.position + i).copied().unwrap_or_default());
        self.line(N, &format!("{name}: {}", meaning(bytes)));
    }

    /// The next `n` fields of `N` bytes, several to a line.
    fn array<const N: usize, T: Display>(&mut self, name: &str, n: usize, meaning: impl Fn([u8; N]) -> T) {
        let per_line = LINE_BYTES / N;
        for first in (0..n).step_by(per_line) {
            let n_here = per_line.min(n - first);
            let items = self.bytes[self.position..self.position + n_here * N].as_chunks::<N>().0;
            let values: Vec<String> = items.iter().map(|&item| meaning(item).to_string()).collect();
            self.line(n_here * N, &format!("{name}[{first}..{}]: {}", first + n_here, values.join(" ")));
        }
    }

    fn line(&mut self, n_bytes: usize, meaning: &str) {
        let end = self.position + n_bytes;
        let mut meaning = Some(meaning);
        for bytes in self.bytes[self.position..end].chunks(LINE_BYTES) {
            let hex: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
            let line = format!("{:06x}  {:23}  {}", self.position, hex.join(" "), meaning.take().unwrap_or_default());
            let _ = writeln!(self.text, "{}", line.trim_end());
            self.position += bytes.len();
        }
    }

    fn header(&mut self) {
        self.heading("header");
        self.field::<8, _>("magic", |bytes| bytes.escape_ascii().to_string());
        self.field("version", u16::from_le_bytes);
        self.field("header_len", u16::from_le_bytes);
        self.field("file_len", u32::from_le_bytes);
        self.field("effects", |bytes| format!("{:#05b}", u32::from_le_bytes(bytes)));
        self.field("F", u16::from_le_bytes);
        self.field("K", u16::from_le_bytes);
        self.field("n_anchors", u32::from_le_bytes);
        self.field("n_chunks", u32::from_le_bytes);
        self.field("max_chunk_anchors", u16::from_le_bytes);
        self.field::<1, _>("camera convention", |[byte]| byte);
        self.field::<1, _>("n_sections", |[byte]| byte);
        self.array("training size", 2, u16::from_le_bytes);
        self.array::<1, _>("background", 3, |[byte]| byte);
        self.field::<1, _>("reserved", |[byte]| byte);
        self.field("voxel_size", f32::from_le_bytes);
        self.array("normalisation centre", 3, f64::from_le_bytes);
        self.field("normalisation scale", f64::from_le_bytes);
        self.array("preview rotation", 9, f32::from_le_bytes);
        self.array("preview translation", 3, f32::from_le_bytes);
        self.array("preview focal", 2, f32::from_le_bytes);
        self.array("preview principal", 2, f32::from_le_bytes);
        self.array("preview size", 2, u16::from_le_bytes);
        for name in ["heads", "tables", "directory", "chunks"] {
            self.field::<4, _>(&format!("section {name}, kind"), |[kind, ..]| kind);
            self.field(&format!("section {name}, offset"), u32::from_le_bytes);
            self.field(&format!("section {name}, len"), u32::from_le_bytes);
            self.crc(&format!("section {name}, crc"));
        }
        self.crc("header crc");
        debug_assert_eq!(self.position, HEADER_LEN, "the header's fields fill it");
    }

    fn crc(&mut self, name: &str) {
        self.field(name, |bytes| format!("{:#010x}", u32::from_le_bytes(bytes)));
    }

    fn heads(&mut self, bundle: &Bundle<'_>) {
        let heads = bundle.heads();
        for (name, head) in [("opacity", heads.opacity), ("covariance", heads.covariance), ("colour", heads.colour)] {
            self.heading(&format!("{name} head"));
            for (part, halves) in [("W1", head.w1), ("b1", head.b1), ("W2", head.w2), ("b2", head.b2)] {
                self.array(part, halves.len(), f16::from_le_bytes);
            }
        }
    }

    fn tables(&mut self, bundle: &Bundle<'_>) {
        let tables = bundle.tables();
        self.heading("tables");
        self.field("n_tables", u16::from_le_bytes);
        self.field("n_channels", u16::from_le_bytes);
        self.array("table of channel", tables.n_channels(), u16::from_le_bytes);
        self.array("table offset", tables.len(), u32::from_le_bytes);
        for (index, table) in (0..tables.len()).filter_map(|index| Some((index, tables.get(index)?))) {
            self.heading(&format!("table {index}"));
            self.field("origin", f32::from_le_bytes);
            self.field("step", f32::from_le_bytes);
            self.field("min_symbol", i16::from_le_bytes);
            self.field("n_symbols", u16::from_le_bytes);
            self.array("ends", table.n_symbols(), u16::from_le_bytes);
        }
    }

    fn record(&mut self, chunk: &Chunk<'_>) {
        self.heading(&format!("directory record of chunk {}", chunk.index()));
        self.field("offset", u32::from_le_bytes);
        self.field("len", u32::from_le_bytes);
        self.crc("crc");
        self.field("n_anchors", u16::from_le_bytes);
        self.field("reserved", u16::from_le_bytes);
        self.array("ink box, lowest", 3, f32::from_le_bytes);
        self.array("ink box, highest", 3, f32::from_le_bytes);
    }

    /// The chunk's fields, then what they decode to, in lines without bytes.
    fn chunk(&mut self, bundle: &Bundle<'_>, chunk: &Chunk<'_>) -> Result<(), DecodeError> {
        const FIXED_LEN: usize = 16;
        let tables = bundle.tables();
        let n_word_bytes = chunk.anchors(tables)?.n_word_bytes();
        self.heading(&format!("chunk {}", chunk.index()));
        self.array("lattice base", 3, i32::from_le_bytes);
        self.array::<1, _>("offset bits", 3, |[byte]| byte);
        self.field::<1, _>("reserved", |[byte]| byte);
        let n_lattice_bytes = chunk.n_bytes() - FIXED_LEN - n_word_bytes;
        self.array::<1, _>("packed offsets", n_lattice_bytes, |[byte]| format!("{byte:08b}"));
        self.array("words", n_word_bytes / 2, |bytes| format!("{:04x}", u16::from_le_bytes(bytes)));
        let n_anchors = usize::from(chunk.n_anchors());
        let (mut lattice, mut symbols) = (vec![[0; 3]; n_anchors], vec![0; n_anchors * tables.n_channels()]);
        chunk.decode_symbols(tables, &mut lattice, &mut symbols)?;
        for (cell, row) in lattice.iter().zip(symbols.chunks(tables.n_channels())) {
            let _ = writeln!(self.text, "{:33}anchor at {cell:?}: symbols {row:?}", "");
        }
        Ok(())
    }
}
