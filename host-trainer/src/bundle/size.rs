//! Where the bytes of a bundle went.

use pocketsplat_core::entropy::{FREQUENCY_TOTAL, SymbolModel};
use pocketsplat_core::{Bundle, DecodeError};

/// Bytes of a bundle by what they hold, and bits that its tables promise.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct SizeReport {
    /// Anchors of the scene.
    pub n_anchors: usize,
    /// The whole file.
    pub total: usize,
    /// Header with the section table.
    pub header: usize,
    /// f16 weights.
    pub heads: usize,
    /// Quantisation and frequency tables.
    pub tables: usize,
    /// Records of the chunks.
    pub directory: usize,
    /// Fixed fields of the chunks and packed lattice offsets.
    pub lattice: usize,
    /// ANS words.
    pub symbols: usize,
    /// Bits of the features by their tables' frequencies, before ANS rounds them to words.
    pub feature_bits: f64,
    /// Bits of the log-scales, likewise.
    pub log_scale_bits: f64,
    /// Bits of the offsets, likewise.
    pub offset_bits: f64,
}

impl SizeReport {
    /// Adds up the parts of `bundle`; decodes all of it.
    ///
    /// # Errors
    /// [`DecodeError`] naming a damaged chunk.
    pub fn of(bundle: &Bundle<'_>) -> Result<Self, DecodeError> {
        let header = bundle.header();
        let heads = bundle.heads();
        let halves: usize = [heads.opacity, heads.covariance, heads.colour]
            .iter()
            .map(|head| head.w1.len() + head.b1.len() + head.w2.len() + head.b2.len())
            .sum();
        let tables = bundle.tables();
        let table_bytes: usize = (0..tables.len()).filter_map(|i| tables.get(i)).map(|t| 16 + 2 * t.n_symbols()).sum();
        let mut report = Self {
            n_anchors: header.n_anchors as usize,
            total: header.file_len as usize,
            header: pocketsplat_core::bundle::HEADER_LEN,
            heads: 2 * halves,
            tables: 4 + 2 * tables.n_channels() + table_bytes,
            directory: 40 * header.n_chunks as usize,
            ..Self::default()
        };
        let first_log_scale = usize::from(header.feature_dim);
        let costs: Vec<_> = tables.of_channels().collect();
        for chunk in bundle.chunks() {
            let n_anchors = usize::from(chunk.n_anchors());
            let mut lattice = vec![[0; 3]; n_anchors];
            let mut symbols = vec![0; n_anchors * costs.len()];
            chunk.decode_symbols(tables, &mut lattice, &mut symbols)?;
            let words = chunk.anchors(tables)?.n_word_bytes();
            report.symbols += words;
            report.lattice += chunk.n_bytes() - words;
            for row in symbols.chunks_exact(costs.len()) {
                for (channel, (&symbol, table)) in row.iter().zip(&costs).enumerate() {
                    let bits = symbol_bits(table, symbol);
                    match channel.checked_sub(first_log_scale) {
                        None => report.feature_bits += bits,
                        Some(0..6) => report.log_scale_bits += bits,
                        Some(_) => report.offset_bits += bits,
                    }
                }
            }
        }
        Ok(report)
    }

    /// Bytes of the chunks per anchor, directory included; what more anchors would cost.
    pub fn bytes_per_anchor(&self) -> f64 {
        (self.directory + self.lattice + self.symbols) as f64 / self.n_anchors.max(1) as f64
    }
}

/// Information content of `symbol`, with the 16 raw bits of an escaped one.
fn symbol_bits(table: &pocketsplat_core::bundle::Table<'_>, symbol: i16) -> f64 {
    let bits = |frequency: u16| (f64::from(FREQUENCY_TOTAL) / f64::from(frequency)).log2();
    let entry = usize::try_from(i32::from(symbol) - i32::from(table.min_symbol)).ok();
    let start = |entry: usize| entry.checked_sub(1).and_then(|before| table.ends().nth(before)).unwrap_or(0);
    match entry.and_then(|entry| table.ends().nth(entry).map(|end| end - start(entry))) {
        Some(frequency) if frequency > 0 => bits(frequency),
        _ => bits(table.slot(FREQUENCY_TOTAL - 1).frequency) + 16.0,
    }
}
