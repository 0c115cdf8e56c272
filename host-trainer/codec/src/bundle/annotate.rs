//! A bundle byte by byte: every field with its offset, its bytes and its meaning.

mod dump;

use half::f16;
use pocketsplat_format::bundle::{ALIGNMENT, AnchorModels, AnchorSite, Chunk, PROTOCOL_CODE, Section};
use pocketsplat_format::context::{N_LEVELS, N_POSITION_INPUTS, first_tap};

use pocketsplat_format::{Bundle, DecodeError, SectionKind};

use dump::Dump;

/// Returns the annotated dump of a bundle, in file order.
///
/// * `array_lines`: lines of an array, of the chunk records and of a chunk's anchors at most, the rest is counted; with
///   `usize::MAX` each of the file's bytes appears exactly once.
///
/// # Errors
/// [`DecodeError`] when `bytes` is not a sound bundle.
pub fn annotate(bytes: &[u8], array_lines: usize) -> Result<String, DecodeError> {
    let bundle = Bundle::parse(bytes)?;
    let mut annotator = Annotator { dump: Dump::new(bytes, array_lines), bundle };
    annotator.header();
    for section in bundle.sections() {
        annotator.section(&section)?;
        annotator.dump.padding();
    }
    Ok(annotator.dump.into_text())
}

/// Writes the fields of a bundle section by section.
struct Annotator<'f> {
    dump: Dump<'f>,
    bundle: Bundle<'f>,
}

/// Section names as `FORMAT.md` has them.
fn name(kind: SectionKind) -> &'static str {
    match kind {
        SectionKind::Heads => "heads",
        SectionKind::Lattice => "lattice",
        SectionKind::Masks => "masks",
        SectionKind::Tables => "tables",
        SectionKind::Context => "context",
        SectionKind::Manifest => "manifest",
        SectionKind::Directory => "directory",
        SectionKind::Chunks => "chunks",
        SectionKind::Gaussians => "gaussians",
        _ => "unknown",
    }
}

impl<'f> Annotator<'f> {
    fn header(&mut self) {
        let dump = &mut self.dump;
        dump.heading("header");
        dump.field::<8, _>("magic", |bytes| bytes.escape_ascii().to_string());
        dump.field("version", u16::from_le_bytes);
        dump.field("header_len", u16::from_le_bytes);
        dump.field("file_len", u32::from_le_bytes);
        dump.field("required features", |bytes| format!("{:#09b}", u32::from_le_bytes(bytes)));
        dump.field("optional features", |bytes| format!("{:#b}", u32::from_le_bytes(bytes)));
        dump.field("F", u16::from_le_bytes);
        dump.field("K", u16::from_le_bytes);
        dump.field("n_anchors", u32::from_le_bytes);
        dump.field("n_chunks", u32::from_le_bytes);
        dump.field("max_chunk_anchors", u16::from_le_bytes);
        dump.field("camera convention", u8::from_le_bytes);
        dump.field("n_sections", u8::from_le_bytes);
        dump.array("training size", 2, u16::from_le_bytes);
        dump.array("background", 3, u8::from_le_bytes);
        dump.field("n_tiers", u8::from_le_bytes);
        dump.field("voxel_size", f32::from_le_bytes);
        dump.field("colour hidden", u16::from_le_bytes);
        dump.field("detail hidden", u16::from_le_bytes);
        dump.array("normalisation centre", 3, f64::from_le_bytes);
        dump.field("normalisation scale", f64::from_le_bytes);
        dump.array("preview rotation", 9, f32::from_le_bytes);
        dump.array("preview translation", 3, f32::from_le_bytes);
        dump.array("preview focal", 2, f32::from_le_bytes);
        dump.array("preview principal", 2, f32::from_le_bytes);
        dump.array("preview size", 2, u16::from_le_bytes);
        dump.array("symbol bits", 3, u8::from_le_bytes);
        dump.field("reserved", u8::from_le_bytes);
        for section in self.bundle.sections() {
            let name = name(section.kind);
            dump.field::<4, _>(&format!("section {name}, kind"), |[kind, ..]| kind);
            dump.field(&format!("section {name}, offset"), u32::from_le_bytes);
            dump.field(&format!("section {name}, len"), u32::from_le_bytes);
            dump.crc(&format!("section {name}, crc"));
        }
        dump.crc("header crc");
    }

    fn section(&mut self, section: &Section) -> Result<(), DecodeError> {
        match section.kind {
            SectionKind::Heads => self.heads(section),
            SectionKind::Lattice => self.lattice(),
            SectionKind::Masks => self.masks(),
            SectionKind::Tables => self.tables(),
            SectionKind::Context => self.context(),
            SectionKind::Manifest => self.manifest(),
            SectionKind::Directory => self.directory(),
            SectionKind::Chunks => return self.chunks(),
            SectionKind::Gaussians => {
                self.dump.heading("gaussians");
                self.dump.array("Gaussians up to each tier", section.len as usize / 4, u32::from_le_bytes);
            }
            SectionKind::Other(PROTOCOL_CODE) => {
                self.dump.heading("protocol");
                self.dump.array::<1, _>("text", section.len as usize, |[byte]| char::from(byte));
            }
            _ => {
                self.dump.heading(&format!("section of kind {}", section.code()));
                self.dump.array("bytes", section.len as usize, u8::from_le_bytes);
            }
        }
        Ok(())
    }

    fn heads(&mut self, section: &Section) {
        let heads = *self.bundle.heads();
        let names = ["opacity", "covariance", "colour", "detail"].into_iter();
        let dump = &mut self.dump;
        let Some(coded) = heads.coded() else {
            for (name, head) in names.zip(heads.each()) {
                dump.heading(&format!("{name} head"));
                let (w1, w2) = (head.n_hidden * head.n_in, head.n_out * head.n_hidden);
                for (part, n) in [("W1", w1), ("b1", head.n_hidden), ("W2", w2), ("b2", head.n_out)] {
                    dump.array(part, n, f16::from_le_bytes);
                }
            }
            return;
        };
        let begin = dump.position();
        for (layer, table) in ["W1", "W2"].into_iter().zip(coded.tables) {
            dump.heading(&format!("heads, table of all {layer}"));
            table_record(dump, table.n_symbols());
        }
        dump.heading("heads, biases");
        for (name, head) in names.zip(heads.each()) {
            dump.array(&format!("{name} b1"), head.n_hidden, f16::from_le_bytes);
            dump.array(&format!("{name} b2"), head.n_out, f16::from_le_bytes);
        }
        dump.heading("heads, stream");
        let n_words = (section.len as usize - (dump.position() - begin)) / 2;
        dump.array("words", n_words, word);
    }

    fn lattice(&mut self) {
        let n_levels = self.bundle.lattice().trie.n_levels();
        self.dump.heading("lattice");
        self.dump.array("min", 3, i32::from_le_bytes);
        self.dump.field("bits an axis", u8::from_le_bytes);
        self.dump.array("reserved", 3, u8::from_le_bytes);
        for level in 0..n_levels {
            // Three contexts of two ends.
            self.dump.array(&format!("level {level}"), 6, u16::from_le_bytes);
        }
    }

    fn masks(&mut self) {
        self.dump.heading("masks");
        for offset in 0..usize::from(self.bundle.header().n_offsets) {
            self.dump.array(&format!("offset {offset}"), 4, u16::from_le_bytes);
        }
    }

    fn tables(&mut self) {
        let Some(tables) = self.bundle.tables() else { return };
        let dump = &mut self.dump;
        dump.heading("tables");
        dump.field("n_tables", u16::from_le_bytes);
        dump.field("n_channels", u16::from_le_bytes);
        dump.array("table of channel", tables.n_channels(), u16::from_le_bytes);
        dump.array("table offset", tables.len(), u32::from_le_bytes);
        for (index, table) in (0..tables.len()).filter_map(|index| Some((index, tables.get(index)?))) {
            dump.heading(&format!("table {index}"));
            table_record(dump, table.n_symbols());
        }
    }

    fn context(&mut self) {
        let Some(context) = self.bundle.context() else { return };
        let (n_hidden, n_out) = (context.n_hidden(), context.n_outputs());
        let dump = &mut self.dump;
        dump.heading("context");
        dump.array("grid min", 3, i32::from_le_bytes);
        dump.array("grid scale", 3, u32::from_le_bytes);
        dump.array("base steps", 3, f32::from_le_bytes);
        dump.field("n_levels", u8::from_le_bytes);
        dump.field("n_taps", u8::from_le_bytes);
        dump.field("n_hidden", u16::from_le_bytes);
        let mut n_rows = 0;
        for (index, level) in context.levels().enumerate() {
            dump.field(&format!("level {index}, kind"), u8::from_le_bytes);
            dump.field(&format!("level {index}, reserved"), u8::from_le_bytes);
            dump.field(&format!("level {index}, resolution"), u16::from_le_bytes);
            dump.field(&format!("level {index}, n_rows"), u32::from_le_bytes);
            n_rows += level.n_rows as usize;
        }
        let levels = if context.level_shifts().is_some() { (0..N_LEVELS).rev() } else { (0..1).rev() };
        if context.level_shifts().is_some() {
            dump.array("shifts of levels", 3, u8::from_le_bytes);
            dump.field("reserved", u8::from_le_bytes);
        }
        for level in levels {
            let n_parent = if level + 1 < N_LEVELS { context.n_parent_inputs() } else { 0 };
            let n_in = if context.level_shifts().is_some() { N_POSITION_INPUTS + n_parent } else { context.n_inputs() };
            dump.array("shift1", n_hidden, u8::from_le_bytes);
            dump.array("shift2", n_out, u8::from_le_bytes);
            dump.array("b1", n_hidden, i32::from_le_bytes);
            dump.array("b2", n_out, i32::from_le_bytes);
            dump.array("W1", n_hidden * n_in, i8::from_le_bytes);
            dump.array("W2", n_out * n_hidden, i8::from_le_bytes);
        }
        dump.array("taps", first_tap(context.feature_dim(), context.n_taps()), i8::from_le_bytes);
        dump.array::<1, _>("grid rows", n_rows.div_ceil(2), |[byte]| format!("{byte:08b}"));
    }

    fn manifest(&mut self) {
        let dump = &mut self.dump;
        for tier in 0..self.bundle.header().n_tiers {
            dump.heading(&format!("manifest, tiers up to {tier}"));
            dump.field("PSNR, dB", f32::from_le_bytes);
            dump.field("n_views", u16::from_le_bytes);
            dump.field("n_cameras", u16::from_le_bytes);
            dump.field("most visible anchors", u32::from_le_bytes);
            dump.field("most splats", u32::from_le_bytes);
            dump.array("most splats of a strip of 1, 2, 4, 8", 4, u32::from_le_bytes);
            dump.array("most tile pairs of a strip of 1, 2, 4, 8", 4, u32::from_le_bytes);
            dump.field("most multiply-adds of the heads, 1024s", u32::from_le_bytes);
            dump.field("most pixel evaluations, 1024s", u32::from_le_bytes);
            dump.field("most decoded anchors", u32::from_le_bytes);
            dump.field("level", u8::from_le_bytes);
            dump.array("reserved", 3, u8::from_le_bytes);
        }
    }

    fn directory(&mut self) {
        let dump = &mut self.dump;
        dump.heading("directory");
        for tier in 0..self.bundle.header().n_tiers {
            dump.array(&format!("tiers up to {tier}: n_chunks, n_anchors, end"), 3, u32::from_le_bytes);
        }
        dump.array("ink frame, min", 3, f32::from_le_bytes);
        dump.array("ink frame, step", 3, f32::from_le_bytes);
        let n_chunks = self.bundle.header().n_chunks as usize;
        let n_shown = dump.n_shown(n_chunks);
        for index in 0..n_shown {
            dump.heading(&format!("directory record of chunk {index}"));
            dump.field("len", u32::from_le_bytes);
            dump.crc("crc");
            dump.field("n_anchors", u16::from_le_bytes);
            dump.field("reserved", u16::from_le_bytes);
            dump.array("ink box, low", 3, u16::from_le_bytes);
            dump.array("ink box, high", 3, u16::from_le_bytes);
        }
        dump.skip(pocketsplat_format::bundle::CHUNK_RECORD_LEN * (n_chunks - n_shown), "records of other chunks");
    }

    fn chunks(&mut self) -> Result<(), DecodeError> {
        let bundle = self.bundle;
        let mut words = vec![0; bundle.anchor_scratch_words()];
        let mut models = bundle.anchor_models(&mut words)?;
        let n_shown = self.dump.n_shown(bundle.n_chunks() as usize);
        let (shown, rest): (Vec<_>, Vec<_>) = bundle.chunks().partition(|chunk| (chunk.index() as usize) < n_shown);
        for chunk in &shown {
            self.chunk(chunk, &mut models)?;
        }
        let n_bytes = rest.iter().map(|chunk| chunk.n_bytes().next_multiple_of(ALIGNMENT as usize)).sum();
        self.dump.skip(n_bytes, "words of other chunks");
        Ok(())
    }

    /// The chunk's words, then what they decode to, in lines without bytes.
    fn chunk(&mut self, chunk: &Chunk<'f>, models: &mut AnchorModels<'f, '_>) -> Result<(), DecodeError> {
        let dump = &mut self.dump;
        dump.heading(&format!("chunk {}", chunk.index()));
        dump.array("words", chunk.n_bytes() / 2, word);
        let (n_anchors, n_channels) = (usize::from(chunk.n_anchors()), self.bundle.header().n_channels());
        let (mut sites, mut symbols) = (vec![AnchorSite::default(); n_anchors], vec![0; n_anchors * n_channels]);
        chunk.decode_symbols(models, &mut sites, &mut symbols)?;
        let n_shown = dump.n_shown(n_anchors);
        for (site, row) in sites.iter().zip(symbols.chunks(n_channels)).take(n_shown) {
            let mask = format!("{:0k$b}", site.mask, k = usize::from(self.bundle.header().n_offsets));
            dump.remark(&format!("anchor at {:?}, drawn {mask}: symbols {row:?}", site.lattice));
        }
        if n_shown < n_anchors {
            dump.remark(&format!("… {} more anchors", n_anchors - n_shown));
        }
        dump.padding();
        Ok(())
    }
}

/// A table's fields and its `n_symbols` entries.
fn table_record(dump: &mut Dump<'_>, n_symbols: usize) {
    dump.field("origin", f32::from_le_bytes);
    dump.field("step", f32::from_le_bytes);
    dump.field("min_symbol", i16::from_le_bytes);
    dump.field("n_symbols", u16::from_le_bytes);
    dump.array("bounds", n_symbols + 2, u16::from_le_bytes);
}

fn word(bytes: [u8; 2]) -> String {
    format!("{:04x}", u16::from_le_bytes(bytes))
}
